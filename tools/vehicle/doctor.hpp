#pragma once

#include <filesystem>
#include <string>

#include "tools/vehicle/bus_checks.hpp"
#include "tools/vehicle/finding.hpp"
#include "tools/vehicle/machine.hpp"

namespace seastitch {

struct DoctorOptions {
  std::filesystem::path config_dir;
  std::string lcm_url;       // empty: LCM_DEFAULT_URL, else that of the units
  bool under_water = false;  // a depth far from 0 is no finding
  bool json = false;
};

struct Examination {
  Findings findings;
  ProcessRoll roll;  // processes with HEALTH messages
  RunningConfigs configs;
};

// All checks before a dive, in at most 10 s whatever hangs. Nothing is changed, except for a test
// file in the folder of the dives, which has no name.
Examination Examine(const DoctorOptions& options, const Machine& machine = {});

// `seastitch doctor`: prints the findings. Returns 0: no findings; 1: warnings; 2: errors.
int RunDoctor(const DoctorOptions& options);

}  // namespace seastitch
