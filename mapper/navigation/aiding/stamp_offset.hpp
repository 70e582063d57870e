#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>

namespace seastitch {

// Estimator of the delay of a sensor's stamps with respect to the inertial unit: stamp minus time
// of measurement [s], positive where stamps are late. It is the delay, of a grid from -kLongestS to
// kLongestS, for which the sensor's changes from sample to sample differ least from those of the
// inertial unit. A grid needs no initial guess and no linear model. Old samples are forgotten with
// a time constant of 200 s, so that a delay that changes is found again. The bias of the inertial
// unit, which is part of every difference, is estimated together with each delay.
class StampOffset {
 public:
  static constexpr double kLongestS = 1.5;  // longest delay that is found, early or late

  // Change of the sensor between two samples minus that of the inertial unit delay_s earlier, imu
  // axes: a rotation [rad] or a velocity [m/s].
  using Difference = std::function<Eigen::Vector3d(double delay_s)>;
  // Adds a pair of samples. 1 sigma of each component, in the unit of the difference: sigma of the
  // noise, drift_sigma of the bias that all differences share. dt_s: time since the last pair.
  void Add(const Difference& difference, double sigma, double drift_sigma, double dt_s);

  double delay_s() const { return delay_s_; }
  double sigma_s() const { return sigma_s_; }
  // Delay over which the inertial unit can extrapolate a sample to its stamp: 0 where none is
  // suspected, and where stamps are early, which would take inertial data of the future.
  double carried_s() const { return IsSuspected() ? std::max(delay_s_, 0.0) : 0.0; }
  // Whether the delay exceeds 10 ms and 4 sigma, and explains the differences so much better than
  // none.
  bool IsSuspected() const;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.sums_, self.differences_, self.seen_s_, self.drift_sigma_);
    archive(self.delay_s_, self.sigma_s_);
  }

 private:
  static constexpr double kStepS = 0.05;
  static constexpr double kPriorS = 0.5;
  static constexpr int kEachWay = static_cast<int>(kLongestS / kStepS + 0.5);
  static constexpr std::size_t kDelays = 2 * kEachWay + 1;
  static constexpr double DelayS(std::size_t i) {
    return kStepS * (static_cast<double>(i) - kEachWay);
  }
  // Sums over the differences d, for one delay.
  struct Sums {
    double square = 0.0;                              // d^2 / sigma^2
    double weight = 0.0;                              // 1 / sigma^2
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();  // d / sigma^2

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.square, self.weight, self.drift);
    }
  };
  double DataCost(const Sums& sums) const;  // -2 log likelihood
  double Cost(std::size_t i) const;
  double Noisier(std::size_t i) const;
  std::size_t Best() const;
  void Find();

  std::array<Sums, kDelays> sums_{};
  double differences_ = 0.0;  // number of differences in sums_, with the same forgetting
  double seen_s_ = 0.0;       // sum of their dt_s, with the same forgetting
  double drift_sigma_ = 0.0;
  double delay_s_ = 0.0;
  double sigma_s_ = kPriorS;
};

}  // namespace seastitch
