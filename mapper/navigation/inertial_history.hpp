#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>

#include "common/core/time.hpp"
#include "mapper/navigation/strapdown.hpp"

namespace seastitch {

// What the inertial unit has felt in the last seconds, without any filter: how it has turned, and
// what its accelerometers have added to the velocity. Sensors that are stamped late are compared
// with it, and carried forward by it.
class InertialHistory {
 public:
  explicit InertialHistory(double span_s) : span_s_(span_s) {}

  // Free of bias, changing evenly over the dt_s before t; in order of time.
  void Add(Time t, const InertialRates& from, const InertialRates& to, double dt_s);
  // What happens from here on does not join on to what was before.
  void Clear() { moments_.clear(); }

  bool empty() const { return moments_.empty(); }
  bool Covers(Time t) const {
    return !empty() && moments_.front().time <= t && t <= moments_.back().time;
  }

  // Since an instant of its own; only differences mean something. Beyond its ends: that of the end.
  struct Moment {
    Time time;
    // Takes imu axes to those at the instant.
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d push_mps = Eigen::Vector3d::Zero();  // by specific force, axes of the instant
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
