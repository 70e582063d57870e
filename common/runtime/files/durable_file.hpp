#pragma once

#include <filesystem>
#include <string_view>

namespace seastitch {

// Both write a temporary file beside `path` and rename it: a reader sees the old file or the whole
// new one. They throw std::runtime_error "PATH: cannot be written: reason" (a full disk is one) and
// leave what was there.
void WriteAtomically(const std::filesystem::path& path, std::string_view bytes);
// With fsync: also after a power cut the old or the whole new file is there.
void WriteDurably(const std::filesystem::path& path, std::string_view bytes);

// fsync of a folder: without it a new file may be lost in a power cut.
// Throws std::runtime_error "FOLDER: reason".
void SyncFolder(const std::filesystem::path& folder);

}  // namespace seastitch
