#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace seastitch {

struct InfoOptions {
  std::vector<std::filesystem::path> inputs;  // LCM logs in any order, or the folder of a dive
  bool json = false;
  // Writes every whole event of one log to this file.
  std::optional<std::filesystem::path> repair_to;
};

// `seastitch info`: what is in logs, one line a channel and sender, then what is wrong with them.
// Throws UsageError where more than one log is to be repaired; std::runtime_error as
// EventLogReader.
int RunInfo(const InfoOptions& options);

}  // namespace seastitch
