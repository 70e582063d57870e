#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapper/mapper_config.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/replay/finished_map.hpp"
#include "survey/replay/replay.hpp"
#include "survey/replay/replay_config.hpp"
#include "survey/replay/submap_directory.hpp"

namespace seastitch {

// Exactly one of the first four is set.
struct Input {
  std::optional<RecordedLogs> logs;
  std::unique_ptr<SurveyFiles> survey_files;
  std::optional<SubmapDirectory> submaps;
  std::optional<FinishedMap> map;
  std::vector<std::string> names;  // names of the files
};

// An input and its configuration.
struct Dive {
  std::string name;
  Input input;
  ReplayConfig config;
  MapperConfig mapper;
  ConfigTexts configuration{};  // as the files and options state it, for a later replay
};

// CRC-32 of the texts of all dives' configuration, without dives_dir: where the dives lie changes
// no map.
std::uint32_t CrcOfConfiguration(const std::vector<Dive>& dives);

// Refuse impossible options, before and after the inputs are sorted into dives. Throw UsageError or
// std::runtime_error.
void ExpectInputs(const ReplayOptions& options);
void ExpectDives(const std::vector<DiveInput>& dives, const ReplayOptions& options);

// Opens the files of a dive. Throws std::runtime_error, UsageError or DataError.
Input Open(const DiveInput& dive, const ReplayOptions& options);
// Refuses survey files that lie farther apart than a map may reach. Throws DataError with a line
// for each survey: the command that maps it.
void ExpectOneSurvey(const std::vector<Dive>& dives);
// Refuses a map origin that is farther away from survey files than a map may reach. Throws
// UsageError.
void ExpectNear(const Datum& origin, const std::vector<Dive>& dives);
// Chooses and loads the configuration of a dive. out: folder for recorded configuration files.
void Prepare(const ReplayOptions& options, const std::filesystem::path& out, Dive* dive);
// Decoder of the raw bytes in a log, with --from-raw.
std::unique_ptr<RawReplay> OpenRaw(const ReplayOptions& options,
                                   const Input& input,
                                   const std::filesystem::path& out);

}  // namespace seastitch
