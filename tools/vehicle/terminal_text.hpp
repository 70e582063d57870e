#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace seastitch {

// At most `columns` bytes; "..." at the end if the text is longer.
std::string Cut(const std::string& text, std::size_t columns);
// Breaks a text at spaces into lines of limited length, each with the indent.
std::vector<std::string> Wrap(const std::string& indent,
                              const std::string& text,
                              std::size_t columns);

}  // namespace seastitch
