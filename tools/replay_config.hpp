#pragma once

#include <filesystem>
#include <string>

#include "tools/raw_replay.hpp"
#include "tools/recorded_dive.hpp"

namespace seastitch {

// The files that a replay is done with.
struct ReplayConfig {
  std::filesystem::path mapper;
  std::filesystem::path optimizer;
  // For the report, in one line, such as "as recorded".
  std::string statement;
};

// What was given on the command line (empty: nothing), and the shipped files beside it.
struct GivenConfig {
  std::filesystem::path mapper;
  std::filesystem::path optimizer;
  DriverFiles drivers;  // for raw bytes
  std::filesystem::path shipped_dir;
};

// Configuration for a replay of logs: the given one, else the recorded one, which is written to
// OUT/config. Of a file that changed during the dive the newest version counts, since the crew
// corrected it. Throws UsageError where there is neither, std::runtime_error where the files cannot
// be written.
ReplayConfig ChooseConfig(const GivenConfig& given,
                          const RecordedLogs& recorded,
                          const std::filesystem::path& out);

// Of raw bytes, the same for the drivers that recorded some.
DriverFiles ChooseDriverFiles(const GivenConfig& given,
                              const RecordedLogs& recorded,
                              const RawSources& sources,
                              const std::filesystem::path& out);

// Of submaps and survey files: what was given, else the shipped ones.
ReplayConfig ChooseConfig(const GivenConfig& given);

}  // namespace seastitch
