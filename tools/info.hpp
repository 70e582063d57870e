#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace seastitch {

struct InfoOptions {
  std::vector<std::filesystem::path>
      inputs;  // LCM logs in any order, the folder of a dive, a map, or survey files
  bool json = false;
  // If set, writes all complete events of the log to this file.
  std::optional<std::filesystem::path> repair_to;
};

// `seastitch info`: prints the content of logs, one line per channel and sender, then their faults;
// of a map that a replay made its dives, closures and what it lacks; of survey files PrintSurvey().
// Throws UsageError if more than one log is to be repaired; std::runtime_error as EventLogReader.
int RunInfo(const InfoOptions& options);

}  // namespace seastitch
