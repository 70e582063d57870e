#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/core/counters.hpp"
#include "common/runtime/bus.hpp"
#include "products/survey.hpp"
#include "tools/ping_inputs.hpp"
#include "tools/raw_replay.hpp"
#include "tools/replay_input.hpp"
#include "tools/replay_pipeline.hpp"

namespace seastitch {

// Track of a navigation that the map does not use.
struct OtherTrack {
  std::int32_t chain;
  std::string source;
  std::vector<TrackState> states;
};

// Input of a replay, and counts of what is not used.
struct Feeding {
  Bus* bus;
  PingInputs* inputs;
  bool quiet;
  std::function<bool()> stopped;                  // asked before every event or record
  std::map<std::string, std::int64_t> refused{};  // by reason
  std::string partial{};                          // sentence about where it was stopped
  std::vector<OtherTrack> other_tracks{};         // one of each dive with a log
};

// Notes that the replay was interrupted after this part of the input.
void NoteStop(int percent, Feeding* feeding);

// Publishes the logs' events of one role. Events of another type than that of their channel are
// skipped and counted by reason.
void FeedLogs(const RecordedLogs& recorded,
              ChannelRole role,
              RawReplay* raw,  // null: raw bytes are not decoded
              Feeding* feeding);
// Publishes the messages of logs or survey files. raw: decodes recorded raw bytes, if these are
// replayed.
void Feed(Input* input, RawReplay* raw, Feeding* feeding);
// Prints how many pings of survey files are in the map, by the mapper's counters. quiet: only a
// warning.
void PrintPingLosses(const Input& input, const Counters& mapper, bool quiet);
// Adds submaps of files.
void FeedSubmaps(SubmapDirectory directory, Pipeline* pipeline, Feeding* feeding);

}  // namespace seastitch
