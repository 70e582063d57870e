#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/datum_height.hpp"
#include "mapper/water_level.hpp"

namespace seastitch {

// Where the map's zero of depth lies: on the water line, below it by a table, or where the INS's
// heights say.
struct VerticalReferenceParams {
  WaterLevel water_level;     // empty: none
  bool by_heights = false;    // heights above the ellipsoid in place of a table
  double separation_m = 0.0;  // the map's zero of depth above the ellipsoid
  DatumHeight separation;     // by place; empty: separation_m
};

// The water line above the map's zero of depth. By heights: height of the INS above the ellipsoid,
// its depth below the water line, and the zero's own height; the median of a minute, since heave
// and depth are finer than heights are. Pure.
class VerticalReference {
 public:
  VerticalReference(const VerticalReferenceParams& params, const VehicleGeometry& vehicle)
      : params_(params), vehicle_(vehicle) {}

  // Depths below the water line.
  void Add(const DepthSample& sample);
  void Add(const NavigationSample& sample);
  // To be taken off a depth of that time. Nothing before the first height.
  std::optional<double> LevelAt(Time t) const;
  // Whether depths have come whose water line is not known.
  bool IsMissed() const;

 private:
  struct Stamped {
    Time time;
    double value;
  };
  void SetDepth(Time t, double depth_m, const Eigen::Vector3d& p_vehicle_sensor_m);
  void AddHeight(Time t, double height_m);
  // How far a place in the vehicle is below its reference point; nothing where that is not known.
  std::optional<double> Below(const Eigen::Vector3d& p_vehicle_m, Time t) const;
  std::optional<double> ZeroAboveEllipsoid(Time t) const;

  const VerticalReferenceParams params_;
  const VehicleGeometry vehicle_;
  std::optional<Time> newest_depth_;
  std::optional<Stamped> depth_;  // of the reference point, below the water line
  Time turned_at_, placed_at_;
  std::optional<Eigen::Quaterniond> q_ned_vehicle_;
  std::optional<InsPosition> position_;
  std::deque<Stamped> levels_;  // of the last minute
  std::optional<Stamped> level_;
};

}  // namespace seastitch
