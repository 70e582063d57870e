#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace seastitch {

struct ImportOptions {
  std::vector<std::filesystem::path> files;  // .kmall files and candump logs, told apart by content
  std::filesystem::path log;                 // LCM log to write; must not exist
  // How the frames of a candump log are decoded. KMALL needs nothing.
  std::filesystem::path imu_config;
  std::filesystem::path dvl_config;
  bool quiet = false;
};

struct ImportResult {
  std::map<std::string, std::int64_t> channels;  // events on each
  std::map<std::string, std::int64_t> counters;  // of the decoders, those above 0
};

// Sends the files' bytes through the drivers themselves, in the order of their stamps, and writes
// what they publish, raw bytes included. The same files give the same log. Throws
// std::runtime_error naming the file.
ImportResult Import(const ImportOptions& options);

// `seastitch import`: the same, and what it gave in some lines.
int RunImport(const ImportOptions& options);

}  // namespace seastitch
