#pragma once

#include <filesystem>

namespace seastitch {

// Counts this start in the file "starts" of systemd's runtime directory, which the service manager
// keeps over restarts and removes when the service stops (RuntimeDirectoryPreserve=restart).
// Returns the number of starts before this one; 0 where the directory cannot be used.
int CountRestart(const std::filesystem::path& runtime_directory);

}  // namespace seastitch
