#include "tools/vehicle/terminal_text.hpp"

#include <sstream>

#include "common/core/utf8.hpp"

namespace seastitch {

std::string Cut(const std::string& text, std::size_t columns) {
  if (text.size() <= columns) return text;
  constexpr char kDots[] = "...";
  if (columns < sizeof kDots) return text.substr(0, WholeCharacters(text, columns));
  return text.substr(0, WholeCharacters(text, columns + 1 - sizeof kDots)) + kDots;
}

std::vector<std::string> Wrap(const std::string& indent,
                              const std::string& text,
                              std::size_t columns) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  std::string line = indent;
  for (std::string word; words >> word;) {
    const bool first = line.size() == indent.size();
    if (!first && line.size() + 1 + word.size() > columns) {
      lines.push_back(Cut(line, columns));
      line = indent;
    }
    line += (line.size() == indent.size() ? "" : " ") + word;
  }
  lines.push_back(Cut(line, columns));
  return lines;
}

}  // namespace seastitch
