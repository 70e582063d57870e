#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Comparison of two sensors by their changes from sample to sample: the device's attitude with the
// gyros, the DVL's velocity with the accelerometers. No filter takes part, so that a wrong filter
// has no influence. A single difference is a step of the sensor with an absolute value (device,
// DVL). Differences that continue are a fault of the integrated sensor (gyros, accelerometers) or
// of the stamps.
class IncrementWatch {
 public:
  // A difference beyond `gate` sigma counts. A fault that continues ends after quiet_s without one.
  IncrementWatch(double gate, double quiet_s) : gate_(gate), quiet_s_(quiet_s) {}

  // The difference since the last sample, and 1 sigma of each of its components.
  void Add(Time t, const Eigen::Vector3d& difference, double sigma);
  // Call after a gap: the next difference does not continue the last.
  void Interrupt() { last_.clear(); }
  void ForgetStep();

  bool GoesOn(Time t) const;
  // Present step of the sensor: sum of the single differences. Empty if later ones cancelled it.
  // StepIsSure(): at least kAgreeing samples that agree have followed.
  const std::optional<Eigen::Vector3d>& step() const { return step_; }
  bool StepIsSure() const { return step_ && since_step_ >= kAgreeing; }
  Time step_time() const { return step_time_; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.last_,
            self.last_going_on_,
            self.step_,
            self.step_sigma_,
            self.step_time_,
            self.since_step_);
  }

 private:
  static constexpr std::size_t kWindow = 5;
  static constexpr int kAgreeing = 2;
  struct Difference {
    Eigen::Vector3d value;
    double sigma;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.value, self.sigma);
    }
  };
  bool WindowDiffers() const;
  void AddStep(Time t, const Difference& difference);

  const double gate_;
  const double quiet_s_;
  std::deque<Difference> last_;
  std::optional<Time> last_going_on_;
  std::optional<Eigen::Vector3d> step_;
  double step_sigma_ = 0.0;
  Time step_time_;
  int since_step_ = 0;
};

}  // namespace seastitch
