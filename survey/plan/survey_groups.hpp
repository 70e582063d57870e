#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/time.hpp"

// Which survey files belong together: those of one sonar, without a long pause, with the sonar and
// its sensors where they were.
namespace seastitch {

// What the head and the end of a survey file state.
struct FileHead {
  std::filesystem::path path;
  std::string format;                  // the same for files of one format
  std::optional<Time> begin{}, end{};  // pings and navigation
  std::optional<GeoPosition> place{};  // median of the first positions
  Time place_time{};
  std::optional<SonarInstallation> installation{};
  bool has_pings = false;
};

// "1 file", "3 files".
inline std::string NumberOfFiles(std::size_t files) {
  return std::to_string(files) + (files == 1 ? " file" : " files");
}

// Reads the head of a file up to the first ping, positions and installation, and its last records.
FileHead HeadOf(const std::filesystem::path& file);

// Files of one dive.
struct SurveyGroup {
  std::vector<std::filesystem::path> files;  // in the order in which they were given
  std::optional<Time> begin{};               // first ping or navigation record
  std::string sonar{};                       // its model; empty: not stated
  // Why it does not continue an earlier group of the sonar, for people; empty: there is none.
  std::string reason{};
  bool has_pings = false;
};

// Groups files by sonar (format, model and serial, where a serial that is not stated matches any),
// then where more than 12 h lie between two files, where the vehicle would have travelled faster
// than 20 m/s from one to the next, and where the sonar or a sensor was moved. Soundings by line
// join the group nearest in time. Files of navigation alone join every group. one_dive: groups by
// sonar alone.
std::vector<SurveyGroup> GroupSurveyFiles(const std::vector<std::filesystem::path>& files,
                                          bool one_dive);

}  // namespace seastitch
