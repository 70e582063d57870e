#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace seastitch {

struct ImportOptions {
  // Survey files of any format (docs/survey-files.md), or candump logs with .kmall files without
  // navigation; distinguished by content.
  std::vector<std::filesystem::path> files;
  std::filesystem::path log;  // LCM log to write; must not exist
  // How the frames of a candump log are decoded. KMALL needs nothing.
  std::filesystem::path imu_config;
  std::filesystem::path dvl_config;
  // mapper.yaml to be recorded in the log, so that a replay needs no other; empty: none. Survey
  // files with navigation need none.
  std::filesystem::path mapper_config;
  bool quiet = false;
};

struct ImportResult {
  std::map<std::string, std::int64_t> channels;  // events on each
  std::map<std::string, std::int64_t> counters;  // of the decoders, those above 0
  // Of survey files with navigation: which sensors were used, and where they sit. Empty: of others.
  std::string installation;
};

// Survey files become what drivers would have published: INS, DEPTH, MBES_PING or MBES_SOUNDINGS,
// SVP, and CONFIG with what a replay needs; beside the log LOG.vehicle.yaml holds the installation
// parameters, and LOG.mapper.yaml what a replay needs. Candump logs, and .kmall without navigation,
// go through the drivers themselves, in the order of their stamps, raw bytes included. The same
// files give the same log. Throws std::runtime_error naming the file; DataError where nothing in it
// can be placed.
ImportResult Import(const ImportOptions& options);

// `seastitch import`: the same, and what it gave in some lines.
int RunImport(const ImportOptions& options);

}  // namespace seastitch
