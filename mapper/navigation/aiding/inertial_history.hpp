#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>

#include "common/core/time.hpp"
#include "mapper/navigation/filter/strapdown.hpp"

namespace seastitch {

// History of the inertial unit's rotation and of its integrated specific force over the last
// seconds, independent of the filter. Sensors with late stamps are compared with it, and
// extrapolated by it.
class InertialHistory {
 public:
  explicit InertialHistory(double span_s) : span_s_(span_s) {}

  // Rates with biases removed, linear over the dt_s before t; in order of time.
  void Add(Time t, const InertialRates& from, const InertialRates& to, double dt_s);
  // Call at a gap: the next sample does not continue the last.
  void Clear() { moments_.clear(); }

  bool empty() const { return moments_.empty(); }
  bool Covers(Time t) const {
    return !empty() && moments_.front().time <= t && t <= moments_.back().time;
  }

  // State relative to the first sample of the history; only differences of two have a meaning. At()
  // beyond its ends returns the nearest end.
  struct Moment {
    Time time;
    // Rotation from the imu axes at `time` to the imu axes at the first sample (history's axes).
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d push_mps = Eigen::Vector3d::Zero();  // integrated force, history's axes
    Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.turn, self.push_mps, self.rate_radps);
    }
  };
  Moment At(Time t) const;
  // The turn of the inertial unit from a to b, in the axes at a.
  Eigen::Quaterniond Turn(Time a, Time b) const { return At(a).turn.conjugate() * At(b).turn; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.moments_);
  }

 private:
  const double span_s_;
  std::deque<Moment> moments_;
};

}  // namespace seastitch
