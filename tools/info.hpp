#pragma once

#include <filesystem>
#include <optional>

namespace seastitch {

struct InfoOptions {
  std::filesystem::path log;
  bool json = false;
  // Writes every whole event of the log to this file.
  std::optional<std::filesystem::path> repair_to;
};

// `seastitch info`: one line a channel, then what is wrong with the log.
int RunInfo(const InfoOptions& options);

}  // namespace seastitch
