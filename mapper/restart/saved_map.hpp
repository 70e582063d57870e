#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "common/core/archive.hpp"
#include "common/core/bytes.hpp"
#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"
#include "mapper/loops/graph_log.hpp"
#include "mapper/loops/loop_closer.hpp"

// State of a mapper for a restart in the same graph: a journal of single events (closed submaps,
// graph, sound speed), and a checkpoint of the state that changes with every sample.
namespace seastitch {

// Format version of journal entries and checkpoints; every change of the format changes it.
inline constexpr std::uint32_t kJournalFormat = 6;

// State of the mapper at one time; about 100 kB.
struct Checkpoint {
  std::int64_t number = 0;  // counts up, over restarts too
  Time time;                // of navigation
  std::int64_t graph_id = 0;
  std::int32_t next_submap = 0;
  std::vector<std::uint8_t> navigation;  // Navigation::Save()
  std::vector<std::uint8_t> frames;      // of SubmapFrames and SubmapBuilder
  std::vector<std::uint8_t> clocks;      // of SensorClocks
};

// A submap that closed. Its points are stored elsewhere: after reading it has none.
struct ClosedSubmap {
  std::shared_ptr<const Submap> submap;
  std::vector<GraphEdge> position_edges;
  bool skip_registration = false;
};

// Journal entry of the graph's new versions, by a registration job or at the end of a dive.
struct GraphGrowth {
  SubmapId closed;  // the submap that joined the graph; -1: none
  std::vector<LoopPair> pairs;
  std::vector<GraphEdge> registered;
  std::vector<std::vector<double>> statistics;  // ToNumbers(), of the accepted ones
  std::vector<GraphStep> steps;
};

using JournalEntry = std::variant<SoundVelocityProfile, ClosedSubmap, GraphGrowth>;

struct SavedMap {
  std::vector<JournalEntry> journal;
  Checkpoint checkpoint;  // the newest that does not know more submaps than the journal
  // Number of the next submap by the newest checkpoint: those before it are taken.
  std::int32_t next_submap = 0;
};

std::vector<std::uint8_t> Encode(const JournalEntry& entry);
std::vector<std::uint8_t> Encode(const Checkpoint& checkpoint);
// Nothing if the bytes are not a valid entry.
std::optional<JournalEntry> DecodeJournalEntry(Bytes bytes, std::uint32_t format = kJournalFormat);
std::optional<Checkpoint> DecodeCheckpoint(Bytes bytes);

}  // namespace seastitch
