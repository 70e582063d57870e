#include <cstdlib>

#include "common/runtime/process.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"

namespace {

using namespace seastitch;

int RunPd0(const ProcessArgs& args) {
  const Pd0DriverConfig config = LoadPd0DriverConfig(args.config);
  if (args.check_config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  Pd0Driver driver(config, &bus);
  return RunDatagramDriver(&driver, config.driver, &loop);
}

int RunCan(const ProcessArgs& args) {
  const DvlDriverConfig config = LoadDvlDriverConfig(args.config);
  if (args.check_config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  DvlDriver driver(config, &bus);
  return RunCanDriver(&driver, config.driver, &loop);
}

}  // namespace

int main(int argc, char** argv) {
  return RunProcess(
      argc,
      argv,
      "seastitch-dvl-driver",
      "Doppler log to DVL: on a CAN bus, with DEPTH and RAW_CAN, or over UDP, with RAW_DVL",
      [](const ProcessArgs& args) {
        std::string device;
        ConfigMap::Load(args.config).Read("device", &device);
        return device == "pd0" ? RunPd0(args) : RunCan(args);
      });
}
