#pragma once

#include <filesystem>
#include <string_view>

namespace seastitch {

// Writes a temporary file beside `path`, to the disk, and renames it: after a power cut the old
// file or the whole new one is there. Throws std::runtime_error "PATH: cannot be written: reason",
// leaving what was there.
void WriteDurably(const std::filesystem::path& path, std::string_view bytes);

// Brings the names in a folder to the disk: without it a power cut may take a new file with it.
// Throws std::runtime_error "FOLDER: reason".
void SyncFolder(const std::filesystem::path& folder);

}  // namespace seastitch
