#include <cstdlib>

#include "common/runtime/process.hpp"
#include "drivers/dvl/dvl_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-dvl-driver",
                    "Doppler log and pressure sensor on a CAN bus to DVL, DEPTH and RAW_CAN",
                    [](const ProcessArgs& args) {
                      const DvlDriverConfig config = LoadDvlDriverConfig(args.config);
                      if (args.check_config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      DvlDriver driver(config, &bus);
                      const auto source = OpenCanSource(config.driver.source,
                                                        driver.filters(),
                                                        config.driver.receive_buffer_bytes);
                      return RunCanDriver(&driver, source.get(), &bus, &loop);
                    });
}
