#include "common/runtime/process/process.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/run_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-imu-driver",
      "Inertial unit on a CAN bus to IMU and RAW_CAN",
      [](const ProcessArgs& args) { return RunDriver<ImuDriver>(args, LoadImuDriverConfig); });
}
