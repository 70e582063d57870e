#include "common/runtime/files/whole_file.hpp"

#include <fstream>
#include <iterator>

namespace seastitch {

std::optional<std::string> ReadWholeFile(const std::filesystem::path& path) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::string bytes(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) return std::nullopt;
  return bytes;
}

}  // namespace seastitch
