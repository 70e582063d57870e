#include "mapper/loops/loop_search.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {
namespace {

constexpr double kAskAgainAfterS = 30.0;
static_assert(LoopCloser::kMaxPairsAsked <= kMaxCovariancePairs);

}  // namespace

LoopSearch::LoopSearch(const LoopCloserParams& params)
    : pairs_per_submap_(params.overlap.max_pairs),
      estimates_noise_(params.estimate_noise),
      closer_(params),
      noise_(params.registration.noise) {}

void LoopSearch::Add(const Submap& submap, const Chain& chain) {
  closer_.Add(submap, chain);
  if (HasSoundings(submap.trigger)) registrations_left_ += pairs_per_submap_;
}

std::vector<LoopPair> LoopSearch::PairsFor(SubmapId id) {
  std::vector<LoopPair> pairs = closer_.PairsFor(id);
  registrations_left_ -= static_cast<std::int64_t>(pairs.size());
  return pairs;
}

std::optional<LoopSearch::Step> LoopSearch::LookAgain(std::optional<Time> now) {
  const std::int64_t most = std::min<std::int64_t>(registrations_left_, pairs_per_submap_);
  if (most < 1) return std::nullopt;
  if (auto request = Ask(now)) return Step{std::move(request), {}};
  Step step;
  const bool has_moved = closer_.HasMoved();
  step.pairs = has_moved ? closer_.PairsToRetry(static_cast<int>(most)) : OutdatedPairs(most);
  if (!has_moved && step.pairs.empty()) return std::nullopt;
  registrations_left_ -= static_cast<std::int64_t>(step.pairs.size());
  return step;
}

// Closures of one source that were registered with far too large a noise. Each is registered again
// once, and not before the retries of other pairs begin.
std::vector<LoopPair> LoopSearch::OutdatedPairs(std::int64_t most) {
  std::vector<LoopPair> pairs;
  if (closer_.newest_solved().value < 0 || none_outdated_in_ == noise_.revision()) return pairs;
  for (const NoiseEstimator::PairKey& key : noise_.outdated()) {
    if (static_cast<std::int64_t>(pairs.size()) == most) break;
    if (!pairs.empty() && pairs.front().source != key.second) continue;
    if (registered_again_.contains(key)) continue;
    registered_again_.insert(key);
    if (const auto pair = closer_.PairAgain(key.first, key.second)) pairs.push_back(*pair);
  }
  if (pairs.empty()) none_outdated_in_ = noise_.revision();
  return pairs;
}

// Requests covariances once per solution, and again if no answer comes: the request or the answer
// may be lost, or the optimizer busy. No request if the optimizer has a newer solution than the one
// used here.
std::optional<CovarianceRequest> LoopSearch::Ask(std::optional<Time> now) {
  CovarianceRequest request = closer_.request();
  if (request.pairs.empty() || request.graph_version != solution_version_) return std::nullopt;
  const bool due = now && asked_time_ && ToSeconds(*now - *asked_time_) > kAskAgainAfterS;
  if (asked_version_ == request.graph_version && !due) return std::nullopt;
  asked_version_ = request.graph_version;
  asked_time_ = now;
  request.seq = request_seq_++;
  return request;
}

std::vector<GraphEdge> LoopSearch::Record(RegistrationResultSet results) {
  if (results.job.closed && results.surface)
    judge_.AddSubmap(*results.job.closed, *std::move(results.surface));
  for (const LoopPair& pair : results.job.pairs) judge_.AddPair(pair.target, pair.source);
  MarkRepeatedClosures(&results);
  if (estimates_noise_) UpdateNoise(&results);
  std::vector<GraphEdge> changed = closer_.Record(results.job.pairs, results.edges);
  for (const ClosureStatistics* closure : noise_.TakeRestated()) {
    const Eigen::Matrix3d information = closure->InformationUnder(closure->stated_under);
    if (const auto edge = closer_.Restate(closure->target, closure->source, information))
      changed.push_back(*edge);
  }
  return changed;
}

// Marks repeated registrations of a closure as made, also over a restart. One that is refused
// leaves the closure and its larger covariance: it brings no new evidence, only a smaller expected
// noise.
void LoopSearch::MarkRepeatedClosures(RegistrationResultSet* results) {
  for (const LoopPair& pair : results->job.pairs) {
    if (!closer_.IsRepetition(pair)) continue;
    registered_again_.insert({pair.target, pair.source});
    std::erase_if(results->edges, [&](const GraphEdge& edge) {
      return edge.from == pair.target && edge.to == pair.source &&
             edge.verdict != LoopVerdict::kAccepted;
    });
  }
}

// Adds the job's closures to the noise estimate, then recomputes their covariances with it.
void LoopSearch::UpdateNoise(RegistrationResultSet* results) {
  for (const GraphEdge& edge : results->edges)
    if (edge.verdict != LoopVerdict::kAccepted) noise_.Remove(edge.from, edge.to);
  std::vector<NoiseEstimator::PairKey> added;
  for (ClosureStatistics& closure : results->statistics) {
    added.emplace_back(closure.target, closure.source);
    noise_.Add(std::move(closure));
  }
  for (const NoiseEstimator::PairKey& key : added) noise_.StateAnew(key);
  for (GraphEdge& edge : results->edges) {
    const ClosureStatistics* closure = noise_.Find(edge.from, edge.to);
    if (closure != nullptr && edge.verdict == LoopVerdict::kAccepted)
      edge.information = closure->InformationUnder(closure->stated_under);
  }
}

std::vector<GraphEdge> LoopSearch::Restore(RegistrationResultSet results) {
  registrations_left_ -= static_cast<std::int64_t>(results.job.pairs.size());
  return Record(std::move(results));
}

LoopSearch::Verdict LoopSearch::Take(const PoseGraph& solution, std::int64_t newest_version) {
  if (solution.graph_version > newest_version || !closer_.IsUsable(solution))
    return Verdict::kRefused;
  if (solution.graph_version < solution_version_) return Verdict::kOlder;
  solution_version_ = solution.graph_version;
  solved_ = solution.vertices.size();
  const Judgement judgement = judge_.Judge(solution);
  harm_.reset();
  if (judgement.harmful) {
    harm_ = judgement;
    return Verdict::kWithheld;
  }
  closer_.SetSolution(solution);
  asked_version_.reset();
  return Verdict::kUsed;
}

bool LoopSearch::Take(const PairCovariances& answer) {
  if (answer.request_seq + 1 != request_seq_) return false;
  closer_.SetCovariances(answer);
  return true;
}

}  // namespace seastitch
