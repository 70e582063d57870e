#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"

namespace {

using namespace seastitch;

int RunPd0(const ProcessArgs& args) {
  const auto config = LoadConfig(args, LoadPd0DriverConfig);
  if (!config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  BusOutput output(&bus);
  Pd0Driver driver(*config, &output);
  ConfigPublisher configuration(
      ConfigParts("dvl-driver", {{"dvl_driver.yaml", PrintConfig(*config)}}),
      &bus,
      ConfigPublisher::When::kByTimer);
  configuration.SendBy(&loop);
  return RunDatagramDriver(&driver, config->driver, &bus, &loop);
}

int RunCan(const ProcessArgs& args) {
  const auto config = LoadConfig(args, LoadDvlDriverConfig);
  if (!config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  BusOutput output(&bus);
  DvlDriver driver(*config, &output);
  ConfigPublisher configuration(
      ConfigParts("dvl-driver", ConfigFiles(*config)), &bus, ConfigPublisher::When::kByTimer);
  configuration.SendBy(&loop);
  return RunCanDriver(&driver, config->driver, &bus, &loop);
}

}  // namespace

int main(int argc, char** argv) {
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
        return is_pd0 ? RunPd0(args) : RunCan(args);
      });
}
