#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"
#include "products/report/dive_report.hpp"
#include "products/survey.hpp"
#include "products/warning.hpp"
#include "survey/read/raw_replay.hpp"
#include "survey/replay/replay_input.hpp"
#include "survey/session/mapping_session.hpp"

namespace seastitch {

// Track of a navigation that the map does not use.
struct OtherTrack {
  std::int32_t chain;
  std::string source;
  std::vector<TrackState> states;
};

// Input of a replay, and counts of what is not used.
struct ReplayInput {
  bool quiet;
  std::function<bool()> stopped;                  // asked before every sample
  std::map<std::string, std::int64_t> refused{};  // by reason
  std::string partial{};                          // sentence about where it was stopped
  std::vector<OtherTrack> other_tracks{};         // one of each dive with a log
  std::vector<SurveyInput> spans{};               // the inputs, in order
  std::vector<MapWarning> warnings{};             // as they were printed
  std::set<std::string> said{};                   // warnings that are not printed again
};

// Notes that the replay was interrupted after this part of the input.
void NoteStop(int percent, ReplayInput* replay_input);

// What was wrong with a dive's input.
struct InputFaults {
  std::vector<Condition> conditions;  // faults of its messages at its end
  Counters messages;                  // lost or malformed
};
// Passes the samples of logs or survey files on: `take` gets each with the number of its input.
// raw: decodes recorded raw bytes; null: they are not decoded.
using TakeSample = std::function<void(const Received&, std::size_t input)>;
InputFaults Feed(Input* input,
                 std::unique_ptr<RawReplay> raw,
                 const TakeSample& take,
                 ReplayInput* replay_input);
// Passes the results on that are in logs.
void FeedResults(const RecordedLogs& recorded,
                 SurveyCollector* collector,
                 ReplayInput* replay_input);
// What a mapper of a dive found.
DiveReport ReportOf(const LocalMapper& mapper, const InputFaults& faults = {});
// Prints a warning, also of a quiet replay, and keeps it for the report. dive: its name among
// several; else empty.
void Warn(MapWarning warning, const std::string& dive, ReplayInput* replay_input);
// Prints how many pings of survey files are in the map, and the warnings of their plan.
void SayHowMapped(const Input& input,
                  const Mapper& mapper,
                  const std::string& dive,
                  ReplayInput* replay_input);
// Warns of what changed the depths of a map.
void WarnOfDepths(const Mapper& mapper, const std::string& dive, ReplayInput* replay_input);
// Adds submaps of files.
void FeedSubmaps(SubmapDirectory directory, MappingSession* session, ReplayInput* replay_input);

}  // namespace seastitch
