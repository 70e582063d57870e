#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

// Pages for people: numbers and text as HTML, tables, and a page template.
namespace seastitch {

// Escapes text for HTML. All text from outside the program has to pass it.
std::string Escaped(const std::string& text);

// JSON with each < escaped, so that it may stand in an element of an HTML page.
std::string WithoutMarkup(std::string json);

// A number with so many decimals; a dash for NaN.
std::string Fixed(double value, int digits);

// An integer in groups of three digits.
std::string Grouped(std::uint64_t value);

// A table with a line of headings. Cells are HTML.
class HtmlTable {
 public:
  explicit HtmlTable(const std::vector<std::string>& head);
  void Row(const std::vector<std::string>& cells);
  bool has_rows() const { return has_rows_; }
  std::string Finish() const { return html_ + "</table>\n"; }

 private:
  std::string html_;
  bool has_rows_ = false;
};

// Fills a page template. {{name}} is replaced by the value of that name. {{#name}}...{{/name}} is
// kept if the value is not empty, else removed. A name without a value is empty. Values are not
// expanded again. Throws std::logic_error where a name or a section does not end.
std::string FillTemplate(const std::string& page, const std::map<std::string, std::string>& values);

}  // namespace seastitch
