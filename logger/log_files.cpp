#include "logger/log_files.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/runtime/dive_folder.hpp"

namespace seastitch {

namespace fs = std::filesystem;

fs::path NextLogFile(const fs::path& folder) {
  std::error_code error;
  int next = 0;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const auto number = LogNumber(entry.path())) next = std::max(next, *number + 1);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  return folder / LogName(next);
}

}  // namespace seastitch
