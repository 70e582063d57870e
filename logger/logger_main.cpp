#include <chrono>
#include <cstdlib>

#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/process.hpp"
#include "logger/logger_config.hpp"
#include "logger/logger_node.hpp"

namespace seastitch {
namespace {

int Run(const ProcessArgs& args) {
  const LoggerConfig config = LoadLoggerConfig(args.config);
  if (args.check_config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  LoggerNode node(config, &bus);
  loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
  loop.Every(std::chrono::seconds(1), [&] { node.UpdateHealth(); });
  node.health().PublishEverySecond(&bus, &loop);
  const int code = loop.Run();
  bus.HandleUntilQuiet();
  node.Finish();
  return code;
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  return seastitch::RunProcess(
      argc, argv, "seastitch-logger", "Records every LCM channel to an event log.", seastitch::Run);
}
