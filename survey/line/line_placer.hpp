#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codecs/lines/line_points.hpp"
#include "products/geo/geographic_converter.hpp"
#include "survey/line/line_track.hpp"

namespace seastitch {

// What a file of processed soundings does not state for a program: found from all of its points and
// the track (PlanLine).
struct LineParams {
  std::shared_ptr<const LineTrack> track;
  std::shared_ptr<const GeographicConverter> to_geographic;
  double depth_per_z = -1.0;           // depth below the water line [m] = z * depth_per_z
  std::optional<Time> time_zero = {};  // of the points' times; nothing: the points have none
  // Without times: the part of the track of each line.
  std::map<std::uint16_t, TrackPart> parts = {};
};

// Largest distance across of a sounding so far below the vehicle.
double SwathReach(double below_m);

// Makes pings of the points of a file: soundings relative to the vehicle at the time of each point,
// else at the place of the track nearest to it. A ping has the points of kPingS of the vehicle's
// time. Pings come in order of time: kHeldPoints points wait for earlier ones (25 MB).
//
// Counts line_points_used, line_points_without_track, line_points_far_from_track,
// line_points_out_of_order (later than kHeldPoints points), line_points_outside_crs.
class LinePlacer : public LinePoints {
 public:
  static constexpr double kPingS = 0.05;
  static constexpr double kNearestPingS = 0.2;  // without times
  static constexpr std::size_t kHeldPoints = 1'000'000;

  explicit LinePlacer(LineParams params) : params_(std::move(params)) {}

  void Add(const LinePoint& point, std::vector<SurveyRecord>* out) override;
  void Finish(std::vector<SurveyRecord>* out) override;
  Counters counters() const override { return counters_; }

 private:
  struct Ping {
    LineTrack::State vehicle;
    std::vector<PlacedBeam> soundings;
  };

  void PlaceBatch(std::vector<SurveyRecord>* out);
  void Place(const LinePoint& point, const Eigen::Vector2d& p_map, std::vector<SurveyRecord>* out);
  std::optional<Time> TimeOf(const LinePoint& point, const Eigen::Vector2d& p_map) const;
  std::map<Time, Ping>::iterator PingAt(Time t);
  void GiveFirst(std::vector<SurveyRecord>* out);

  const LineParams params_;
  std::vector<LinePoint> batch_;  // that wait to be converted together
  std::map<Time, Ping> pings_;
  std::size_t held_ = 0;  // soundings of pings_
  std::optional<Time> given_;
  std::uint32_t number_ = 0;
  Counters counters_;
};

}  // namespace seastitch
