#include "viewer/html.hpp"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <stdexcept>

namespace seastitch {

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string WithoutMarkup(std::string json) {
  for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
    json.replace(at, 1, "\\u003c");
  return json;
}

std::string Fixed(double value, int digits) {
  if (!std::isfinite(value)) return "&ndash;";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string Grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > 3;) {
    at -= 3;
    text.insert(at, "&#8239;");
  }
  return text;
}

HtmlTable::HtmlTable(const std::vector<std::string>& head) : html_("<table>\n<tr>") {
  for (const std::string& h : head) html_ += "<th>" + h + "</th>";
  html_ += "</tr>\n";
}

void HtmlTable::Row(const std::vector<std::string>& cells) {
  has_rows_ = true;
  html_ += "<tr>";
  for (const std::string& c : cells) html_ += "<td>" + c + "</td>";
  html_ += "</tr>\n";
}

std::string FillTemplate(const std::string& page,
                         const std::map<std::string, std::string>& values) {
  const auto value_of = [&](const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? std::string() : found->second;
  };
  std::string out;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = page.find("{{", at);
    const std::size_t close = open == std::string::npos ? open : page.find("}}", open);
    out += page.substr(at, open - at);
    if (open == std::string::npos) return out;
    if (close == std::string::npos) throw std::logic_error("template: no }}");
    const std::string name = page.substr(open + 2, close - open - 2);
    at = close + 2;
    if (!name.starts_with('#')) {
      out += value_of(name);
      continue;
    }
    const std::string end = "{{/" + name.substr(1) + "}}";
    const std::size_t finish = page.find(end, at);
    if (finish == std::string::npos) throw std::logic_error("template: no " + end);
    if (!value_of(name.substr(1)).empty())
      out += FillTemplate(page.substr(at, finish - at), values);
    at = finish + end.size();
  }
}

}  // namespace seastitch
