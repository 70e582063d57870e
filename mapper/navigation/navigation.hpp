#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/nav_tally.hpp"
#include "mapper/navigation/start_state.hpp"

namespace seastitch {

// Position fix of the vehicle's reference point in the map: the lever arm is taken off.
struct MapFix {
  Time time;
  Eigen::Vector2d north_east_m;
  Eigen::Matrix2d covariance_m2;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.time, self.north_east_m, self.covariance_m2);
  }
};

// The sensors whose innovations are watched.
enum class NavSensor : std::uint8_t { kAttitude, kDvl, kDepth, kPositionFix };

// Recent refusals of a sensor's samples.
struct NavSensorHealth {
  double refused_share = 0.0;  // of the samples of the last minute, 0 to 1; unusable ones included
  std::optional<Time> refused_since;  // since when the share has been above a tenth
};

// Sensors that contradict the others and are not used at present.
struct NavDoubts {
  bool gyros = false;            // the attitude is followed instead
  bool accelerometers = false;   // the DVL is followed, or without it the last velocity
  bool attitude_frozen = false;  // it repeats while the gyros turn
};

// Suspected error of a sensor's stamps with respect to the inertial unit's: value to be added to
// the sensor's time offset in the configuration, with 1 sigma. Negative where stamps are late: it
// is minus StampOffset::delay_s().
struct SuspectedOffset {
  NavSensor sensor;
  double add_s;
  double sigma_s;
};

// Interface of a navigation, which the mapper asks for the vehicle's track. A state that was
// returned never changes later. A value that is not known is std::nullopt, never 0. Pure.
class Navigation {
 public:
  virtual ~Navigation() = default;

  virtual void Add(const ImuSample& sample) = 0;
  virtual void Add(const DvlSample& sample) = 0;
  virtual void Add(const DepthSample& sample) = 0;
  virtual void Add(const PositionFix& fix) = 0;
  // Pose that an INS computed. Ignored by a navigation that computes poses itself.
  virtual void Add(const NavigationSample& /*sample*/) {}
  // Sound speed at the sonar. DVL velocities are multiplied by it divided by the speed that the DVL
  // is set to (dvl_sound_speed_mps), unless the DVL measures sound speed itself.
  virtual void AddSoundSpeed(Time t, double speed_mps) = 0;
  // Ends the dive: uses the samples that still wait to be put in order.
  virtual void Finish() = 0;

  // Time of the newest final state. std::nullopt before the start.
  virtual std::optional<Time> latest() const = 0;
  // State at t, interpolated. std::nullopt after latest(), and before the history that is kept
  // (NavigationParams::window_s).
  virtual std::optional<NavState> StateAt(Time t) const = 0;
  // t, or the end of the gap in the data that t lies in. No state is published inside a gap.
  virtual Time AfterGap(Time t) const { return t; }
  // Current state: the latest one extrapolated to the newest inertial sample. Not final.
  virtual std::optional<NavState> Predicted() const = 0;
  // Covariance of (x, y [m], yaw [rad]) of the vehicle at b with respect to the vehicle at a, in
  // the level axes of a (origin and yaw of the vehicle at a; no roll and pitch). std::nullopt as
  // StateAt().
  virtual std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const = 0;
  // Smoothed correction: rigid 2D transform T_anchored_map, by the measurements between `anchor`
  // and `t`. It takes places in the map as navigation knows it at `t` to a map in which the
  // vehicle's pose at `anchor` is the one that was returned for it. anchor <= t.
  virtual std::optional<Pose2> Hindsight(Time anchor, Time t) const = 0;
  // Poses of the track since the last call and up to `until`, smoothed by all measurements up to
  // latest(): call it before they are older than window_s. Each call continues the smoothed track
  // of the one before without a step, so that only its shape counts. Empty where a navigation does
  // not correct its past.
  virtual std::vector<SmoothedPose> TakeSmoothed(Time until) {
    static_cast<void>(until);
    return {};
  }
  // Position fixes that are left to the graph and not taken yet by TakeFixes(), in order of time,
  // up to latest().
  virtual std::vector<MapFix> WaitingFixes() const = 0;
  // Removes and returns those up to `until`.
  virtual std::vector<MapFix> TakeFixes(Time until) = 0;

  // For a restart: the newest state, and the transition of its error since `since`, the frame time
  // of the submap closed last, for the relative covariance between the two. std::nullopt before the
  // start, or where a navigation cannot be saved.
  virtual std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const {
    static_cast<void>(since);
    return std::nullopt;
  }
  // Continues from a saved state and forgets all samples before. The time until the next sample is
  // bridged like any gap in the data. Of the states before the saved one, only those at `since` and
  // at waiting fixes are known. False: not usable, nothing changes.
  virtual bool Restore(Bytes saved) {
    static_cast<void>(saved);
    return false;
  }

  // What the start waits for; and whether a fix or the configuration gave the position. Otherwise
  // its sigma is 1 km.
  virtual StartState start_state() const = 0;
  virtual bool place_is_known() const = 0;
  // True if a position fix gives the start, and not the configuration.
  virtual bool starts_from_fix() const { return false; }
  virtual NavSensorHealth health(NavSensor sensor) const = 0;
  virtual NavDoubts doubts() const { return {}; }
  // Angle by which the Doppler log is turned about the vertical, clockwise from above, beyond its
  // mounting in the configuration: the present estimate.
  virtual double dvl_yaw_rad() const { return 0.0; }
  // Significant errors of stamps, for the configuration. Meanwhile navigation compensates stamps
  // that are late: it extrapolates each sample from its time of measurement. Early ones it cannot.
  // Once configured, the offset here is 0.
  virtual std::vector<SuspectedOffset> suspected_offsets() const = 0;
  // Counts of refused samples, resets and bridged gaps, by name, such as "dvl_not_finite".
  virtual const NavTally& tally() const = 0;
  const Counters& counters() const { return tally().by_name(); }
};

}  // namespace seastitch
