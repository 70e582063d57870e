#include <chrono>
#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/output/nav_output_node.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-nav-output",
      "NAV_CORRECTED or NAV as NMEA 0183 to a UDP or serial port, for autopilots, chart plotters "
      "and gpsd",
      [](const ProcessArgs& args) {
        const auto config = LoadConfig(args, LoadNavOutputConfig);
        if (!config) return EXIT_SUCCESS;
        if (config->outputs().empty())
          throw ConfigError(args.config +
                            ": udp, serial: both are empty, and there is nowhere to send to");
        EventLoop loop;
        Bus bus(args.lcm_url);
        NavOutputNode node(*config, &bus);
        ConfigPublisher configuration(ConfigParts("nav-output", ConfigFiles(*config)), &bus);
        configuration.SendBy(&loop);
        loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
        node.Check();
        loop.Every(std::chrono::seconds(1), [&] { node.Check(); });
        node.health().PublishEverySecond(&bus, &loop);
        return loop.Run();
      });
}
