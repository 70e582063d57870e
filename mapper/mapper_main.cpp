#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/files/folder_lock.hpp"
#include "common/runtime/process/freed_memory.hpp"
#include "common/runtime/process/process.hpp"
#include "mapper/mapper_node.hpp"
#include "mapper/restart/map_starts.hpp"

namespace {

// The node posts one job at a time.
constexpr std::size_t kWorkerQueue = 2;
// Duration of a job that is reported [s].
constexpr double kJobMayTakeS = 1.9;
constexpr double kWriteMayTakeS = 1.9;
// Pause between the last messages: at 48 kB each they make 24 MB/s, which every receiver can
// follow.
constexpr std::chrono::milliseconds kPause(2);

// Same rate as with the slowest inertial unit's messages: 2.4 MB/s.
constexpr std::chrono::milliseconds kSendPeriod(20);

// The optimizer may not be there: then 8 kB/s at most.
constexpr std::chrono::seconds kRepeatPeriod(5);

seastitch::FoundMap OpenMap(const seastitch::MapperConfig& config, seastitch::MapStarts* starts) {
  using namespace seastitch;
  const std::filesystem::path newest = NewestMap(config.map_dir);
  if (!HasJournal(newest)) return FindMap(config.map_dir, ConfigurationOf(config));
  if (starts->ended_soon() >= MapStarts::kMost) {
    FoundMap found = GiveUpMap(newest,
                               "the last " + std::to_string(starts->ended_soon()) +
                                   " mappers ended soon after they had gone on in it");
    // Unless reading these ended the mapper before.
    const bool may_read = starts->ended_soon() == MapStarts::kMost;
    starts->Begin();
    if (may_read) found.profiles = ProfilesOf(newest);
    return found;
  }
  starts->Begin();
  return FindMap(config.map_dir, ConfigurationOf(config));
}

// Folder in memory: systemd's for this unit, which it keeps over restarts of the process.
std::filesystem::path FolderInMemory() {
  const char* const directory = std::getenv("RUNTIME_DIRECTORY");
  return directory != nullptr && *directory != '\0' ? directory : "/dev/shm/seastitch-mapper";
}

// Where a map is written to.
struct MapPlace {
  MapPlace(const seastitch::DiveParams& params, std::string why)
      : dive(params, "mapper", seastitch::NowUtime()),
        lock(dive.map()),
        why_in_memory(std::move(why)) {}

  seastitch::DiveFolder dive;
  seastitch::FolderLock lock;
  std::string why_in_memory;  // why the data disk cannot be used; empty: it can
};

// The newest dive. Where the data disk cannot be used, in memory: NAV does not depend on a disk.
// Throws FolderInUse where another mapper writes there.
std::unique_ptr<MapPlace> OpenPlace(seastitch::DiveParams params) {
  using namespace seastitch;
  try {
    return std::make_unique<MapPlace>(params, "");
  } catch (const FolderInUse&) {
    throw;
  } catch (const std::exception& e) {
    spdlog::warn("{}; the map is kept in memory, in {}", e.what(), FolderInMemory().string());
    std::filesystem::create_directories(FolderInMemory());
    params.dives_dir = FolderInMemory() / "dives";
    return std::make_unique<MapPlace>(params, e.what());
  }
}

// Maps until a signal, or until the time of the sensors goes back. Absent in that case: the next
// call begins a new map.
std::optional<int> RunMap(seastitch::MapperConfig config,
                          const std::string& lcm_url,
                          const MapPlace& place) {
  using namespace seastitch;
  place.dive.Enter(NowUtime());
  std::random_device random;
  config.graph_id = std::uniform_int_distribution<std::int64_t>(
      1, std::numeric_limits<std::int64_t>::max())(random);
  EventLoop loop;
  Bus bus(lcm_url);
  ThreadWorker worker(kWorkerQueue);
  ThreadWorker writer(kWorkerQueue);
  MapStarts starts(NewestMap(config.map_dir));
  MapperNode node(config, &bus, &worker, &writer, OpenMap(config, &starts));
  if (config.navigation_source == NavigationSource::kDeadReckoning)
    spdlog::info(NorthSentence(config.navigation, config.vehicle.datum.latitude_rad));
  node.health().HoldIf(!place.why_in_memory.empty(), conditions::kMapInMemory, place.why_in_memory);
  node.health().HoldIf(
      !place.dive.damaged().empty(), conditions::kDiveDamaged, place.dive.damaged());
  DiveKeeper keeper(place.dive);
  loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
  loop.Add(worker.fd(), [&] { worker.Drain(); });
  loop.Add(writer.fd(), [&] { writer.Drain(); });
  loop.Every(kSendPeriod, [&] {
    node.SendWaiting();
    if (node.TimeWentBack()) loop.Stop();
  });
  loop.Every(kRepeatPeriod, [&] { node.RepeatNewest(); });
  loop.Every(std::chrono::seconds(1), [&] { starts.Tick(node.HasBegun(), MonotonicSeconds()); });
  node.health().WatchAge(
      "registration", conditions::kWorkerStalled, kJobMayTakeS, [&] { return worker.age_s(); });
  node.health().WatchAge(
      "map", conditions::kDiskStalled, kWriteMayTakeS, [&] { return writer.age_s(); });
  node.health().PublishEverySecond(&bus, &loop);
  ConfigPublisher configuration(ConfigParts("mapper", ConfigFiles(config)), &bus);
  configuration.SendBy(&loop);
  const int code = loop.Run();
  const bool again = node.TimeWentBack();
  if (again)
    spdlog::warn("the time of the sensors went back: this map ends, and a new one begins");
  else
    bus.HandleUntilQuiet();  // messages that the drivers sent before they ended
  const auto pause = [] { std::this_thread::sleep_for(kPause); };
  node.Finish(pause);
  while (node.IsBusy()) {
    writer.Finish();
    worker.Finish();
  }
  node.SendAll(pause);
  starts.Survive();
  keeper.End();
  return again ? std::nullopt : std::optional(code);
}

int Run(const seastitch::ProcessArgs& args) {
  using namespace seastitch;
  auto config = LoadConfig(args, LoadMapperConfig, [&](const MapperConfig& read) {
    CheckDivesDir(read.dive, args.config);
  });
  if (!config) return EXIT_SUCCESS;
  const std::unique_ptr<const MapPlace> place = OpenPlace(config->dive);
  config->map_dir = place->dive.map();
  std::optional<int> code;
  while (!code) code = RunMap(*config, args.lcm_url, *place);
  return *code;
}

}  // namespace

int main(int argc, char** argv) {
  seastitch::KeepFreedMemory();
  return seastitch::RunProcess(argc,
                               argv,
                               "seastitch-mapper",
                               "Dead reckoning, submaps and loop closures: sensor messages in, "
                               "SUBMAP and GRAPH_UPDATE out.",
                               Run);
}
