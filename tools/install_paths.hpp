#pragma once

#include <filesystem>
#include <string>

namespace seastitch {

// Folder of the running program: where the other programs are.
std::filesystem::path BinDir();

// Where the shipped configuration lies: /etc/seastitch for an installed program, config/ of the
// source tree for one in build/bin. Throws std::runtime_error where there is neither.
std::filesystem::path ConfigDir();

}  // namespace seastitch
