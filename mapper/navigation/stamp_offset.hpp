#pragma once

#include <Eigen/Core>

namespace seastitch {

// By how much a sensor's stamps are later than what it measured, found from what it says beside the
// inertial unit: a Kalman filter of that one number. What a change from one sample to the next
// differs by from that of the inertial unit, taken as much earlier as is known of the delay, grows
// with the rest of the delay.
class StampOffset {
 public:
  // `difference` = slope * (the delay - delay_s()) + noise of 1 sigma in each component. A
  // difference that no delay explains is left out.
  void Add(const Eigen::Vector3d& difference,
           const Eigen::Vector3d& slope,
           double sigma,
           double dt_s);

  double delay_s() const { return delay_s_; }
  double sigma_s() const;
  // Far enough from 0 to be no accident, and large enough to matter.
  bool IsSuspected() const;

 private:
  static constexpr double kPriorS = 0.5;
  double delay_s_ = 0.0;
  double variance_s2_ = kPriorS * kPriorS;
};

}  // namespace seastitch
