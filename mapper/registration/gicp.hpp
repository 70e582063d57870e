#pragma once

#include <memory>
#include <string>

#include "mapper/registration/registration.hpp"

// The paper's own registration (III-A-3), kept as the baseline: generalised ICP (Segal, Haehnel,
// Thrun, "Generalized-ICP", RSS 2009) between points with plane covariances, in x, y and yaw, from
// the prior alone. It does not search for other modes, nor detect open directions, as Align() does.
namespace seastitch {

struct GicpParams {
  double voxel_m = 0.5;             // points are thinned to one a voxel
  int neighbours = 20;              // that a point's plane is fitted to
  double epsilon = 1e-3;            // variance of a plane across it, where along it it is 1
  double yaw_information = 1000.0;  // [rad^-2]: the paper's code gives every closure the same
};

// Thinned points in the level frame, their plane covariances and a k-d tree of them.
class GicpSubmap {
 public:
  // Points that are not finite are left out. R_level_submap: see LevelFromBody().
  GicpSubmap(const PointCloud& cloud,
             const Eigen::Matrix3d& R_level_submap,
             const GicpParams& params);
  ~GicpSubmap();
  GicpSubmap(GicpSubmap&&) noexcept;
  GicpSubmap& operator=(GicpSubmap&&) noexcept;

  struct Points;
  const Points& points() const { return *points_; }

 private:
  std::unique_ptr<Points> points_;
};

// As Align(); z stays at the prior's z_m (z_sigma_m is not used). A point of the source has a
// partner where one lies within window_sigma of the prior, then within half of that and so on, down
// to two voxels. Information of x, y: the inverse of the mean plane covariance of the pairs of
// points, which the paper calls a heuristic: it does not grow with their number, nor fall with the
// fit.
RegistrationResult RegisterGicp(const GicpSubmap& target,
                                const GicpSubmap& source,
                                const RegistrationPrior& prior,
                                const GicpParams& gicp,
                                const RegistrationParams& params);

}  // namespace seastitch
