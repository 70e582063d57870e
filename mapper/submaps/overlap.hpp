#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/submap.hpp"
#include "common/parameters/parameters.hpp"
#include "mapper/submaps/relative_pose.hpp"

// Search for pairs of submaps that may show the same seabed: by their footprints, under the
// uncertainty of each pair's relative pose (future work in section V of the paper in
// docs/design.md).
namespace seastitch {

struct OverlapParams {
  // Smallest expected overlap of a pair: with less, registration has too few cells.
  double min_overlap_m2 = 10.0;
  // The same as a fraction of the smaller footprint. Outlines reach one cell beyond their points,
  // so that successive submaps of a line overlap along an edge without a common sounding.
  double min_overlap_fraction = 0.05;
  // Maximum number of registrations per submap, highest information gain first: bounds the work.
  int max_pairs = 6;
};
// Declares the section `overlap` of config/mapper.yaml.
void DeclareOverlap(OverlapParams* params, ParameterTable* table);

// Outline of a submap for the overlap search. Information: Submap::predicted_information, zero
// where that was not computed.
struct SubmapOutline {
  SubmapId id;
  Footprint footprint;  // level frame
  double area_m2 = 0.0;
  double radius_m = 0.0;  // of the footprint about the frame
  Eigen::Matrix3d predicted_information = Eigen::Matrix3d::Zero();
};
SubmapOutline OutlineOf(const Submap& submap);

struct OverlapCandidate {
  SubmapId target;
  RelativePose prior;         // T_target_source
  double overlap_m2 = 0.0;    // expected under the prior
  double overlap_part = 0.0;  // of the smaller footprint
  double gain_nats = 0.0;     // predicted information gain of the relative pose by registration
};

// Area that both cover [m2]. Footprints in their own level frames.
double OverlapArea(const Footprint& a, const Footprint& b, const Pose2& T_a_b);

// Its mean under the pair's uncertainty in x, y: Gauss-Hermite quadrature of third order along both
// axes of the error ellipse (points at 0 and +-sqrt(3) sigma), so that a pair whose outlines do not
// meet at the prior is found where the uncertainty may bring them together. Yaw moves the outline
// of a submap by less than its cells.
double ExpectedOverlapArea(const Footprint& target,
                           const Footprint& source,
                           const RelativePose& prior);

// The pair as a candidate, or gain and overlap zero where it cannot meet. Information gain:
// half log det(1 + covariance * predicted information of the part that overlaps).
OverlapCandidate JudgePair(const SubmapOutline& target,
                           const SubmapOutline& source,
                           const RelativePose& prior,
                           double expected_overlap_part);

// Those that qualify, best first: by gain, then overlap, then id; at most max_pairs.
std::vector<OverlapCandidate> ChoosePairs(std::vector<OverlapCandidate> candidates,
                                          const OverlapParams& params);

}  // namespace seastitch
