#pragma once

#include <filesystem>

namespace seastitch {

// The name of a folder's next log, 000.lcmlog, 001.lcmlog, ...: after every one that is there, so
// that names sort and a log that is there is never touched again. Throws std::runtime_error
// "FOLDER: reason".
std::filesystem::path NextLogFile(const std::filesystem::path& folder);

}  // namespace seastitch
