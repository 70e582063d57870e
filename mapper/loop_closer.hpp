#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "mapper/registration/registration.hpp"
#include "mapper/submaps/overlap.hpp"
#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {

struct LoopCloserParams {
  OverlapParams overlap;
  RegistrationParams registration;
  // The overlap that Submap::predicted_information counts with.
  double expected_overlap = 0.25;
  // Of the height between two submaps: tide, draft and sound speed between two passes, which the
  // depth sensor does not see.
  double z_sigma_m = 0.3;

  std::string Validate() const;  // empty if usable
};

// A registration to be made: the source (newer) submap on the target.
struct LoopPair {
  SubmapId target;
  SubmapId source;
  RelativePose prior;      // T_target_source, level frames
  double z_prior_m = 0.0;  // height of the source's frame less that of the target's
};

// Knows where all submaps lie and how well, and from that which pairs are worth a registration
// (III-A-3). Holds outlines, never clouds. Pure.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopCloserParams& params) : params_(params) {}

  // The next submap. Ids must rise.
  void Add(const Submap& submap);
  // The optimizer's newest solution. False where it names submaps that are not here, is not in
  // order or not finite: nothing is taken.
  bool SetSolution(const PoseGraph& graph);

  // The pairs of a submap with those before it, most telling first, with their priors: from the
  // solution where it reaches, on by dead reckoning from its newest submap.
  std::vector<LoopPair> PairsFor(SubmapId source) const;

  // The dead-reckoning edge from the previous submap. Nothing for the first.
  std::vector<GraphEdge> DeadReckoningEdge(SubmapId to) const;

  std::size_t size() const { return entries_.size(); }
  bool Has(SubmapId id) const;
  // Newest submap of the solution in use; -1 before the first.
  SubmapId newest_solved() const;

 private:
  struct Entry {
    SubmapOutline outline;
    Pose2 T_map_level;  // dead-reckoned
    double z_m;
    Eigen::Matrix3d covariance_from_previous;
  };

  std::size_t IndexOf(SubmapId id) const;
  RelativePose FromPrevious(std::size_t i) const;
  // T_i_n for every i < n.
  std::vector<RelativePose> Priors(std::size_t n) const;

  const LoopCloserParams params_;
  std::vector<Entry> entries_;        // by rising id
  std::vector<SolvedVertex> solved_;  // of entries_[0 .. size)
};

using LoadSubmap = std::function<std::shared_ptr<const Submap>(SubmapId)>;

// Registers the source on each of its targets; edges in the order of the pairs, each with its
// verdict. A target that cannot be loaded gives no edge.
std::vector<GraphEdge> RegisterPairs(const Submap& source,
                                     const std::vector<LoopPair>& pairs,
                                     const LoadSubmap& load,
                                     const LoopCloserParams& params);

// What a registration says to the graph.
GraphEdge ToEdge(const LoopPair& pair, const RegistrationResult& result);

}  // namespace seastitch
