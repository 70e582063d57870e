#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace seastitch {

// What others sent, for a terminal: without control characters.
std::string Printable(std::string text);
// At most so many bytes, "..." at the end where some are left out.
std::string Cut(const std::string& text, std::size_t columns);
// Breaks at spaces; each line begins with the indent and has at most so many bytes.
std::vector<std::string> Wrap(const std::string& indent,
                              const std::string& text,
                              std::size_t columns);

}  // namespace seastitch
