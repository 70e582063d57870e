#pragma once

#include <Eigen/Core>

namespace seastitch {

// Detects stuck gyros: their rates repeat to the last bit while the device's attitude rotates
// differently. One of both alone is no fault: gyros without noise, or with coarse steps, repeat on
// a straight line, but then agree with the attitude. A single jump of the device is a step of its
// heading.
class StuckGyroWatch {
 public:
  // Adds the measured angular rate, bias included, of the dt_s since the last inertial sample.
  void AddRate(const Eigen::Vector3d& rate_radps, double dt_s);
  // Adds the rotation of the device minus that of the gyros over dt_s, map axes [rad]. turned_rad:
  // sum of the gyros' absolute rotations in this time. Ignored unless the rates repeated all the
  // time.
  void AddDifference(const Eigen::Vector3d& difference_rad, double dt_s, double turned_rad);
  // Call after a gap: the next difference does not continue the last.
  void Interrupt();
  // Decides whether the gyros are stuck. limit_rad: gate times the sigma of a difference over
  // span_s().
  void Judge(double limit_rad);

  // True until the rates change.
  bool are_stuck() const { return are_stuck_; }
  // Time covered by the differences so far, and rotation of the gyros in it.
  double span_s() const { return span_s_; }
  double turned_rad() const { return turned_rad_; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.last_rate_radps_, self.repeated_s_, self.sum_rad_, self.largest_rad_);
    archive(self.span_s_, self.turned_rad_, self.are_stuck_);
  }

 private:
  Eigen::Vector3d last_rate_radps_ = Eigen::Vector3d::Zero();
  double repeated_s_ = 0.0;
  Eigen::Vector3d sum_rad_ = Eigen::Vector3d::Zero();      // sum of the differences
  Eigen::Vector3d largest_rad_ = Eigen::Vector3d::Zero();  // largest of the differences
  double span_s_ = 0.0;
  double turned_rad_ = 0.0;
  bool are_stuck_ = false;
};

}  // namespace seastitch
