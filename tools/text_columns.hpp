#pragma once

#include <filesystem>
#include <optional>

#include "codecs/text_navigation.hpp"

namespace seastitch {

// The file that describes the columns of a text file: NAME.yaml beside NAME.
std::filesystem::path ColumnsFileOf(const std::filesystem::path& text);
// Reads it. Names of columns are looked up in the last header line of the text. Throws ConfigError.
TextNavigationFormat LoadTextColumns(const std::filesystem::path& text);

}  // namespace seastitch
