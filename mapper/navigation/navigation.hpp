#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/start_state.hpp"

namespace seastitch {

// Where a position fix puts the vehicle in the map.
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

// What became of a sensor's samples lately.
struct NavSensorHealth {
  double refused_share = 0.0;         // of its last minute, 0 to 1
  std::optional<Time> refused_since;  // since when the share has been above a tenth
};

// Stamps that disagree with the inertial unit's: what to add to the sensor's time offset in the
// configuration, and 1 sigma.
struct SuspectedOffset {
  NavSensor sensor;
  double add_s;
  double sigma_s;
};

// What the mapper needs to know of the vehicle's track. States are frozen: one once given never
// changes. What is not known is nothing, never a zero. Pure.
class Navigation {
 public:
  virtual ~Navigation() = default;

  virtual void Add(const ImuSample& sample) = 0;
  virtual void Add(const DvlSample& sample) = 0;
  virtual void Add(const DepthSample& sample) = 0;
  virtual void Add(const PositionFix& fix) = 0;
  // What an INS has computed: of no use to who computes it itself.
  virtual void Add(const NavigationSample& /*sample*/) {}
  // Sound speed at the sonar: scales the DVL's velocities where it does not measure that itself.
  virtual void AddSoundSpeed(Time t, double speed_mps) = 0;
  // No more samples come: uses what still waits to be put in order.
  virtual void Finish() = 0;

  // States up to here are final. Nothing before the start.
  virtual std::optional<Time> latest() const = 0;
  // Nothing outside of what is kept.
  virtual std::optional<NavState> StateAt(Time t) const = 0;
  // The latest state carried on to the newest inertial sample: not final, but now.
  virtual std::optional<NavState> Predicted() const = 0;
  // Covariance of (x, y [m], yaw [rad]) of the vehicle at b seen from the vehicle at a, in the
  // level axes of a. Nothing outside of what is kept.
  virtual std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const = 0;
  // T_anchored_map, level: takes places in the map as of `t` to a map in which the vehicle at
  // `anchor`, as its pose is known at `t`, stands where it was frozen. anchor <= t.
  virtual std::optional<Pose2> Hindsight(Time anchor, Time t) const = 0;
  // The fixes that navigation leaves to the graph and that nobody has taken, in order of time, as
  // far as states are final.
  virtual std::vector<MapFix> WaitingFixes() const = 0;
  // Those up to `until`; each is given once.
  virtual std::vector<MapFix> TakeFixes(Time until) = 0;

  // For a restart: the newest state, and how its error has come about since `since`, the frame of
  // the submap closed last. Nothing before the start, or where a navigation cannot be saved.
  virtual std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const {
    static_cast<void>(since);
    return std::nullopt;
  }
  // Goes on from there, forgetting what was added here before: what is missing until the next
  // sample is a gap as any other. States before the saved one, but for `since` and fixes that wait,
  // are not known any more. False: not usable, nothing changes.
  virtual bool Restore(Bytes saved) {
    static_cast<void>(saved);
    return false;
  }

  // What the start waits for, and whether anybody has said where the vehicle is: without that the
  // place is unknown by a kilometre.
  virtual StartState start_state() const = 0;
  virtual bool place_is_known() const = 0;
  virtual NavSensorHealth health(NavSensor sensor) const = 0;
  // Those that are too far off to be chance. What navigation uses is carried to its true time.
  virtual std::vector<SuspectedOffset> suspected_offsets() const = 0;
  // Everything refused, reset or coasted, by name, such as "dvl_not_finite".
  virtual const std::map<std::string, std::int64_t>& counters() const = 0;
};

}  // namespace seastitch
