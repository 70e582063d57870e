#pragma once

#include <filesystem>
#include <string>

#include "survey/read/raw_replay.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/replay/finished_map.hpp"

namespace seastitch {

// The configuration files of a replay.
struct ReplayConfig {
  std::filesystem::path mapper;
  std::filesystem::path optimizer;
  // For the report, in one line, such as "as recorded".
  std::string statement;
};

// Files given on the command line (empty: none), and the folder of the shipped files.
struct GivenConfig {
  std::filesystem::path mapper;
  std::filesystem::path optimizer;
  DriverFiles drivers;  // for raw bytes
  std::filesystem::path shipped_dir;
};

// Configuration for a replay of logs: the given files, else the recorded ones, which are written to
// OUT/config. Of a file that changed during the dive the newest version is used, assuming that the
// crew corrected it. Throws UsageError if there is neither, std::runtime_error if the files cannot
// be written.
ReplayConfig ChooseConfig(const GivenConfig& given,
                          const RecordedLogs& recorded,
                          const std::filesystem::path& out);

// Configuration for a finished map: the given files, else those that the map was made with, which
// are written to OUT/config.
ReplayConfig ChooseConfig(const GivenConfig& given,
                          const FinishedMap& map,
                          const std::filesystem::path& out);

// For a replay of logs: the same for the drivers that recorded raw bytes.
DriverFiles ChooseDriverFiles(const GivenConfig& given,
                              const RecordedLogs& recorded,
                              const RawSources& sources,
                              const std::filesystem::path& out);

// Configuration for submaps and survey files: the given files, else the shipped ones.
ReplayConfig ChooseConfig(const GivenConfig& given);

}  // namespace seastitch
