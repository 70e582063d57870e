#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"
#include "mapper/loops/loop_closer.hpp"
#include "mapper/loops/registration_job.hpp"
#include "mapper/loops/solution_judge.hpp"
#include "mapper/noise/noise_estimator.hpp"

namespace seastitch {

// Scheduler of registrations: first those of a new submap, then retries of pairs whose prior gained
// information by a solution. Before retries it requests their covariances from the optimizer. The
// number of registrations is at most max_pairs times the number of submaps. Harmful solutions are
// not used. Pure.
class LoopSearch {
 public:
  explicit LoopSearch(const LoopCloserParams& params);

  // Adds the next submap. Ids and chains must increase.
  void Add(const Submap& submap, const Chain& chain = {});
  // The submap's pairs; their number is subtracted from the budget.
  std::vector<LoopPair> PairsFor(SubmapId id);

  // A step of retries.
  struct Step {
    std::optional<CovarianceRequest> ask;  // request to the optimizer, without sender
    std::vector<LoopPair> pairs;           // to be registered now; may be empty
  };
  // The next retries after the last solution; nothing if there are none. now: navigation's time,
  // for repeating a request.
  std::optional<Step> LookAgain(std::optional<Time> now);

  // Records the results of a job and returns the edges for the graph. If they change the estimate
  // of the survey's noise, these include earlier closures with new information.
  std::vector<GraphEdge> Record(RegistrationResultSet results);
  // The same for a job from before a restart, or from when a finished map was made; its
  // registrations are subtracted from the budget.
  std::vector<GraphEdge> Restore(RegistrationResultSet results);
  std::vector<GraphEdge> DeadReckoningEdge(SubmapId to) const {
    return closer_.DeadReckoningEdge(to);
  }

  enum class Verdict : std::uint8_t {
    kUsed,
    kWithheld,  // overlapping submaps would fit worse: see harm()
    kRefused,   // of another graph, or not finite
    kOlder,     // older than the last one: a restarted optimizer solves the graph again
  };
  // newest_version: newest version of the graph; no solution can be newer.
  Verdict Take(const PoseGraph& solution, std::int64_t newest_version);
  // False if it does not answer the last request.
  bool Take(const PairCovariances& answer);

  // Noise of the survey estimated so far, which the next registration expects.
  const NoiseEstimator& noise() const { return noise_; }

  // Judgement of the last solution, if it was withheld.
  const std::optional<Judgement>& harm() const { return harm_; }
  std::int64_t solution_version() const { return solution_version_; }
  // Submaps that it has.
  std::size_t solved() const { return solved_; }
  const MountingErrors& MountingOf(std::int32_t chain) const { return closer_.MountingOf(chain); }
  std::int64_t accepted() const { return closer_.accepted(); }
  std::int64_t rejected() const { return closer_.rejected(); }
  std::size_t size() const { return closer_.size(); }
  bool Has(SubmapId id) const { return closer_.Has(id); }

 private:
  std::optional<CovarianceRequest> Ask(std::optional<Time> now);
  void MarkRepeatedClosures(RegistrationResultSet* results);
  void UpdateNoise(RegistrationResultSet* results);
  std::vector<LoopPair> OutdatedPairs(std::int64_t most);

  const int pairs_per_submap_;
  const bool estimates_noise_;
  LoopCloser closer_;
  NoiseEstimator noise_;
  std::set<NoiseEstimator::PairKey> registered_again_;  // or waiting for it
  std::optional<std::int64_t> none_outdated_in_;        // revision of the noise
  SolutionJudge judge_;
  std::optional<Judgement> harm_;
  std::int64_t solution_version_ = 0;
  std::size_t solved_ = 0;
  // Unused registration budget, spent on retries: pairs_per_submap_ for every submap, minus the
  // registrations made.
  std::int64_t registrations_left_ = 0;
  std::int64_t request_seq_ = 0;
  std::optional<std::int64_t> asked_version_;  // the solution that the last request was about
  std::optional<Time> asked_time_;
};

}  // namespace seastitch
