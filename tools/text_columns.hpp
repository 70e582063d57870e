#pragma once

#include <filesystem>
#include <optional>

#include "codecs/text_navigation.hpp"

namespace seastitch {

// What the columns of a text file are: the file NAME.yaml beside NAME, where there is one.
std::filesystem::path ColumnsFileOf(const std::filesystem::path& text);
// Throws ConfigError.
TextNavigationFormat LoadTextColumns(const std::filesystem::path& file);

}  // namespace seastitch
