#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/geo_point.hpp"
#include "common/geo/datum.hpp"
#include "products/track/track.hpp"

// The corrected track in formats of other programs. Heading is the corrected yaw; roll, pitch and
// depth are dead reckoned.
namespace seastitch {

// The corrected track on the ellipsoid, with velocity from its own positions: the mean over the
// states before and after it, none further than 1 s.
struct GeographicState : GeoPoint {
  Time time;
  double depth_m = 0.0;  // below the water line
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_ned_mps = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> sigma{};  // north, east [m], heading [rad]
};
std::vector<GeographicState> ToGeographic(const std::vector<CorrectedState>& track,
                                          const Datum& datum);

// 2026-05-02T10:20:30.123456Z
std::string IsoTime(Time time);

// GPS time, which has no leap seconds, since 6 January 1980.
double GpsSeconds(Time time);

// Text of navigation.csv: one header line, ISO time, degrees. An empty field is not known.
inline constexpr std::string_view kNavigationCsvHeading =
    "time,latitude_deg,longitude_deg,depth_m,heading_deg,roll_deg,pitch_deg,sigma_north_m,"
    "sigma_east_m,sigma_heading_deg";
std::string NavigationCsv(const std::vector<GeographicState>& track);

// Applanix SBET: seconds of the GPS week (from 0 again after its end), heights below the water line
// as negative, wander angle 0, velocity north, east, down. Accelerations and rates, which the track
// does not hold, are 0.
std::string SbetBytes(const std::vector<GeographicState>& track);

// MB-System .na0, as mbnavadjust writes it.
std::string Na0Text(const std::vector<GeographicState>& track);

}  // namespace seastitch
