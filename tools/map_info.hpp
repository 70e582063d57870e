#pragma once

#include <filesystem>

namespace seastitch {

// Prints what a finished map holds, and whether another replay can use it. Throws DataError if it
// cannot: see ReadFinishedMap().
void PrintMap(const std::filesystem::path& folder, bool json);

}  // namespace seastitch
