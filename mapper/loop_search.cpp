#include "mapper/loop_search.hpp"

#include <algorithm>

namespace seastitch {
namespace {

constexpr double kAskAgainAfterS = 30.0;
static_assert(LoopCloser::kMaxPairsAsked <= kMaxCovariancePairs);

}  // namespace

LoopSearch::LoopSearch(const LoopCloserParams& params)
    : pairs_per_submap_(params.overlap.max_pairs), closer_(params) {}

void LoopSearch::Add(const Submap& submap) {
  closer_.Add(submap);
  registrations_left_ += pairs_per_submap_;
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
  if (!closer_.HasMoved()) return std::nullopt;
  Step step{std::nullopt, closer_.PairsOfMoved(static_cast<int>(most))};
  registrations_left_ -= static_cast<std::int64_t>(step.pairs.size());
  return step;
}

// Once a solution, and again where no answer came: request or answer may be lost, or the optimizer
// busy. Not where it has gone on to a solution that is not used here.
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
  return closer_.Record(results.job.pairs, results.edges);
}

LoopSearch::Verdict LoopSearch::Take(const PoseGraph& solution, std::int64_t newest_version) {
  if (solution.graph_version > newest_version || !closer_.IsUsable(solution))
    return Verdict::kRefused;
  if (solution.graph_version < solution_version_) return Verdict::kOlder;
  solution_version_ = solution.graph_version;
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
