#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace seastitch {

// What is replayed as one dive: a folder, or files.
struct DiveInput {
  std::string name;                          // for people; no two of a replay have the same
  std::vector<std::filesystem::path> files;  // logs or survey files; none: a folder of submaps
};

// The dives among the inputs of a replay, in their order (raw: the logs of raw bytes, too): a
// dive's folder, a folder of logs or survey files, the survey files of one day (UTC, by their first
// record; an SBET, which has none, goes with each), all other logs. Throws std::runtime_error
// naming what cannot be read.
std::vector<DiveInput> DivesAmong(const std::vector<std::filesystem::path>& inputs,
                                  bool raw = false);

}  // namespace seastitch
