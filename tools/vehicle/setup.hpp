#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/runtime/dive_folder.hpp"
#include "drivers/device_driver.hpp"
#include "tools/vehicle/finding.hpp"

namespace seastitch {

// The configuration of all processes, as their files have it.
struct Setup {
  // What each process publishes on CONFIG with these files: name and text of each file.
  std::map<std::string, std::map<std::string, std::string>> texts;
  std::multimap<std::string, DriverParams> drivers;  // one a source
  std::map<std::string, DiveParams> dives;           // of logger and mapper
  // The mapper takes an INS's navigation: drivers of IMU and DVL need not run, and are left out.
  bool given_navigation = false;
  std::set<std::string> nav_channels;  // of the instruments of the nav-driver

  bool Needs(const std::string& process) const;

  std::set<std::string> can_interfaces() const;
  // The largest receive buffer of a driver, and LCM's.
  std::int64_t largest_buffer_bytes() const;
};

// Reads the files of a folder, each with its own program's code. What cannot be used is a finding
// and is left out.
Setup LoadSetup(const std::filesystem::path& config_dir, Findings* findings);

// Files that are right alone and wrong together.
Findings CheckTogether(const Setup& setup);

}  // namespace seastitch
