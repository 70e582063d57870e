#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <optional>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/files/folder_lock.hpp"
#include "common/runtime/process/process.hpp"
#include "logger/logger_config.hpp"
#include "logger/logger_node.hpp"

namespace seastitch {
namespace {

// Locks the dive's folder: two loggers of one dive would record every message twice. Throws
// FolderInUse. Any other error of the lock is only logged: it must not prevent recording.
std::optional<FolderLock> LockOf(const std::filesystem::path& folder) {
  try {
    return std::optional<FolderLock>(std::in_place, folder);
  } catch (const FolderInUse&) {
    throw;
  } catch (const std::runtime_error& e) {
    spdlog::warn("{}", e.what());
    return std::nullopt;
  }
}

int Run(const ProcessArgs& args) {
  const auto config = LoadConfig(args, LoadLoggerConfig, [&](const LoggerConfig& read) {
    CheckDivesDir(read.dive, args.config);
  });
  if (!config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  const DiveFolder dive(config->dive, "logger", NowUtime(), DiveFolder::JoinNewest::kIfDiskFailed);
  const std::optional<FolderLock> lock = LockOf(dive.log());
  dive.Enter(NowUtime());
  LoggerNode node(*config, dive, &bus);
  node.health().HoldIf(!dive.damaged().empty(), conditions::kDiveDamaged, dive.damaged());
  DiveKeeper keeper(dive);
  loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
  loop.Every(std::chrono::seconds(1), [&] { node.UpdateHealth(); });
  node.health().PublishEverySecond(&bus, &loop);
  node.RequestConfiguration();
  ConfigPublisher configuration(ConfigParts("logger", {{"logger.yaml", PrintConfig(*config)}}),
                                &bus);
  configuration.SendBy(&loop);
  const int code = loop.Run();
  bus.HandleUntilQuiet();
  node.Finish();
  keeper.End();
  return code;
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  return seastitch::RunProcess(
      argc, argv, "seastitch-logger", "Records every LCM channel to an event log.", seastitch::Run);
}
