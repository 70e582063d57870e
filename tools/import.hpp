#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "products/warning.hpp"

namespace seastitch {

struct ImportOptions {
  // Survey files of any format (docs/survey-files.md), or candump logs with .kmall files without
  // navigation; distinguished by content.
  std::vector<std::filesystem::path> files;
  std::filesystem::path log;  // LCM log to write; must not exist
  // Driver configurations for a candump log. KMALL needs none.
  std::filesystem::path imu_config;
  std::filesystem::path dvl_config;
  // mapper.yaml to record in the log, so that a replay needs no other; empty: none. Survey files
  // with navigation need none.
  std::filesystem::path mapper_config;
  // Sound speed profile of survey files, in place of any other; empty: none is given.
  std::filesystem::path profile;
  // Profiles beside the survey files, perhaps in other folders (IsProfileFile).
  std::vector<std::filesystem::path> profiles;
  // No pause and no distance splits survey files into dives (GroupSurveyFiles).
  bool one_dive = false;
  bool quiet = false;
};

struct ImportResult {
  std::map<std::string, std::int64_t> channels;  // events on each
  std::map<std::string, std::int64_t> counters;  // of the decoders, those above 0
  // Of survey files with navigation: the sensors used and their mountings. Empty for other files.
  std::string installation;
  std::vector<MapWarning> warnings;  // SurveyPlan::warnings
};

// Imports files. Survey files become the messages that drivers would have published (INS, DEPTH,
// MBES_PING or MBES_SOUNDINGS, SVP), with the configuration for a replay as CONFIG. Beside the log,
// LOG.vehicle.yaml has the installation parameters, and LOG.mapper.yaml the configuration. Candump
// logs, and .kmall without navigation, go through the drivers, in the order of their stamps,
// including raw bytes. The same files give the same log. Throws std::runtime_error with the file's
// name; DataError if nothing in it can be georeferenced.
ImportResult Import(const ImportOptions& options);

// `seastitch import`: Import() of each dive of the files (GroupSurveyFiles), and a summary on
// stdout. The log of the second dive is LOG-2, and so on.
int RunImport(ImportOptions options);

}  // namespace seastitch
