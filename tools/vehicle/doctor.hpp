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
  bool under_water = false;  // depth is not expected to be near 0
  bool json = false;
};

struct Examination {
  Findings findings;
  ProcessRoll roll;  // who was heard
  RunningConfigs configs;
};

// Everything that can be checked before a dive, in at most 10 s. Nothing is changed; one trial file
// is written where the dives are, and removed.
Examination Examine(const DoctorOptions& options, const Machine& machine = {});

// `seastitch doctor`: prints the findings. Gives 0: all is well; 1: warnings; 2: errors.
int RunDoctor(const DoctorOptions& options);

}  // namespace seastitch
