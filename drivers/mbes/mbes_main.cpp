#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/mbes/mbes_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-mbes-driver",
                    "Multibeam sonar over UDP or TCP to MBES_PING, SVP and RAW_MBES",
                    [](const ProcessArgs& args) {
                      const auto config = LoadConfig(args, LoadMbesDriverConfig);
                      if (!config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      BusOutput output(&bus);
                      MbesDriver driver(*config, &output);
                      ConfigPublisher configuration(
                          ConfigParts("mbes-driver", {{"mbes_driver.yaml", PrintConfig(*config)}}),
                          &bus,
                          ConfigPublisher::When::kByTimer);
                      configuration.SendBy(&loop);
                      return RunDatagramDriver(&driver, config->driver, &bus, &loop);
                    });
}
