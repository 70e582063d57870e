#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/restart/map_store.hpp"
#include "mapper/submaps/survey_store.hpp"

namespace seastitch {

struct MapWriterParams {
  std::int64_t max_cached_mb = 0;   // of points in memory
  std::int64_t max_unsaved_mb = 0;  // of points, and of journal entries, that wait for the disk
  std::string configuration;        // as for MapJournal
};

// Writes a map to the disk by jobs of a worker, one entry at a time and in order: the points of a
// submap that closed, its checkpoint, its entry in the journal. What waits is bounded: beyond that
// a submap loses its points and the journal ends. A checkpoint of its own is written every 5 s of
// navigation, after all entries before it.
class MapWriter {
 public:
  // What an entry had that is on the disk now, or was given up: it may be sent.
  struct Written {
    std::shared_ptr<const Submap> submap;  // the one that closed
    std::optional<std::int64_t> version;   // of the graph
  };

  // make_checkpoint: nothing while there is none to make, or not at this moment. on_written: called
  // where the worker calls back.
  MapWriter(MapWriterParams params,
            Worker* worker,
            std::function<std::optional<Checkpoint>()> make_checkpoint,
            std::function<void(const Written&)> on_written);

  // Where points are written. Until then entries wait, the last one alone.
  void OpenStore(const std::filesystem::path& folder);
  // Begins the journal.
  void OpenJournal(const FoundMap& map);
  // A journal will be opened: entries that come before it are for it.
  void ExpectJournal() { keeps_entries_ = true; }
  bool has_journal() const { return journal_ != nullptr; }
  // Null before OpenStore(). A job may use it.
  const std::shared_ptr<SurveyStore>& store() const { return store_; }
  // The submaps of the store were restored, up to this one.
  void OnRestored(SubmapId last);

  // version: of the graph after this entry. checkpoint: before it.
  void Add(const JournalEntry& entry,
           Time time,
           std::int64_t version,
           const std::optional<Checkpoint>& checkpoint);
  // Makes a checkpoint due.
  void OnNavigation(Time time);
  void CheckpointIsDue() { checkpoint_is_due_ = journal_ != nullptr; }
  // Posts the next write unless one is running. A job that the worker refuses is tried again with
  // the next call.
  void Post();

  bool IsBusy() const { return is_writing_ || !waiting_.empty(); }
  // The last submap that was stored.
  SubmapId stored() const { return stored_; }
  // store_saved, ...; submaps_not_stored and journal_entries_dropped where they are not zero.
  Counters counters() const;
  // Faults of the disk, and of what it lost.
  void AddFaults(std::vector<Condition>* faults) const;

 private:
  struct Write {
    Time time;
    std::optional<std::vector<std::uint8_t>> entry;  // absent: dropped, so that the journal ends
    std::vector<std::uint8_t> checkpoint;            // to be written before the entry
    Written written;
    std::size_t bytes() const { return (entry ? entry->size() : 0) + checkpoint.size(); }
  };
  struct Outcome {
    bool in_journal = true;
    bool journal_is_gone = false;
    SurveyStoreCounters store;
  };

  // On the worker's thread.
  static Outcome Perform(const Write& write, SurveyStore* store, MapJournal* journal);
  void PostCheckpoint();
  void OnDone(const Write& write, const Outcome& outcome);

  const MapWriterParams params_;
  Worker* const worker_;
  const std::function<std::optional<Checkpoint>()> make_checkpoint_;
  const std::function<void(const Written&)> on_written_;
  std::shared_ptr<SurveyStore> store_;   // written by the worker's jobs
  std::shared_ptr<MapJournal> journal_;  // null: without a journal
  bool keeps_entries_ = false;
  std::deque<Write> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool is_writing_ = false;
  std::optional<Time> checkpoint_time_;
  bool checkpoint_is_due_ = false;
  SubmapId stored_;
  SurveyStoreCounters store_counters_;  // as of the last write
  std::int64_t not_stored_ = 0;         // submaps whose points were given up while they waited
  std::int64_t entries_dropped_ = 0;    // beyond max_unsaved_mb: the journal has ended
  bool store_fails_ = false;            // the last closed submap could not be stored
  bool journal_fails_ = false;          // the last entry could not be written
  bool journal_is_gone_ = false;        // MapJournal::is_gone()
};

}  // namespace seastitch
