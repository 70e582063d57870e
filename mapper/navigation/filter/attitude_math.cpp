#include "mapper/navigation/filter/attitude_math.hpp"

#include <algorithm>

namespace seastitch {

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Matrix3d EulerAxes(const Eigen::Matrix3d& R_map_body) {
  const Eigen::Vector3d forward = R_map_body.col(0);
  Eigen::Matrix3d axes;
  axes.col(0) = forward;
  axes.col(1) = Eigen::Vector3d(-forward.y(), forward.x(), 0.0) /
                std::max(forward.head<2>().norm(), kMinCosPitch);
  axes.col(2) = Eigen::Vector3d::UnitZ();
  return axes;
}

}  // namespace seastitch
