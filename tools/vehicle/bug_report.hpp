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

// `seastitch bug-report`: one file with everything needed to find a fault: versions, configuration,
// the doctor's findings, the last HEALTH of each process (from the bus, or from the newest dive if
// the process is silent), the records of the newest dives, units and journal of systemd. It holds
// no sensor data. A part that this computer lacks is named as missing. Throws std::runtime_error
// "FILE: reason".
int RunBugReport(const BugReportOptions& options);

}  // namespace seastitch
