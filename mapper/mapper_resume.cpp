#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapper/mapper.hpp"

// The mapper's checkpoints, and how it continues a graph after a restart.
namespace seastitch {

std::optional<Checkpoint> Mapper::MakeCheckpoint() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return std::nullopt;
  Checkpoint checkpoint;
  checkpoint.number = ++checkpoint_number_;
  checkpoint.time = *latest;
  checkpoint.graph_id = graph_.graph_id();
  checkpoint.next_submap = next_id_;
  if (auto saved = navigation_->Save(frames_.previous_time()))
    checkpoint.navigation = *std::move(saved);
  ArchiveWriter archive;
  archive(frames_, builder_);
  checkpoint.frames = archive.Release();
  ArchiveWriter clocks;
  clocks(clocks_);
  checkpoint.clocks = clocks.Release();
  return checkpoint;
}

SensorClocks Mapper::ClocksOf(const Checkpoint& checkpoint) const {
  SensorClocks clocks(params_.navigation.clock_jump_s);
  ArchiveReader archive(checkpoint.clocks);
  archive(clocks);
  return archive.IsDone() ? clocks : SensorClocks(params_.navigation.clock_jump_s);
}

bool Mapper::Resume(const SavedMap& saved,
                    const LoadSubmap& load,
                    const std::function<void()>& progress) {
  const Checkpoint& checkpoint = saved.checkpoint;
  if (next_id_ > 0 || !navigation_->Restore(checkpoint.navigation)) return false;
  ArchiveReader archive(checkpoint.frames);
  archive(frames_, builder_);
  constexpr auto kJudged = static_cast<std::int32_t>(SolutionJudge::kMaxSubmaps);
  const SubmapId first_judged{checkpoint.next_submap - kJudged};
  load_ = [&](SubmapId id) { return id < first_judged ? nullptr : load(id); };
  const auto restore = [this](const auto& entry) {
    try {
      return Restore(entry);
    } catch (const std::invalid_argument&) {  // unreadable statistics
      return false;
    }
  };
  std::size_t restored = 0;
  while (restored < saved.journal.size() && std::visit(restore, saved.journal[restored])) {
    ++restored;
    progress();
  }
  load_ = nullptr;
  entries_unusable_ = static_cast<std::int64_t>(saved.journal.size() - restored);
  Count("journal_entries_unusable", entries_unusable_);
  // The frame that navigation refers to is not that of the last submap here: part of the journal is
  // lost.
  if (!archive.IsDone() || next_id_ != checkpoint.next_submap) frames_.Forget();
  next_id_ = std::max({next_id_, checkpoint.next_submap, saved.next_submap});
  checkpoint_number_ = checkpoint.number;
  clocks_ = ClocksOf(checkpoint);
  clocks_.SetStage(Stage());
  resumed_ = Resumed{checkpoint.time, frames_.previous_time()};
  graph_.SetId(checkpoint.graph_id);
  graph_.Resume();
  graph_given_ = graph_.version();
  for (Waiting& waiting : submaps_)
    if (const auto submap = load(waiting.submap->id)) waiting.submap = submap;
  Count("submaps_resumed", static_cast<std::int64_t>(search_.size()));
  return true;
}

bool Mapper::Restore(const SoundVelocityProfile& profile) { return sound_speed_.Add(profile); }

bool Mapper::Restore(const ClosedSubmap& closed) {
  if (closed.submap->id.value < next_id_ || !IsUsable(*closed.submap)) return false;
  next_id_ = closed.submap->id.value + 1;
  search_.Add(*closed.submap, OwnChain());
  submaps_.push_back(
      {closed.submap, {OwnChain(), closed.position_edges}, closed.skip_registration});
  return true;
}

// All checks come before the first change.
bool Mapper::Restore(const GraphGrowth& growth) {
  std::vector<ClosureStatistics> statistics;
  for (const std::vector<double>& numbers : growth.statistics)
    statistics.push_back(ClosureStatisticsFromNumbers(numbers));
  for (const LoopPair& pair : growth.pairs)
    if (!search_.Has(pair.target) || !search_.Has(pair.source)) return false;
  std::int64_t version = graph_.version();
  for (const GraphStep& step : growth.steps)
    if (step.update.version != ++version) return false;
  RegistrationResultSet results;
  if (growth.closed.value >= 0) {
    if (submaps_.empty() || submaps_.front().submap->id != growth.closed) return false;
    submaps_.pop_front();
    const RegistrationJob closed{load_(growth.closed), {}};
    if (closed.closed) results = Run(closed, params_.loop_closer, load_, nullptr);
  }
  for (const GraphStep& step : growth.steps) {
    graph_.Restore(step);
    AddToCorrection(step.update);
  }
  results.job.pairs = growth.pairs;
  results.edges = growth.registered;
  results.statistics = std::move(statistics);
  search_.Restore(std::move(results));
  return true;
}

// The instant to use for t in navigation's covariances: one that navigation remembers, with as much
// drift since then as since t. At a restart navigation forgets all frames except the last.
Time Mapper::KnownAt(Time t) const {
  if (!resumed_ || t >= resumed_->at) return t;
  const Time since = resumed_->since.value_or(resumed_->at);
  const Time oldest = *navigation_->latest() - FromSeconds(params_.navigation.window_s);
  return since > oldest ? since : resumed_->at;
}

}  // namespace seastitch
