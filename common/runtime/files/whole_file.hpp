#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace seastitch {

// The bytes of a file. std::nullopt where it cannot be read: missing, a folder, without permission,
// on a bad sector.
std::optional<std::string> ReadWholeFile(const std::filesystem::path& path);

}  // namespace seastitch
