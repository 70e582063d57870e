#include <cstdlib>

#include "common/runtime/process.hpp"
#include "drivers/mbes/mbes_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-mbes-driver",
                    "Multibeam sonar over UDP to MBES_PING, SVP and RAW_MBES",
                    [](const ProcessArgs& args) {
                      const MbesDriverConfig config = LoadMbesDriverConfig(args.config);
                      if (args.check_config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      MbesDriver driver(config, &bus);
                      return RunDatagramDriver(&driver, config.driver, &loop);
                    });
}
