// Parameters as text for people: YAML with comments, and the reference page.

#include <algorithm>
#include <cctype>
#include <sstream>

#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kLineWidth = 100;

// The default value as text; empty if the parameter is required or has none.
std::string DefaultText(const Parameter& parameter) {
  return parameter.required() || parameter.IsUnset() ? "" : parameter.Text();
}

std::string Capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

// Choices or range of a parameter as text.
std::string LimitsText(const Parameter& parameter) {
  if (std::holds_alternative<Choice>(parameter.value())) return "one of: " + parameter.Expected();
  return parameter.range().Text();
}

void WriteComment(const std::string& text, const std::string& indent, std::string* out) {
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word;) {
    if (!line.empty() && indent.size() + 2 + line.size() + 1 + word.size() > kLineWidth) {
      *out += indent + "# " + line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  if (!line.empty()) *out += indent + "# " + line + "\n";
}

std::string CommentOf(const Parameter& value, const Parameter& by_default) {
  std::string comment = value.sentence();
  const std::string limits = Capital(LimitsText(value));
  const std::string default_text = DefaultText(by_default);
  const bool shows_default = !default_text.empty() && default_text != value.Text();
  if (value.required() && !value.sentence().empty()) comment += " Required.";
  if (!limits.empty()) comment += " " + limits + (shows_default ? ";" : ".");
  if (shows_default) comment += (limits.empty() ? " Default " : " default ") + default_text + ".";
  return comment;
}

void WriteParameters(const ParameterTable& values,
                     const ParameterTable& defaults,
                     Level level,
                     const std::string& indent,
                     std::string* out) {
  for (std::size_t i = 0; i < values.parameters().size(); ++i) {
    const Parameter& value = values.parameters()[i];
    if (value.level() != level) continue;
    WriteComment(CommentOf(value, defaults.parameters()[i]), indent, out);
    *out +=
        indent + (value.IsUnset() ? "# " + value.key() + ":" : value.key() + ": " + value.Text());
    *out += "\n";
  }
}

bool HasDataSheet(const ParameterTable& table) {
  return std::any_of(table.parameters().begin(),
                     table.parameters().end(),
                     [](const Parameter& p) { return p.level() == Level::kDataSheet; }) ||
         std::any_of(table.sections().begin(), table.sections().end(), HasDataSheet);
}

bool HasExpert(const ParameterTable& table) {
  return std::any_of(table.parameters().begin(), table.parameters().end(), [](const Parameter& p) {
    return p.level() == Level::kExpert;
  });
}

void WriteTable(const ParameterTable& values,
                const ParameterTable& defaults,
                const std::string& indent,
                std::string* out);

void WriteSections(const ParameterTable& values,
                   const ParameterTable& defaults,
                   bool with_data_sheet,
                   const std::string& indent,
                   std::string* out) {
  for (std::size_t i = 0; i < values.sections().size(); ++i) {
    const ParameterTable& section = values.sections()[i];
    if (HasDataSheet(section) != with_data_sheet) continue;
    *out += "\n";
    WriteComment(section.sentence(), indent, out);
    *out += indent + section.key() + ":\n";
    WriteTable(section, defaults.sections()[i], indent + "  ", out);
  }
}

void WriteList(const ParameterTable::List& list, const std::string& indent, std::string* out) {
  *out += "\n";
  WriteComment(list.sentence, indent, out);
  *out += indent + list.key + ":" + (list.size() == 0 ? " []\n" : "\n");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const ParameterTable element = list.Element(i);
    *out += indent + "  -\n";
    WriteTable(element, element, indent + "    ", out);
  }
}

void WriteTable(const ParameterTable& values,
                const ParameterTable& defaults,
                const std::string& indent,
                std::string* out) {
  const bool has_data_sheet = HasDataSheet(values);
  WriteParameters(values, defaults, Level::kDataSheet, indent, out);
  WriteSections(values, defaults, true, indent, out);
  if (has_data_sheet && HasExpert(values))
    *out += "\n" + indent + "# Expert: leave these unless you know why.\n";
  WriteParameters(values, defaults, Level::kExpert, indent, out);
  WriteSections(values, defaults, false, indent, out);
  for (const ParameterTable::List& list : values.lists()) WriteList(list, indent, out);
}

std::string Cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2)
    text.replace(at, 1, "\\|");
  return text;
}

void WriteRows(const ParameterTable& table, Level level, std::string* out) {
  for (const Parameter& p : table.parameters()) {
    if (p.level() != level) continue;
    const std::string text = p.required() ? "required" : DefaultText(p);
    *out += "| `" + p.path() + "` | " + SymbolOf(p.unit()) + " | " +
            (text.empty()   ? ""
             : p.required() ? text
                            : "`" + text + "`") +
            " | " + LimitsText(p) + " | " + Cell(p.sentence());
    for (const std::string& old_key : p.old_keys()) *out += " Was `" + old_key + "`.";
    *out += " |\n";
  }
  for (const ParameterTable& section : table.sections()) {
    std::string rows;
    WriteRows(section, level, &rows);
    if (rows.empty()) continue;
    const std::string name = section.path().substr(0, section.path().size() - 1);
    *out += "| **`" + name + "`** |  |  |  | " + Cell(section.sentence()) + " |\n" + rows;
  }
}

void WriteRows(const ParameterTable& table, Level level, const char* title, std::string* out) {
  std::string rows;
  WriteRows(table, level, &rows);
  if (rows.empty()) return;
  *out += std::string(title) +
          "\n\n| key | unit | default | range | meaning |\n|---|---|---|---|---|\n" + rows + "\n";
}

}  // namespace

std::string PrintParameters(const ParameterTable& values, const ParameterTable& defaults) {
  std::string text;
  WriteTable(values, defaults, "", &text);
  return text.empty() || text.front() != '\n' ? text : text.substr(1);
}

namespace {

void WriteLists(const ParameterTable& table, std::string* out) {
  for (const ParameterTable& section : table.sections()) WriteLists(section, out);
  for (const ParameterTable::List& list : table.lists())
    *out += "`" + table.path() + list.key + "`: " + list.sentence + "\n\n";
}

}  // namespace

std::string ReferenceOf(const ParameterTable& defaults) {
  std::string text;
  WriteRows(defaults, Level::kDataSheet, "From the data sheets:", &text);
  WriteRows(defaults, Level::kExpert, HasDataSheet(defaults) ? "Expert:" : "All:", &text);
  WriteLists(defaults, &text);
  return text;
}

}  // namespace seastitch
