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

// Callback with the completed fraction of the survey, 0 to 1. Returning false ends it.
using Progress = std::function<bool(double)>;

struct LogResult {
  std::int64_t events = 0;                       // in the log
  std::map<std::string, std::int64_t> channels;  // of these, by channel
};

// Writes the survey as the LCM log that the logger would have recorded. The devices' bytes go
// through the real drivers, in this process, with simulated receive times. The same survey gives
// the same file. The log begins with `configuration`, as processes publish it at their start. The
// truth is written to TruthPathFor(path). Throws std::runtime_error with the name of the file.
LogResult WriteLog(SurveySimulator* simulator,
                   const DriverConfigs& drivers,
                   std::vector<config_t> configuration,
                   const std::filesystem::path& path,
                   const Progress& progress);

}  // namespace seastitch::bench
