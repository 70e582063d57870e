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
#include "common/parameters/parameters.hpp"
#include "mapper/registration/gicp.hpp"
#include "mapper/registration/registration.hpp"
#include "mapper/submaps/overlap.hpp"
#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {

enum class RegistrationMethod {
  kGrid,  // Align()
  kGicp,  // RegisterGicp(): method of the paper that docs/design.md names, as a baseline
};

struct LoopCloserParams {
  OverlapParams overlap;
  RegistrationMethod method = RegistrationMethod::kGrid;
  RegistrationParams registration;
  GicpParams gicp;
  // Fraction of a submap's area that Submap::predicted_information assumes to overlap. Must be
  // equal to SubmapParams::expected_overlap.
  double expected_overlap = 0.25;
  // Height offset between two passes over the same seabed, 1 sigma: tide, draft and sound speed,
  // which the depth sensor does not measure.
  double z_sigma_m = 0.3;
  // True: the survey's noise is estimated from its overlaps, with registration.noise as the prior.
  // False: it stays at registration.noise.
  bool estimate_noise = true;
};
// Declares the section `registration` of config/mapper.yaml.
void DeclareRegistration(LoopCloserParams* params, ParameterTable* table);

// Pair of submaps to be registered: the source (newer) on the target. Level frame: origin of the
// submap's frame, axes forward, right, down with roll and pitch taken out.
struct LoopPair {
  SubmapId target;
  SubmapId source;
  RelativePose prior;      // T_target_source of the level frames, with covariance
  double z_prior_m = 0.0;  // z of the source's frame minus that of the target's, positive down
  // By which the clouds are straightened: what navigation has learnt of the DVL's angle since they
  // were built.
  double target_yaw_rad = 0.0;
  double source_yaw_rad = 0.0;
  double dvl_yaw_rad = 0.0;  // GraphEdge::dvl_yaw_rad of the closure
};

// Chain of submaps: those of one dive, joined by dead reckoning. Submaps of two chains are joined
// by loop closures and position fixes only.
struct Chain {
  std::int32_t number = 0;
  // Covariance of x, y [m], yaw [rad] of the first submap's pose in the map. std::nullopt: its
  // place in the map is not known.
  std::optional<Eigen::Matrix3d> start_covariance{};
  // A priori sigmas of the mounting errors of its vehicle.
  MountingSigmas mounting{};
  // Of a dive in a finished map: the first submap of that map. The pairs among the map's submaps
  // were registered when it was made. -1: of no finished map.
  SubmapId map_begins_at{};
};

// Selector of loop-closure candidates: from the poses of all submaps and their covariances it
// chooses the pairs that are worth a registration or a retry (III-A-3 of the paper in
// docs/design.md). Holds outlines, never clouds. Pure.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopCloserParams& params) : params_(params) {}

  // Adds the next submap. Precondition, not checked: its id is larger than all before, and its
  // chain number is not smaller.
  void Add(const Submap& submap, const Chain& chain = {});
  // Whether a solution can be used at all: it names the submaps that are here, in their order, and
  // is finite.
  bool IsUsable(const PoseGraph& graph) const;
  // The optimizer's newest solution. False where it is not usable: nothing is taken.
  bool SetSolution(const PoseGraph& graph);

  // Pairs of a submap with earlier ones, highest predicted information gain first, with their
  // priors. Between solved submaps a prior is the relative pose in the solution. For newer submaps
  // it is composed of that of the newest solved submap and dead reckoning from there on. Of a
  // submap of a finished map: pairs with submaps from before that map only.
  std::vector<LoopPair> PairsFor(SubmapId source) const;

  // Records the results of registering these pairs. Returns the edges that are new to the graph,
  // with covariances inflated for submaps inside which the heading varies (Submap::heading_spread).
  // A pair without an edge could not be registered, because a cloud was missing or registration
  // threw an exception.
  std::vector<GraphEdge> Record(const std::vector<LoopPair>& pairs,
                                const std::vector<GraphEdge>& edges);

  // Request for the covariances of pairs that may overlap and whose submaps the last solution moved
  // or made more certain, at most kMaxPairsAsked. Its pairs are empty once it is answered.
  const CovarianceRequest& request() const { return request_; }
  // The answer to that request.
  void SetCovariances(const PairCovariances& answer);
  // Whether PairsToRetry() has submaps left, and the covariances that it needs have come.
  bool HasMoved() const { return !moved_.empty() && !covariances_.empty(); }
  // Takes the submap whose pose gained most information by the last solution off the list and
  // returns its pairs with older submaps that are due for a registration: never tried, or tried
  // under a prior that differs by kRetryNats, and rejected by registration or given weight 0 by the
  // optimizer. At most `most`, possibly none. A closure with weight is never retried, so that the
  // prior of a pair does not contain its own closure.
  std::vector<LoopPair> PairsToRetry(int most);

  // Replaces the information of an accepted closure, for another estimate of the noise, and returns
  // the edge for the graph. std::nullopt where the pair has no accepted closure.
  std::optional<GraphEdge> Restate(SubmapId target,
                                   SubmapId source,
                                   const Eigen::Matrix3d& information);
  // A pair for a repeated registration, with the prior of its last one. That prior was taken before
  // the pair's closure was in the graph, so that it does not contain it.
  std::optional<LoopPair> PairAgain(SubmapId target, SubmapId source) const;
  // True if the pair has an accepted closure, registered with this same prior.
  bool IsRepetition(const LoopPair& pair) const;

  // Dead-reckoning edge from the previous submap to this one; empty for the first of a chain.
  // Without a covariance_from_previous its sigma is 1 km and 180 degrees: nearly no information.
  std::vector<GraphEdge> DeadReckoningEdge(SubmapId to) const;

  // Number of pairs registered, by the last verdict of each; rejected() counts every verdict but
  // `accepted`.
  // Mounting errors of a dive in the last solution; zero before it has any.
  const MountingErrors& MountingOf(std::int32_t chain) const;
  std::int64_t accepted() const { return accepted_; }
  std::int64_t rejected() const { return static_cast<std::int64_t>(tried_.size()) - accepted_; }
  // Number of submaps with soundings.
  std::size_t size() const { return mapped_; }
  bool Has(SubmapId id) const;
  // Newest submap of the solution in use; -1 before the first.
  SubmapId newest_solved() const;

  // Smallest information gain of a prior for a retry: log(p_new(m) / p_old(m)) [nats], with p_new
  // and p_old the densities of the new and the old prior and m the mean of the new one. 0.5 is a
  // mean that moved by one sigma, or a sigma that shrank 1.6 times in one direction.
  static constexpr double kRetryNats = 0.5;
  // Maximum number of submaps whose pairs are retried after a solution.
  static constexpr std::size_t kMaxRetried = 16;
  // Maximum number of pairs of each, nearest first.
  static constexpr std::size_t kMaxPairsToRetry = 31;
  static constexpr std::size_t kMaxPairsAsked = kMaxRetried * kMaxPairsToRetry;

 private:
  struct Entry {
    SubmapOutline outline;
    Pose2 T_map_level;      // dead-reckoned
    double z_m;             // of its frame, positive down
    double heading_spread;  // Submap::heading_spread
    double drift_per_m;     // Submap::drift_per_m
    double dvl_yaw_rad;     // Submap::dvl_yaw_rad
    std::optional<Pose2> T_previous_level;
    std::optional<Eigen::Matrix3d> covariance_from_previous;
    Chain chain;
    // Its solved pose in the map when PairsToRetry() last took it.
    std::optional<RelativePose> looked_at;
  };
  struct Tried {
    RelativePose prior;
    std::optional<GraphEdge> edge;
    // Has weight in the graph: accepted by registration, and an inlier weight above 0 in the last
    // solution.
    bool pulls = false;
  };
  using PairKey = std::pair<SubmapId, SubmapId>;  // target, source

  std::size_t IndexOf(SubmapId id) const;
  LoopPair PairOf(SubmapId target, SubmapId source, const RelativePose& prior) const;
  // What navigation has learnt of the DVL's angle since submap i was built.
  double LearntYaw(std::size_t i) const;
  // The closure's information after its covariance is inflated by the distortion that an error of
  // the sonar's lever arm, as the last solution estimates it and its sigma, makes inside the two
  // submaps.
  Eigen::Matrix3d InformationDespiteBends(const GraphEdge& edge) const;
  // T_previous_i by dead reckoning, as navigation stated it.
  RelativePose StatedFromPrevious(std::size_t i) const;
  // The same, corrected by the mounting errors that the last solution estimated.
  RelativePose FromPrevious(std::size_t i) const;
  bool BeginsChain(std::size_t i) const;
  // T_i_n of a solved submap i and the first submap n of a chain, from their poses in the map, with
  // independent errors. The sonar's offset is among the errors of n.
  RelativePose BetweenChains(std::size_t i, std::size_t n) const;
  // T_i_n for every i < n.
  std::vector<RelativePose> Priors(std::size_t n) const;
  // T_map_i by the last solution.
  RelativePose AsSolved(std::size_t i) const;
  // Older submaps of the solution that may overlap n and have no closure with weight to it, nearest
  // first.
  std::vector<std::size_t> WithinReach(std::size_t n) const;
  std::vector<LoopPair> Choose(std::size_t n, std::vector<OverlapCandidate> candidates) const;
  // Whether the pair was never registered, or under a prior that differs by kRetryNats and without
  // a closure that has weight.
  bool IsUntriedUnder(const RelativePose& prior, SubmapId target, SubmapId source) const;
  void FindMoved();

  const LoopCloserParams params_;
  std::vector<Entry> entries_;                     // by increasing id
  std::size_t mapped_ = 0;                         // of entries_, with soundings
  std::map<std::int32_t, double> newest_yaw_rad_;  // Submap::dvl_yaw_rad, by dive
  std::int64_t solution_version_ = 0;
  std::vector<SolvedVertex> solved_;                 // of entries_[0 .. size)
  std::map<std::int32_t, MountingErrors> mounting_;  // in that solution, by chain
  std::map<PairKey, Tried> tried_;
  std::int64_t accepted_ = 0;       // of tried_
  std::vector<std::size_t> moved_;  // largest information gain last: taken from the back
  CovarianceRequest request_;
  std::vector<PairCovariance> covariances_;  // the answer to request_
};

}  // namespace seastitch
