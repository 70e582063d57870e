#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "codecs/survey_records.hpp"

namespace seastitch {

// Attitude and heave of a file over time, linear between samples.
class Motion {
 public:
  // Of the samples whose source begins so and that hold both.
  Motion(const std::vector<NavigationRecord>& samples, const std::string& source);

  bool Covers(Time from, Time to) const;
  Eigen::Vector3d RpyAt(Time t) const { return At(t).rpy; }
  double HeaveAt(Time t) const { return At(t).heave_m; }
  // Against axes that are level and look along the heading.
  Eigen::Matrix3d RotationAt(Time t, double heading_rad) const;

 private:
  struct Knot {
    Time time;
    Eigen::Vector3d rpy;  // the heading unwrapped
    double heave_m;
  };
  Knot At(Time t) const;

  std::vector<Knot> knots_;
};

}  // namespace seastitch
