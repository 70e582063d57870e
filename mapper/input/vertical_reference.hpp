#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/input/datum_height.hpp"
#include "mapper/input/water_level.hpp"

namespace seastitch {

// The map's zero of depth: the water line, a level relative to it from a table, or a level relative
// to the ellipsoid, by heights of the INS.
struct VerticalReferenceParams {
  WaterLevel water_level;     // empty: no table
  bool by_heights = false;    // uses heights above the ellipsoid, not the table
  double separation_m = 0.0;  // height of the map's zero above the ellipsoid
  DatumHeight separation;     // the same by position; if empty, separation_m is used
};

// Height of the water line above the map's zero of depth [m, positive up]. By heights it is: height
// of the INS above the ellipsoid + its depth below the water line - height of the zero. The median
// of a minute averages the noise of the heights. Pure.
class VerticalReference {
 public:
  VerticalReference(const VerticalReferenceParams& params, const VehicleGeometry& vehicle)
      : params_(params), vehicle_(vehicle) {}

  // Takes a depth below the water line.
  void Add(const DepthSample& sample);
  void Add(const NavigationSample& sample);
  // Value to subtract from a depth of time t [m]. By heights: nothing before the first height.
  std::optional<double> LevelAt(Time t) const;
  // True if depths are received without a known water line.
  bool IsMissed() const;

 private:
  struct Stamped {
    Time time;
    double value;
  };
  void SetDepth(Time t, double depth_m, const Eigen::Vector3d& p_vehicle_sensor_m);
  void AddHeight(Time t, double height_m);
  // Vertical distance [m, positive down] of a point of the vehicle from its reference point.
  // Nothing if the attitude is unknown.
  std::optional<double> Below(const Eigen::Vector3d& p_vehicle_m, Time t) const;
  std::optional<double> ZeroAboveEllipsoid(Time t) const;

  const VerticalReferenceParams params_;
  const VehicleGeometry vehicle_;
  std::optional<Time> newest_depth_;
  std::optional<Stamped> depth_;  // depth of the reference point below the water line
  Time turned_at_, placed_at_;
  std::optional<Eigen::Quaterniond> q_ned_vehicle_;
  std::optional<GeoPosition> position_;
  std::deque<Stamped> levels_;  // of the last minute
  std::optional<Stamped> level_;
};

}  // namespace seastitch
