#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Scalar innovations of one sensor. Of a filter whose covariance is honest, mean_nis is near 1.
struct InnovationSummary {
  std::int64_t used = 0;
  std::int64_t gated = 0;  // further off than gate_sigma
  double mean_nis = 0.0;   // mean of innovation^2 / variance of those used
  // Correlation of a component's innovation with its last one: of an honest filter near 0.
  double lag_one = 0.0;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.used, self.gated, self.mean_nis, self.lag_one);
  }
};

// Dead reckoning: strapdown inertial navigation corrected by an error-state Kalman filter with the
// device's attitude, DVL bottom track, depth and position fixes. Frozen as it goes: a state once
// given is never changed by what comes later, so that what was built upon it stays where it is.
//
// The map is taken as flat: good to a few kilometres from the datum.
//
// Samples may arrive in any order within reorder_window_s and give the same bytes out. A sample
// that is not finite, beyond any vehicle's limits, late or from a leaping clock is refused and
// counted. Inertial samples drive the clock: nothing moves without them.
class DeadReckoning : public Navigation {
 public:
  // Throws std::invalid_argument (CheckParams).
  DeadReckoning(const NavigationParams& params, const VehicleGeometry& vehicle);
  ~DeadReckoning() override;
  DeadReckoning(DeadReckoning&&) noexcept;
  DeadReckoning& operator=(DeadReckoning&&) noexcept;

  using Navigation::Add;
  void Add(const ImuSample& sample) override;
  void Add(const DvlSample& sample) override;
  void Add(const DepthSample& sample) override;
  void Add(const PositionFix& fix) override;
  // Sound speed in the water that the DVL is in: scales what it says from then on, where
  // params.dvl_sound_speed_mps tells which speed it reckons with.
  void AddSoundSpeed(Time t, double speed_mps) override;
  // Uses what still waits in the reorder window: at the end of a log.
  void Finish() override;

  StartState start_state() const override;
  bool place_is_known() const override;
  NavSensorHealth health(NavSensor sensor) const override;
  std::vector<SuspectedOffset> suspected_offsets() const override;

  // States up to here are final. Nothing before the start is made.
  std::optional<Time> latest() const override;
  // Nothing outside [oldest kept, latest()]. Covariance is that of the frozen estimate.
  std::optional<NavState> StateAt(Time t) const override;
  std::optional<NavState> Predicted() const override;
  // Covariance of the velocity north and east [m2/s2], of the nearest key. Nothing outside the
  // window of window_s.
  std::optional<Eigen::Matrix2d> VelocityCovariance(Time t) const;
  // Covariance of (x, y [m], yaw [rad]) of Inverse(level a) * level b, in the level axes of a, for
  // the vehicle frames at a and b (either order). Nothing outside the window of window_s.
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const override;
  // States are frozen, so the track bends wherever heading or position is learned. T_anchored_map,
  // level, takes places in the map as of `t` to a map in which the vehicle at `anchor`, as its pose
  // is known at `t`, stands where it was frozen: in that map the track from anchor to t is as
  // straight as the sensors say that it was. What stands is the track's last key before the anchor,
  // up to key_interval_s; `t` counts from its last epoch, up to epoch_interval_s before. anchor <=
  // t; nothing outside the window of window_s.
  std::optional<Pose2> Hindsight(Time anchor, Time t) const override;

  // Fixes after the start and up to `until` that the filter does not take, in order of time; each
  // is given once, and kept for window_s until then.
  std::vector<MapFix> WaitingFixes() const override;
  std::vector<MapFix> TakeFixes(Time until) override;

  // Some 100 kB, most of it what the inertial unit felt in the last seconds. All state but the
  // track: of samples that follow, the same becomes as without the restart, to the last bit.
  std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const override;
  bool Restore(Bytes saved) override;

  const std::map<std::string, std::int64_t>& counters() const override;
  InnovationSummary innovations(NavSensor sensor) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
