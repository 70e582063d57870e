#include "logger/log_file_name.hpp"

#include <ctime>
#include <vector>

namespace seastitch {

std::filesystem::path LogFileName(const std::string& pattern, std::int64_t utime) {
  const std::time_t seconds = static_cast<std::time_t>(utime / 1'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::vector<char> name(pattern.size() + 1024);
  const std::size_t length = std::strftime(name.data(), name.size(), pattern.c_str(), &utc);
  return std::string(name.data(), length);
}

std::filesystem::path NumberedName(const std::filesystem::path& path, int n) {
  if (n == 0) return path;
  std::filesystem::path name = path.stem();
  name += "." + std::to_string(n);
  name += path.extension();
  return path.parent_path() / name;
}

}  // namespace seastitch
