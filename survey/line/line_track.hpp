#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/geo/map_frame.hpp"

namespace seastitch {

// Part of a track.
struct TrackPart {
  Time begin;
  Time end;
};

// Track of a vehicle in the plane of a map, from its navigation records. Between two positions at
// most kMaxGapS apart it is interpolated linearly. Memory: about 100 bytes per 0.1 s.
class LineTrack {
 public:
  static constexpr double kMaxGapS = 2.0;

  struct State {
    Eigen::Vector2d p_north_east_m;
    double heading_rad;  // as stated, else the course
    double depth_m;      // 0 where none is stated
  };

  // origin: of the map.
  explicit LineTrack(const GeoPosition& origin);

  // Records in any order; Finish() sorts them. Those nearer than 0.1 s to the last are left out.
  void AddPosition(Time t, const GeoPosition& position);
  void AddHeading(Time t, double heading_rad);
  void AddDepth(Time t, double depth_m);
  void Finish();

  bool empty() const { return positions_.empty(); }
  bool has_headings() const { return !headings_.empty(); }
  // Median time between two headings; 0: there are none.
  double heading_interval_s() const;
  TrackPart whole() const { return {positions_.front().time, positions_.back().time}; }
  Eigen::Vector2d ToMap(const GeoPoint& point) const;

  // Nothing: no positions around that time.
  std::optional<State> At(Time t) const;
  // Time of the place nearest to a point. Nothing: the point lies beyond an end of the part, or
  // abreast of a gap. stride: every so many positions is tried, and those around the best of them;
  // 1: each.
  std::optional<Time> TimeNearest(const Eigen::Vector2d& p_north_east_m,
                                  const TrackPart& part,
                                  std::ptrdiff_t stride = 1) const;

 private:
  struct Position {
    Time time;
    Eigen::Vector2d p_m;
  };
  struct Number {
    Time time;
    double value;
  };
  using Positions = std::vector<Position>;

  std::optional<Eigen::Vector2d> PositionAt(Time t) const;
  double CourseAt(Time t) const;

  MapFrame map_;
  Positions positions_;
  std::vector<Number> headings_;
  std::vector<Number> depths_;
};

}  // namespace seastitch
