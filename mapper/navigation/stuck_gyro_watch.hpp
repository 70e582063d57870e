#pragma once

#include <Eigen/Core>

namespace seastitch {

// Detection of gyros that are stuck: their rates repeat to the last bit, while the device's
// attitude turns otherwise. Neither alone is a fault. Gyros without noise, or with coarse steps,
// repeat on a straight line, and the attitude then agrees with them. A single jump of the device is
// a step of its heading.
class StuckGyroWatch {
 public:
  // Angular rate as measured, bias included, since the last inertial sample.
  void AddRate(const Eigen::Vector3d& rate_radps, double dt_s);
  // Rotation of the device less that by the gyros over dt_s, map axes [rad]. turned_rad: sum of the
  // gyros' absolute rotations meanwhile. Ignored unless the rates repeated all the time.
  void AddDifference(const Eigen::Vector3d& difference_rad, double dt_s, double turned_rad);
  // The next difference does not continue the last.
  void Interrupt();
  // limit_rad: gate times the sigma of a difference over span_s().
  void Judge(double limit_rad);

  // Until the rates change.
  bool are_stuck() const { return are_stuck_; }
  // Time and gyros' rotation that the differences so far cover.
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
  Eigen::Vector3d sum_rad_ = Eigen::Vector3d::Zero();      // of the differences
  Eigen::Vector3d largest_rad_ = Eigen::Vector3d::Zero();  // of them
  double span_s_ = 0.0;
  double turned_rad_ = 0.0;
  bool are_stuck_ = false;
};

}  // namespace seastitch
