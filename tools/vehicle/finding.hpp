#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

// One line of `seastitch doctor`.
struct Finding {
  enum class Level : std::uint8_t { kOk, kWarning, kError };

  Level level = Level::kOk;
  std::string check;   // name of the check, for programs: "disk_free"
  std::string text;    // result with its values, for people
  std::string remedy;  // what to do; empty if nothing
};
using Findings = std::vector<Finding>;

Finding Ok(const std::string& check, const std::string& text);
Finding Warning(const std::string& check, const std::string& text, const std::string& remedy);
Finding Error(const std::string& check, const std::string& text, const std::string& remedy);

void Append(const Findings& more, Findings* findings);
Finding::Level Worst(const Findings& findings);

// Errors first, then warnings, then what is right, and a sum: lines of at most `columns` bytes,
// each with its remedy below, but for one that stands there already.
std::string ToText(const Findings& findings, std::size_t columns);
// {"result": "warning", "version": "...", "checks": [{"check", "level", "text", "remedy"}, ...]}.
std::string ToJson(const Findings& findings);
// The findings of ToJson(); nothing for any other text.
std::optional<Findings> FromJson(const std::string& text);

}  // namespace seastitch
