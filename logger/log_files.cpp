#include "logger/log_files.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Of 012.lcmlog: 12.
std::optional<int> NumberOf(const fs::path& file) {
  const std::string stem = file.stem().string();
  int number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool is_number = error == std::errc() && end == stem.data() + stem.size() && number >= 0;
  return is_number ? std::optional(number) : std::nullopt;
}

}  // namespace

fs::path NextLogFile(const fs::path& folder) {
  std::error_code error;
  int next = 0;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const auto number = NumberOf(entry.path())) next = std::max(next, *number + 1);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  char name[32];
  std::snprintf(name, sizeof name, "%03d.lcmlog", next);
  return folder / name;
}

}  // namespace seastitch
