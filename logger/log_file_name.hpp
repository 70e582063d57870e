#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace seastitch {

// `pattern` with its strftime conversions filled in for a system time (UTC).
std::filesystem::path LogFileName(const std::string& pattern, std::int64_t utime);

// The n-th name beside a path that is taken: survey.lcmlog, survey.1.lcmlog, survey.2.lcmlog.
std::filesystem::path NumberedName(const std::filesystem::path& path, int n);

}  // namespace seastitch
