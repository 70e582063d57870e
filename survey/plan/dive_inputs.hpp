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
  std::string note{};                        // its sonar, and why it is a dive of its own
  // Sound speed profiles that were named among the inputs; for every dive of survey files.
  std::vector<std::filesystem::path> profiles{};
};

// Splits the inputs of a replay into dives, in their order: each folder of a dive; each folder of
// logs; the survey files of each folder, and those that are named one by one, as they belong
// together (GroupSurveyFiles); all other logs. Navigation beside survey files
// (IsExternalNavigation) and sound speed profiles (IsProfileFile) belong to all dives of survey
// files. Empty files are named on stderr. raw: includes the logs of raw bytes. one_dive: no pause
// and no distance splits the files of a sonar. Throws UsageError or DataError with the name of what
// is given twice or cannot be used.
std::vector<DiveInput> DivesAmong(const std::vector<std::filesystem::path>& inputs,
                                  bool raw = false,
                                  bool one_dive = false);

}  // namespace seastitch
