#pragma once

#include <filesystem>
#include <string>

namespace seastitch {

// Folder of the running program, which contains the other programs, too.
std::filesystem::path BinDir();

// Folder of the shipped configuration: /etc/seastitch for an installed program, config/ of the
// source tree for one in build/bin. Throws std::runtime_error if there is neither.
std::filesystem::path ConfigDir();

}  // namespace seastitch
