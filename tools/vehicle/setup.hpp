#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/runtime/files/dive_folder.hpp"
#include "drivers/device_driver.hpp"
#include "tools/vehicle/finding.hpp"

namespace seastitch {

// The configuration files of all processes.
struct Setup {
  // Files that each process publishes on CONFIG with this configuration: name and text.
  std::map<std::string, std::map<std::string, std::string>> texts;
  std::multimap<std::string, DriverParams> drivers;  // one entry per source
  std::map<std::string, DiveParams> dives;           // of logger and mapper
  // The mapper uses the navigation of an INS: drivers of IMU and DVL need not run, and are left
  // out.
  bool given_navigation = false;
  std::set<std::string> nav_channels;  // of the instruments of the nav-driver
  std::string nav_output_udp;          // URLs to which the nav-output sends; empty: none
  std::string nav_output_serial;
  std::string page_listen;  // address of the page; empty: no page.yaml

  bool Needs(const std::string& process) const;

  std::set<std::string> can_interfaces() const;
  // The largest receive buffer of a driver, and LCM's.
  std::int64_t largest_buffer_bytes() const;
};

// Reads the files of a folder, each with the code of its program. A file that cannot be used is a
// finding, and is left out.
Setup LoadSetup(const std::filesystem::path& config_dir, Findings* findings);

// Findings about files that contradict each other.
Findings CheckTogether(const Setup& setup);

}  // namespace seastitch
