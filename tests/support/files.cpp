#include "tests/support/files.hpp"

#include <fstream>
#include <sstream>

namespace seastitch {

std::string TextOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  // A file of a process that has just ended can be opened, and not be read.
  if (in.peek() != std::ifstream::traits_type::eof()) text << in.rdbuf();
  return in && text ? text.str() : std::string();
}

std::vector<std::uint8_t> BytesOf(const std::filesystem::path& file) {
  const std::string text = TextOf(file);
  return {text.begin(), text.end()};
}

}  // namespace seastitch
