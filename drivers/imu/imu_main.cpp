#include <cstdlib>

#include "common/runtime/process.hpp"
#include "drivers/imu/imu_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-imu-driver",
                    "Inertial unit on a CAN bus to IMU and RAW_CAN",
                    [](const ProcessArgs& args) {
                      const ImuDriverConfig config = LoadImuDriverConfig(args.config);
                      if (args.check_config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      ImuDriver driver(config, &bus);
                      return RunCanDriver(&driver, config.driver, &loop);
                    });
}
