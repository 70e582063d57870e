#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/mounting.hpp"
#include "common/core/submap.hpp"
#include "mapper/registration/gicp.hpp"
#include "mapper/registration/registration.hpp"
#include "mapper/submaps/overlap.hpp"
#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {

enum class RegistrationMethod {
  kGrid,  // Align()
  kGicp,  // RegisterGicp(): the paper's, as a baseline
};

struct LoopCloserParams {
  OverlapParams overlap;
  RegistrationMethod method = RegistrationMethod::kGrid;
  RegistrationParams registration;
  GicpParams gicp;
  // The overlap that Submap::predicted_information counts with.
  double expected_overlap = 0.25;
  // Of the height between two submaps: tide, draft and sound speed between two passes, which the
  // depth sensor does not see.
  double z_sigma_m = 0.3;
  // True: registration.noise is the prior; the noise is then estimated from the overlaps.
  bool learn_noise = true;
};

// A registration to be made: the source (newer) submap on the target.
struct LoopPair {
  SubmapId target;
  SubmapId source;
  RelativePose prior;      // T_target_source, level frames
  double z_prior_m = 0.0;  // height of the source's frame less that of the target's
};

// The dive that a submap belongs to. Dead reckoning joins submaps of one chain only.
struct Chain {
  std::int32_t number = 0;
  // Covariance of x, y [m], yaw [rad] of its first submap in the map; nothing: its place is not
  // known.
  std::optional<Eigen::Matrix3d> start_covariance;
};

// Knows where all submaps lie and how well, and from that which pairs are worth a registration
// (III-A-3), once or again. Holds outlines, never clouds. Pure.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopCloserParams& params) : params_(params) {}

  // The next submap. Ids and chains must rise.
  void Add(const Submap& submap, const Chain& chain = {});
  // Whether a solution can be used at all: it names the submaps that are here, in their order, and
  // is finite.
  bool IsUsable(const PoseGraph& graph) const;
  // The optimizer's newest solution. False where it is not usable: nothing is taken.
  bool SetSolution(const PoseGraph& graph);

  // The pairs of a submap with those before it, most telling first, with their priors: from the
  // solution where it reaches, on by dead reckoning from its newest submap.
  std::vector<LoopPair> PairsFor(SubmapId source) const;

  // Records the results of registering these pairs. Returns the edges that are new to the graph,
  // with covariances inflated where submaps turn. A pair without an edge could not be registered.
  std::vector<GraphEdge> Record(const std::vector<LoopPair>& pairs,
                                const std::vector<GraphEdge>& edges);

  // Request for the covariances of pairs that may overlap and whose submaps the last solution moved
  // or made more certain, at most kMaxPairsAsked; without a pair once it is answered.
  const CovarianceRequest& request() const { return request_; }
  // The answer to that request.
  void SetCovariances(const PairCovariances& answer);
  // Whether submaps that moved are still to be looked at again, with the answer at hand.
  bool HasMoved() const { return !moved_.empty() && !covariances_.empty(); }
  // Takes the submap with the largest information gain by the solution and returns its pairs with
  // older submaps that are due for a registration: never tried, or tried without any weight in the
  // graph and under a prior that differs by kRetryNats. At most `most`, possibly none. The prior of
  // a pair never contains its own closure.
  std::vector<LoopPair> PairsToRetry(int most);

  // A closure that the graph has, with another information. Nothing where it is not accepted.
  std::optional<GraphEdge> Restate(SubmapId target,
                                   SubmapId source,
                                   const Eigen::Matrix3d& information);
  // A pair once more, under the prior it was tried with last, which does not hold its own pull.
  std::optional<LoopPair> PairAgain(SubmapId target, SubmapId source) const;

  // The dead-reckoning edge from the previous submap. Nothing for the first. Of a submap without
  // covariance_from_previous it is as good as no information.
  std::vector<GraphEdge> DeadReckoningEdge(SubmapId to) const;

  // Pairs registered, by the last verdict of each.
  std::int64_t accepted() const { return accepted_; }
  std::int64_t rejected() const { return static_cast<std::int64_t>(tried_.size()) - accepted_; }
  std::size_t size() const { return entries_.size(); }
  bool Has(SubmapId id) const;
  // Newest submap of the solution in use; -1 before the first.
  SubmapId newest_solved() const;

  // Least information gain of a prior for a retry: the logarithm of the ratio of the densities that
  // a new prior and the old one give to where the new one puts a submap. Half a nat is a sigma of
  // movement, or one direction known 1.6 times better.
  static constexpr double kRetryNats = 0.5;
  // Most submaps whose pairs are retried after a solution.
  static constexpr std::size_t kMaxRetried = 16;
  // And of each so many pairs, the nearest.
  static constexpr std::size_t kMaxPairsToRetry = 31;
  static constexpr std::size_t kMaxPairsAsked = kMaxRetried * kMaxPairsToRetry;

 private:
  struct Entry {
    SubmapOutline outline;
    Pose2 T_map_level;  // dead-reckoned
    double z_m;
    double heading_spread;
    std::optional<Eigen::Matrix3d> covariance_from_previous;
    Chain chain;
    // In the map, when its pairs were last looked at in the light of a solution.
    std::optional<RelativePose> looked_at;
  };
  struct Tried {
    RelativePose prior;
    std::optional<GraphEdge> edge;
    bool pulls = false;  // accepted by registration, and not refused by the last solution
  };
  using PairKey = std::pair<SubmapId, SubmapId>;  // target, source

  std::size_t IndexOf(SubmapId id) const;
  // Of a closure whose submaps an offset of the sonar bends, as large as the last solution holds it
  // possible.
  Eigen::Matrix3d InformationDespiteBends(const GraphEdge& edge) const;
  // By dead reckoning, with the errors of mounting of the last solution.
  RelativePose StatedFromPrevious(std::size_t i) const;
  RelativePose FromPrevious(std::size_t i) const;
  bool BeginsChain(std::size_t i) const;
  // T_i_n of the first of a chain and one that is solved, each by its own place in the map.
  RelativePose BetweenChains(std::size_t i, std::size_t n) const;
  // T_i_n for every i < n.
  std::vector<RelativePose> Priors(std::size_t n) const;
  // In the map, by the last solution.
  RelativePose AsSolved(std::size_t i) const;
  // Older submaps of the solution whose pair with n may meet and does not pull, nearest first.
  std::vector<std::size_t> WithinReach(std::size_t n) const;
  std::vector<LoopPair> Choose(std::size_t n, std::vector<OverlapCandidate> candidates) const;
  bool IsWorthAnother(const OverlapCandidate& candidate, SubmapId source) const;
  void FindMoved();

  const LoopCloserParams params_;
  std::vector<Entry> entries_;  // by rising id
  std::int64_t solution_version_ = 0;
  std::vector<SolvedVertex> solved_;  // of entries_[0 .. size)
  MountingErrors mounting_;           // in that solution
  std::map<PairKey, Tried> tried_;
  std::int64_t accepted_ = 0;       // of tried_
  std::vector<std::size_t> moved_;  // smallest information gain first
  CovarianceRequest request_;
  std::vector<PairCovariance> covariances_;  // of pairs of moved_
};

}  // namespace seastitch
