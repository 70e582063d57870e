#include "mapper/restart/map_writer.hpp"

#include <string>
#include <utility>
#include <variant>

#include "common/core/health/conditions.hpp"

namespace seastitch {
namespace {

constexpr double kCheckpointEveryS = 5.0;
// Entries that may wait for the disk before a closed submap waits without its points.
constexpr std::size_t kMostWaiting = 32;
constexpr std::size_t kMegabyte = 1'000'000;

}  // namespace

MapWriter::MapWriter(MapWriterParams params,
                     Worker* worker,
                     std::function<std::optional<Checkpoint>()> make_checkpoint,
                     std::function<void(const Written&)> on_written)
    : params_(std::move(params)),
      worker_(worker),
      make_checkpoint_(std::move(make_checkpoint)),
      on_written_(std::move(on_written)) {}

void MapWriter::OpenStore(const std::filesystem::path& folder) {
  store_ = std::make_shared<SurveyStore>(
      SurveyStoreParams{folder, params_.max_cached_mb, params_.max_unsaved_mb});
}

void MapWriter::OpenJournal(const FoundMap& map) {
  journal_ = std::make_shared<MapJournal>(map, params_.configuration, params_.max_unsaved_mb);
}

void MapWriter::OnRestored(SubmapId last) {
  stored_ = last;
  store_counters_ = store_->counters();
}

void MapWriter::Add(const JournalEntry& entry,
                    Time time,
                    std::int64_t version,
                    const std::optional<Checkpoint>& checkpoint) {
  Write write;
  write.time = time;
  if (keeps_entries_) write.entry = Encode(entry);
  if (checkpoint) write.checkpoint = Encode(*checkpoint);
  if (!store_) {  // profiles before the first sample of navigation: the last is enough
    waiting_.clear();
    waiting_bytes_ = 0;
  }
  if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) {
    write.written.submap = closed->submap;
    if (waiting_.size() >= kMostWaiting) {
      // The number stays in the journal and in order; the points would grow without bound.
      Submap without_points = *closed->submap;
      without_points.cloud = {};
      write.written.submap = std::make_shared<const Submap>(std::move(without_points));
      ++not_stored_;
    }
  }
  if (std::holds_alternative<GraphGrowth>(entry)) write.written.version = version;
  const auto most_bytes = static_cast<std::size_t>(params_.max_unsaved_mb) * kMegabyte;
  if (write.entry && (entries_dropped_ > 0 || waiting_bytes_ + write.bytes() > most_bytes)) {
    write.entry.reset();
    write.checkpoint.clear();
    ++entries_dropped_;
  }
  waiting_bytes_ += write.bytes();
  waiting_.push_back(std::move(write));
  Post();
}

void MapWriter::OnNavigation(Time time) {
  if (!journal_) return;
  if (checkpoint_time_ && ToSeconds(time - *checkpoint_time_) < kCheckpointEveryS) return;
  checkpoint_time_ = time;
  checkpoint_is_due_ = true;
}

void MapWriter::Post() {
  if (is_writing_ || !store_) return;
  if (waiting_.empty()) return PostCheckpoint();
  is_writing_ = true;
  const auto write = std::make_shared<const Write>(std::move(waiting_.front()));
  waiting_.pop_front();
  waiting_bytes_ -= write->bytes();
  const bool posted = worker_->Post([this, store = store_, journal = journal_, write] {
    const Outcome outcome = Perform(*write, store.get(), journal.get());
    return [this, write, outcome] { OnDone(*write, outcome); };
  });
  if (posted) return;
  is_writing_ = false;
  waiting_bytes_ += write->bytes();
  waiting_.push_front(*write);
}

MapWriter::Outcome MapWriter::Perform(const Write& write, SurveyStore* store, MapJournal* journal) {
  Outcome outcome;
  const std::shared_ptr<const Submap>& submap = write.written.submap;
  if (submap && !submap->cloud.empty()) store->Put(submap);
  if (journal != nullptr) {
    if (!write.checkpoint.empty()) journal->WriteCheckpoint(write.time, write.checkpoint);
    outcome.in_journal = write.entry && journal->Append(write.time, *write.entry);
    if (!write.entry) journal->End();
    outcome.journal_is_gone = journal->is_gone();
  }
  outcome.store = store->counters();
  return outcome;
}

void MapWriter::PostCheckpoint() {
  if (!checkpoint_is_due_) return;
  const std::optional<Checkpoint> checkpoint = make_checkpoint_();
  if (!checkpoint) return;
  checkpoint_is_due_ = false;
  is_writing_ = true;
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(Encode(*checkpoint));
  const bool posted = worker_->Post([this, journal = journal_, time = checkpoint->time, bytes] {
    const bool written = journal->WriteCheckpoint(time, *bytes);
    return [this, written, is_gone = journal->is_gone()] {
      is_writing_ = false;
      journal_fails_ = !written;
      journal_is_gone_ = is_gone;
      Post();
    };
  });
  if (!posted) is_writing_ = false;
}

void MapWriter::OnDone(const Write& write, const Outcome& outcome) {
  is_writing_ = false;
  journal_fails_ = !outcome.in_journal;
  journal_is_gone_ = outcome.journal_is_gone;
  if (write.written.submap) {
    stored_ = write.written.submap->id;
    store_fails_ = outcome.store.write_errors > store_counters_.write_errors;
  }
  store_counters_ = outcome.store;
  on_written_(write.written);
}

Counters MapWriter::counters() const {
  Counters counters = store_ ? store_counters_.ByName() : Counters{};
  if (not_stored_ > 0) counters["submaps_not_stored"] = not_stored_;
  if (entries_dropped_ > 0) counters["journal_entries_dropped"] = entries_dropped_;
  return counters;
}

void MapWriter::AddFaults(std::vector<Condition>* faults) const {
  if (store_fails_ || journal_fails_ || entries_dropped_ > 0)
    faults->push_back(
        {&conditions::kStoreNotWriting,
         journal_is_gone_ ? "the map's folder was deleted, or another disk hides it: unless it "
                            "comes back, a restart begins a new map"
         : entries_dropped_ == 0 ? ""
                                 : "the journal has ended, and a restart loses what came since"});
  const std::string lost = store_counters_.PointsLost(not_stored_);
  if (!lost.empty()) faults->push_back({&conditions::kPointsLost, lost});
}

}  // namespace seastitch
