#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/imu/imu_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-imu-driver",
                    "Inertial unit on a CAN bus to IMU and RAW_CAN",
                    [](const ProcessArgs& args) {
                      const auto config = LoadConfig(args, LoadImuDriverConfig);
                      if (!config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      BusOutput output(&bus);
                      ImuDriver driver(*config, &output);
                      ConfigPublisher configuration(ConfigParts("imu-driver", ConfigFiles(*config)),
                                                    &bus,
                                                    ConfigPublisher::When::kByTimer);
                      configuration.SendBy(&loop);
                      return RunCanDriver(&driver, config->driver, &bus, &loop);
                    });
}
