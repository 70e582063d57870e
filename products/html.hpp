#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

// Pages for people: numbers and text as HTML, tables, and a page template.
namespace seastitch {

// Text for HTML. Everything that comes from outside passes here.
std::string Escaped(const std::string& text);

// With so many digits after the point; a dash where it is no number.
std::string Fixed(double value, int digits);

// In groups of three digits.
std::string Grouped(std::uint64_t value);

// A table with a line of headings. Cells are HTML.
class HtmlTable {
 public:
  explicit HtmlTable(const std::vector<std::string>& head);
  void Row(const std::vector<std::string>& cells);
  std::string Finish() const { return html_ + "</table>\n"; }

 private:
  std::string html_;
};

// Fills a page template. {{name}} becomes the value of that name. {{#name}}...{{/name}} stays where
// the value is not empty and vanishes where it is. A name without a value counts as empty; values
// are not looked into. Throws std::logic_error where a name or a section does not end.
std::string FillTemplate(const std::string& page, const std::map<std::string, std::string>& values);

}  // namespace seastitch
