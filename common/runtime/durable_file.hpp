#pragma once

#include <filesystem>
#include <string_view>

namespace seastitch {

// Both write a temporary file beside `path` and rename it: a reader sees the old file or the whole
// new one. They throw std::runtime_error "PATH: cannot be written: reason" (a full disk is one) and
// leave what was there.
void WriteAtomically(const std::filesystem::path& path, std::string_view bytes);
// To the disk: after a power cut, too, the old file or the whole new one is there.
void WriteDurably(const std::filesystem::path& path, std::string_view bytes);

// Brings the names in a folder to the disk: without it a power cut may take a new file with it.
// Throws std::runtime_error "FOLDER: reason".
void SyncFolder(const std::filesystem::path& folder);

}  // namespace seastitch
