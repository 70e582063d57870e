#pragma once

#include <filesystem>
#include <string_view>

namespace seastitch {

// Writes a temporary file beside `path` and renames it: a reader sees the old file or the whole new
// one. Not synced to the disk: products can be made again. Throws std::runtime_error "PATH: cannot
// be written: reason" (a full disk is one), leaving what was there.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace seastitch
