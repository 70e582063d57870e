#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/simulator.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "seastitch/config_t.hpp"

namespace seastitch::bench {

struct DriverConfigs {
  ImuDriverConfig imu;
  DvlDriverConfig dvl;
  MbesDriverConfig mbes;

  DeviceSignals signals() const { return {imu.can.signals, dvl.can.signals}; }
};
// imu_driver.yaml, dvl_driver.yaml and mbes_driver.yaml of a folder. Throws ConfigError.
DriverConfigs LoadDriverConfigs(const std::filesystem::path& folder);

// Part of the survey done, 0 to 1. False stops.
using Progress = std::function<bool(double)>;

struct LogResult {
  std::int64_t events = 0;                       // in the log
  std::map<std::string, std::int64_t> channels;  // of these, on each
};

// The survey as the LCM log that the logger would have made of it: the devices' bytes go through
// the drivers themselves, in this process, on simulated receive times. The same survey gives the
// same file. Begins with `configuration`, as the processes publish it at their start. Writes the
// truth to TruthPathFor(path). Throws std::runtime_error naming the file.
LogResult WriteLog(SurveySimulator* simulator,
                   const DriverConfigs& drivers,
                   std::vector<config_t> configuration,
                   const std::filesystem::path& path,
                   const Progress& progress);

}  // namespace seastitch::bench
