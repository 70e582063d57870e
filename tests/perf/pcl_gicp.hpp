#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "common/core/submap.hpp"

namespace seastitch {

// pcl::GeneralizedIterativeClosestPoint, the registration of the paper's released code: six degrees
// of freedom, nearest neighbours. Kept apart since PCL's templates take a minute to compile.
class PclGicp {
 public:
  // Points in a common level frame; correspondences further apart than max_correspondence_m do not
  // count.
  PclGicp(const PointCloud& target, const PointCloud& source, double max_correspondence_m);
  ~PclGicp();

  // T_target_source from T_prior, trees and covariances made anew.
  Eigen::Isometry3d Align(const Eigen::Isometry3d& T_prior) const;

 private:
  struct Clouds;
  std::unique_ptr<Clouds> clouds_;
  double max_correspondence_m_;
};

}  // namespace seastitch
