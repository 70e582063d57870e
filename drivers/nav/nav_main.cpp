#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/nav/nav_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-nav-driver",
      "INS to INS, GPS and USBL to POSITION_FIX, pressure sensor to DEPTH, over UDP, serial ports "
      "or CAN; with RAW_NAV",
      [](const ProcessArgs& args) {
        const auto config = LoadConfig(args, LoadNavDriverConfig);
        if (!config) return EXIT_SUCCESS;
        if (config->sources().empty())
          throw ConfigError(args.config +
                            ": ins.source, gps.source, usbl.source, depth.source: all are empty, "
                            "and there is nothing to read");
        EventLoop loop;
        Bus bus(args.lcm_url);
        BusOutput output(&bus);
        NavDriver driver(*config, &output);
        ConfigPublisher configuration(
            ConfigParts("nav-driver", ConfigFiles(*config)), &bus, ConfigPublisher::When::kByTimer);
        configuration.SendBy(&loop);
        return RunNavDriver(*config, &driver, &bus, &loop);
      });
}
