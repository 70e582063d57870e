#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Compares by how much two sensors say that something has changed from sample to sample: the
// device's attitude against the gyros, the DVL's velocity against the accelerometers. That needs
// no filter, and so none that may be wrong. One lone difference is a step of the sensor that has
// an absolute value; differences that go on are a fault of the one that is integrated, or of the
// stamps.
class IncrementWatch {
 public:
  // Differences beyond `gate` sigma count. Those that go on are over when there was none for
  // quiet_s.
  IncrementWatch(double gate, double quiet_s) : gate_(gate), quiet_s_(quiet_s) {}

  // The difference since the last sample, and 1 sigma of each of its components.
  void Add(Time t, const Eigen::Vector3d& difference, double sigma);
  // The next difference does not join on to the last: what the sensors did meanwhile is not known.
  void Interrupt() { last_.clear(); }
  void ForgetStep();

  bool GoesOn(Time t) const;
  // The sum of lone differences that did not come back. Sure: others that agree have followed it.
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
