#pragma once

#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/process/process.hpp"
#include "drivers/device_driver.hpp"

namespace seastitch {

// The process of a driver: loads its configuration, publishes it on CONFIG, and reads the source
// until a signal. Returns the exit status. See RunProcess().
template <class Driver, class Config>
int RunDriver(const ProcessArgs& args, Config (*load)(const std::string& path)) {
  const auto config = LoadConfig(args, load);
  if (!config) return EXIT_SUCCESS;
  EventLoop loop;
  Bus bus(args.lcm_url);
  BusOutput output(&bus);
  Driver driver(*config, &output);
  ConfigPublisher configuration(ConfigParts(driver.health().process(), ConfigFiles(*config)),
                                &bus,
                                ConfigPublisher::When::kByTimer);
  configuration.SendBy(&loop);
  return Run(&driver, &bus, &loop);
}

}  // namespace seastitch
