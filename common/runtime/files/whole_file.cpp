#include "common/runtime/files/whole_file.hpp"

#include <fstream>
#include <sstream>
#include <utility>

namespace seastitch {

std::optional<std::string> ReadWholeFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  if (in.peek() != std::ifstream::traits_type::eof()) bytes << in.rdbuf();
  // A sector that cannot be read, too, ends here.
  if (!in || !bytes) return std::nullopt;
  return std::move(bytes).str();
}

}  // namespace seastitch
