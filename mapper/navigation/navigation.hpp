#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Where a position fix puts the vehicle in the map.
struct MapFix {
  Time time;
  Eigen::Vector2d north_east_m;
  Eigen::Matrix2d covariance_m2;
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
  // Sound speed at the sonar: scales the DVL's velocities where it does not measure that itself.
  virtual void AddSoundSpeed(Time t, double speed_mps) = 0;
  // No more samples come: uses what still waits to be put in order.
  virtual void Finish() = 0;

  // States up to here are final. Nothing before the start.
  virtual std::optional<Time> latest() const = 0;
  // Nothing outside of what is kept.
  virtual std::optional<NavState> StateAt(Time t) const = 0;
  // Covariance of (x, y [m], yaw [rad]) of the vehicle at b seen from the vehicle at a, in the
  // level axes of a. Nothing outside of what is kept.
  virtual std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const = 0;
  // T_anchored_map, level: takes places in the map as of `t` to a map in which the vehicle at
  // `anchor`, as its pose is known at `t`, stands where it was frozen. anchor <= t.
  virtual std::optional<Pose2> Hindsight(Time anchor, Time t) const = 0;
  // The fixes up to `until` that navigation leaves to the graph, in order of time; each once.
  virtual std::vector<MapFix> TakeFixes(Time until) = 0;

  // Everything refused, reset or coasted, by name.
  virtual const std::map<std::string, std::int64_t>& counters() const = 0;
};

}  // namespace seastitch
