#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace seastitch {

// The bytes of a file; empty where it cannot be read.
std::string TextOf(const std::filesystem::path& file);
std::vector<std::uint8_t> BytesOf(const std::filesystem::path& file);

}  // namespace seastitch
