#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>

namespace seastitch {

// By how much a sensor's stamps are later than what it measured, found from what it says beside the
// inertial unit: of a row of delays that which explains best by how much the sensor changed from
// sample to sample. Trying all of them needs no first guess and no linear model, so that a delay is
// found however long it is and whatever it was before; what lies back counts for less and less. A
// bias of the inertial unit, of which the differences are full, is found along with each delay.
class StampOffset {
 public:
  static constexpr double kLongestS = 1.5;  // sought up to this, either way

  // What the sensor's change differs by from that of the inertial unit so much earlier, imu axes.
  using Difference = std::function<Eigen::Vector3d(double delay_s)>;
  // With noise of 1 `sigma` in each component, and 1 `drift_sigma` of what is in all differences.
  // dt_s: since the last.
  void Add(const Difference& difference, double sigma, double drift_sigma, double dt_s);

  double delay_s() const { return delay_s_; }
  double sigma_s() const { return sigma_s_; }
  // Far enough from 0 to be no accident, and large enough to matter.
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
  void Find();

  std::array<Sums, kDelays> sums_{};
  double differences_ = 0.0;  // that they hold
  double seen_s_ = 0.0;       // the time in which these came
  double drift_sigma_ = 0.0;
  double delay_s_ = 0.0;
  double sigma_s_ = kPriorS;
};

}  // namespace seastitch
