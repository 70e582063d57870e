#pragma once

#include <filesystem>
#include <string>

namespace seastitch {

struct BugReportOptions {
  std::filesystem::path
      out;  // NAME.tar.gz, must not exist; empty: seastitch-report-TIME.tar.gz here
  std::filesystem::path config_dir;
  std::string lcm_url;
};

// `seastitch bug-report`: what whoever mends a fault needs, in one file: versions, configuration,
// what the doctor finds, the last HEALTH of each process, the records of the newest dives, units
// and journal of systemd. No sensor's data. What this computer does not have is said in its place.
// Throws std::runtime_error "FILE: reason".
int RunBugReport(const BugReportOptions& options);

}  // namespace seastitch
