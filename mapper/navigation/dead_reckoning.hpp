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

// Statistics of the scalar innovations of one sensor. For a consistent filter mean_nis is near 1
// and lag_one near 0.
struct InnovationSummary {
  std::int64_t used = 0;
  std::int64_t gated = 0;  // refused: farther off than gate_sigma
  double mean_nis = 0.0;   // mean of innovation^2 / variance of those used
  double lag_one = 0.0;    // autocorrelation of a component's innovations, lag one

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.used, self.gated, self.mean_nis, self.lag_one);
  }
};

// Dead reckoning: strapdown inertial navigation corrected by an error-state Kalman filter with the
// device's attitude, DVL bottom track, depth and position fixes. A state that was returned never
// changes later, so that soundings placed by it stay where they are.
//
// The map is flat, which is accurate within a few kilometres of the datum.
//
// The order in which samples arrive within reorder_window_s does not change the result. A sample
// that is not finite, beyond any vehicle's limits, late or from a stepping clock is refused and
// counted. Time advances with the inertial samples: without them no state comes.
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
  // Sound speed at the DVL from t on: its velocities are multiplied by speed_mps divided by
  // params.dvl_sound_speed_mps, unless that is 0.
  void AddSoundSpeed(Time t, double speed_mps) override;
  // Uses the samples that still wait in the reorder window: at the end of a log.
  void Finish() override;

  StartState start_state() const override;
  bool place_is_known() const override;
  bool starts_from_fix() const override;
  NavSensorHealth health(NavSensor sensor) const override;
  NavDoubts doubts() const override;
  double dvl_yaw_rad() const override;
  std::vector<SuspectedOffset> suspected_offsets() const override;

  // Time of the newest final state. std::nullopt before the start.
  std::optional<Time> latest() const override;
  // std::nullopt outside [latest() - window_s, latest()]. The covariance is that of the state when
  // it was published.
  std::optional<NavState> StateAt(Time t) const override;
  Time AfterGap(Time t) const override;
  std::optional<NavState> Predicted() const override;
  // Covariance of the velocity north and east [m2/s2], at the nearest key. std::nullopt as
  // StateAt().
  std::optional<Eigen::Matrix2d> VelocityCovariance(Time t) const;
  // Covariance of (x, y [m], yaw [rad]) of Inverse(level a) * level b, in the level axes of a, for
  // the vehicle frames at a and b (either order). std::nullopt as StateAt().
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const override;
  // Published states do not change, so that the published track bends wherever heading or position
  // is corrected. T_anchored_map, a rigid 2D transform, takes places in the map as known at `t` to
  // a map in which the vehicle's pose at `anchor` is the published one: there the track from anchor
  // to t has no such bends. Resolution: the anchor is the last key at or before it
  // (key_interval_s), `t` the last epoch (epoch_interval_s). anchor <= t. std::nullopt as
  // StateAt().
  std::optional<Pose2> Hindsight(Time anchor, Time t) const override;

  // One pose every key_interval_s. Fixed-interval smoothing: modified Bryson-Frazier, backwards
  // from latest(). A reset (TakePosition and the like) is no measurement: its step stays.
  std::vector<SmoothedPose> TakeSmoothed(Time until) override;

  // Fixes after the start that the filter does not use, in order of time, kept for window_s.
  // TakeFixes() removes and returns those up to `until`.
  std::vector<MapFix> WaitingFixes() const override;
  std::vector<MapFix> TakeFixes(Time until) override;

  // About 100 kB, most of it inertial data of the last seconds. With all state but the track: the
  // samples that follow give the same result as without the restart, to the last bit.
  std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const override;
  bool Restore(Bytes saved) override;

  const NavTally& tally() const override;
  InnovationSummary innovations(NavSensor sensor) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
