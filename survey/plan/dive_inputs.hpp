#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace seastitch {

// Input of one dive of a replay: a folder, or files.
struct DiveInput {
  std::string name;                          // for people; unique within a replay
  std::vector<std::filesystem::path> files;  // logs or survey files; none: a folder without
  std::filesystem::path folder{};            // of the dive; empty: of files named one by one
  std::string problem{};                     // why the folder's files are not known
};

// Splits the inputs of a replay into dives, in their order: each folder of a dive; each folder of
// logs or survey files; the survey files of one day (UTC, by their first ping or navigation
// record); all other logs. Navigation beside survey files (IsNavigationBeside) belongs to all dives
// of survey files. Empty files are named on stderr. raw: includes the logs of raw bytes.
// Throws UsageError or DataError with the name of what is given twice or cannot be used.
std::vector<DiveInput> DivesAmong(const std::vector<std::filesystem::path>& inputs,
                                  bool raw = false);

}  // namespace seastitch
