#include "products/report/advice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>

#include "common/core/pose.hpp"
#include "products/report/noise_report.hpp"
#include "products/report/report.hpp"

namespace seastitch {
namespace {

// Smaller differences change no map.
constexpr double kLeastLeverM = 0.02;
constexpr double kLeastYawDeg = 0.02;
constexpr double kLeastOffsetS = 0.002;
constexpr double kMostOffsetS = 1.0;  // the range of the keys

std::string Text(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[320];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// To a millimetre or a thousandth of a degree.
std::string Vector(const Eigen::Vector3d& v) {
  const auto rounded = [](double x) { return std::round(1000.0 * x) / 1000.0 + 0.0; };
  return Text("[%.6g, %.6g, %.6g]", rounded(v.x()), rounded(v.y()), rounded(v.z()));
}

bool IsClear(double value, double sigma, double least) {
  return std::abs(value) > std::max(least, kAdviceSigmas * sigma);
}

std::string Angles(const Eigen::Matrix3d& R, double turned_by_deg) {
  Eigen::Vector3d angles = RpyFromRotation(R);
  for (double& angle : angles) angle = Rad2Deg(angle);
  angles.z() += turned_by_deg;
  return Vector(angles);
}

void AddDvl(double turned_rad,
            const VehicleGeometry& vehicle,
            const std::string& file,
            std::vector<Advice>* advice) {
  const double turned_deg = Rad2Deg(turned_rad);
  const Eigen::Matrix3d R = vehicle.T_vehicle_dvl.linear();
  advice->push_back({file,
                     "dvl.roll_pitch_yaw_deg",
                     Angles(R, 0.0),
                     Angles(R, turned_deg),
                     Text("Navigation, closures and fixes find the Doppler log turned by %.1f "
                          "degrees. This map suffers from it: replay the dive with the new value.",
                          turned_deg)});
}

// The lever arm of the sonar, and its yaw against the Doppler log's.
void AddMounting(const MountingErrors& errors,
                 const VehicleGeometry& vehicle,
                 const std::string& file,
                 std::vector<Advice>* advice) {
  const Eigen::Vector3d sigma = errors.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Vector3d lever = vehicle.T_vehicle_mbes.translation();
  Eigen::Vector3d better = lever;
  for (const Eigen::Index axis : {0, 1})
    if (IsClear(errors.sonar_m[axis], sigma[axis], kLeastLeverM))
      better[axis] += errors.sonar_m[axis];
  if (better != lever)
    advice->push_back(
        {file,
         "mbes.position_m",
         Vector(lever),
         Vector(better),
         Text("Where swaths overlap, the soundings lie as if the sonar were %.2f m further forward "
              "and %.2f m further to starboard. A latency or a pitch angle can do the same: a "
              "patch test distinguishes them.",
              errors.sonar_m.x(),
              errors.sonar_m.y())});
  const double yaw_deg = Rad2Deg(errors.dvl_yaw_rad);
  if (!IsClear(yaw_deg, Rad2Deg(sigma.z()), kLeastYawDeg)) return;
  const Eigen::Matrix3d R = vehicle.T_vehicle_mbes.linear();
  advice->push_back({file,
                     "mbes.roll_pitch_yaw_deg",
                     Angles(R, 0.0),
                     Angles(R, -yaw_deg),
                     Text("Sonar and Doppler log are turned against each other by %.3f degrees "
                          "(1 sigma %.3f). If the Doppler log is known to have the wrong angle, "
                          "add them to its yaw instead.",
                          yaw_deg,
                          Rad2Deg(sigma.z()))});
}

void AddOffset(const std::string& key,
               double configured_s,
               const TimeOffsetEstimate& offset,
               const std::string& file,
               std::vector<Advice>* advice) {
  const double suggested_s = configured_s + offset.add_s;
  if (std::abs(suggested_s) > kMostOffsetS) return;
  advice->push_back({file,
                     key,
                     Text("%.3f", configured_s),
                     Text("%.3f", suggested_s),
                     Text("Its stamps are %.1f ms ", 1000.0 * std::abs(offset.add_s)) +
                         (offset.add_s > 0.0 ? "early" : "late") +
                         Text(" (1 sigma %.1f ms).", 1000.0 * offset.sigma_s)});
}

// What the overlaps found, and this map has already.
void AddCalibration(const std::vector<CalibrationEstimate>& rounds,
                    const std::string& file,
                    std::vector<Advice>* advice) {
  if (rounds.size() < 2) return;
  const CalibrationEstimate& first = rounds.front();
  for (const CalibrationName& of : kCalibrationNames) {
    if (!first.Of(of.key).is_clear) continue;
    const auto text = [&](double value) { return Text("%.3f", value / of.per_unit + 0.0); };
    advice->push_back({file,
                       std::string("calibration.") + of.name,
                       text(first.used.*of.value),
                       text(rounds.back().used.*of.value),
                       "Where swaths overlap, their heights differ as with this error (1 sigma " +
                           text(first.Of(of.key).sigma) + " " + of.unit +
                           "). This map was made with the new value."});
  }
}

}  // namespace

std::vector<Advice> AdviceOf(const Survey& survey,
                             const ProductSummary& summary,
                             const ProductOptions& options) {
  std::vector<Advice> advice;
  const bool has_wrong_clock = HasWrongClock(options.warnings);
  const bool knows_vehicles =
      options.vehicles.size() == std::max<std::size_t>(1, options.dives.size());
  for (std::size_t k = 0; k < std::max<std::size_t>(1, options.dives.size()); ++k) {
    const DiveReport dive = k < options.dives.size() ? options.dives[k] : DiveReport{};
    const std::string of_dive = k < summary.dives.size() ? " of " + summary.dives[k].name : "";
    const auto chain = static_cast<std::int32_t>(k);
    // A Doppler log that is turned spoils the other estimates of the mounting.
    if (knows_vehicles && dive.dvl_turned_rad)
      AddDvl(*dive.dvl_turned_rad, options.vehicles[k], "vehicle.yaml" + of_dive, &advice);
    else if (knows_vehicles && summary.outcome == Outcome::kCorrected &&
             !MountingRows(survey, chain).empty())
      AddMounting(survey.solution.MountingOf(chain),
                  options.vehicles[k],
                  "vehicle.yaml" + of_dive,
                  &advice);
    AddCalibration(dive.calibration, "mapper.yaml" + of_dive, &advice);
    const auto timing = ClearTiming(dive.sonar);
    if (timing && !dive.sonar.placed_by_source && !has_wrong_clock && !dive.IsSeenByOverlaps())
      AddOffset(SonarTimingEstimate::kKey,
                dive.sonar.configured_s,
                *timing,
                "mapper.yaml" + of_dive,
                &advice);
    for (const StampOffsetEstimate& offset : dive.stamp_offsets)
      if (IsClear(offset.add_s, offset.sigma_s, kLeastOffsetS))
        AddOffset(offset.key,
                  offset.configured_s,
                  {offset.add_s, offset.sigma_s},
                  "mapper.yaml" + of_dive,
                  &advice);
  }
  return advice;
}

}  // namespace seastitch
