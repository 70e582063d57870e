#include "tools/vehicle/finding.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/utf8.hpp"
#include "common/runtime/process/process.hpp"
#include "tools/vehicle/terminal_text.hpp"

namespace seastitch {
namespace {

using Level = Finding::Level;

const char* NameOf(Level level) {
  switch (level) {
    case Level::kOk: return "ok";
    case Level::kWarning: return "warning";
    case Level::kError: return "error";
  }
  return "";
}

Level LevelOf(const std::string& name) {
  for (const Level level : {Level::kOk, Level::kWarning})
    if (name == NameOf(level)) return level;
  return Level::kError;
}

}  // namespace

Finding Ok(const std::string& check, const std::string& text) {
  return {Level::kOk, check, text, ""};
}

Finding Warning(const std::string& check, const std::string& text, const std::string& remedy) {
  return {Level::kWarning, check, text, remedy};
}

Finding Error(const std::string& check, const std::string& text, const std::string& remedy) {
  return {Level::kError, check, text, remedy};
}

void Append(const Findings& more, Findings* findings) {
  findings->insert(findings->end(), more.begin(), more.end());
}

Level Worst(const Findings& findings) {
  Level worst = Level::kOk;
  for (const Finding& finding : findings) worst = std::max(worst, finding.level);
  return worst;
}

std::string ToText(const Findings& findings, std::size_t columns) {
  constexpr std::size_t kLevelColumns = 9;
  const std::string indent(kLevelColumns, ' ');
  std::string text;
  const auto add = [&](const std::string& paragraph, std::string level) {
    for (std::string line : Wrap(indent, paragraph, columns)) {
      line.replace(0, level.size(), level);
      text += line + "\n";
      level.clear();
    }
  };
  std::string sum;
  for (const Level level : {Level::kError, Level::kWarning, Level::kOk}) {
    std::set<std::string> remedies;
    std::size_t count = 0;
    for (const Finding& finding : findings) {
      if (finding.level != level) continue;
      ++count;
      add(Printable(finding.text), NameOf(level));
      if (!finding.remedy.empty() && remedies.insert(finding.remedy).second)
        add("-> " + Printable(finding.remedy), "");
    }
    sum += (sum.empty() ? "" : ", ") + std::to_string(count) + " " + NameOf(level);
    if (level != Level::kOk && count != 1) sum += "s";
  }
  return text + sum + "\n";
}

std::string ToJson(const Findings& findings) {
  nlohmann::ordered_json checks = nlohmann::ordered_json::array();
  for (const Finding& finding : findings)
    checks.push_back({{"check", finding.check},
                      {"level", NameOf(finding.level)},
                      {"text", finding.text},
                      {"remedy", finding.remedy}});
  const nlohmann::ordered_json json{
      {"result", NameOf(Worst(findings))}, {"version", ProgramVersion()}, {"checks", checks}};
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::optional<Findings> FromJson(const std::string& text) try {
  Findings findings;
  const nlohmann::json json = nlohmann::json::parse(text);
  for (const auto& check : json.at("checks"))
    findings.push_back({.level = LevelOf(check.at("level")),
                        .check = check.at("check"),
                        .text = check.at("text"),
                        .remedy = check.at("remedy")});
  return findings;
} catch (const nlohmann::json::exception&) {
  return std::nullopt;
}

}  // namespace seastitch
