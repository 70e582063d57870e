#include "common/runtime/process/process.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"
#include "drivers/run_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-dvl-driver",
      "Doppler log to DVL: on a CAN bus, with DEPTH and RAW_CAN, or over UDP, with RAW_DVL",
      [](const ProcessArgs& args) {
        const std::string pd0 = Pd0DriverConfig{}.device;
        std::vector<std::string> devices = DvlCanDevices();
        devices.push_back(pd0);
        const bool is_pd0 = !args.config.empty() && DeviceIn(args.config, devices) == pd0;
        return is_pd0 ? RunDriver<Pd0Driver>(args, LoadPd0DriverConfig)
                      : RunDriver<DvlDriver>(args, LoadDvlDriverConfig);
      });
}
