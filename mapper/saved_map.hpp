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
#include "mapper/graph_log.hpp"
#include "mapper/loop_closer.hpp"

// What a mapper needs to go on after a restart in the same graph: a journal of what is said once,
// and a checkpoint of what changes all the time.
namespace seastitch {

// Of the mapper at an instant; some 100 kB.
struct Checkpoint {
  std::int64_t number = 0;  // counts up, over restarts too
  Time time;                // of navigation
  std::int64_t graph_id = 0;
  std::int32_t next_submap = 0;
  std::vector<std::uint8_t> navigation;  // Navigation::Save()
  std::vector<std::uint8_t> frames;      // of SubmapFrames and SubmapBuilder
  std::vector<std::uint8_t> clocks;      // of SensorClocks
};

// A submap that closed. Its points are stored elsewhere: read back, it has none.
struct ClosedSubmap {
  std::shared_ptr<const Submap> submap;
  std::vector<GraphEdge> position_edges;
  bool skip_registration = false;
  Checkpoint checkpoint;  // right after it closed
};

// What the graph became by a job, or at the end of a dive.
struct GraphGrowth {
  SubmapId closed;  // joined the graph; -1: none
  std::vector<LoopPair> pairs;
  std::vector<GraphEdge> registered;
  std::vector<std::vector<double>> statistics;  // ToNumbers(), of those accepted
  std::vector<GraphStep> steps;
};

using JournalEntry = std::variant<SoundVelocityProfile, ClosedSubmap, GraphGrowth>;

struct SavedMap {
  std::vector<JournalEntry> journal;  // the checkpoints of its submaps may be left out
  Checkpoint checkpoint;              // the newest
};

std::vector<std::uint8_t> Encode(const JournalEntry& entry);
std::vector<std::uint8_t> Encode(const Checkpoint& checkpoint);
// Nothing where the bytes are none.
std::optional<JournalEntry> DecodeJournalEntry(Bytes bytes);
std::optional<Checkpoint> DecodeCheckpoint(Bytes bytes);

}  // namespace seastitch
