#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "bench/terrain.hpp"

namespace seastitch::bench {

// A lawn-mower survey. The first line's lead-in begins at the map origin; the other lines follow to
// starboard. A vehicle that dives from the surface comes straight to the first line, and continues
// straight after the last line.
struct PlanParams {
  int lines = 6;
  double line_length_m = 160.0;
  double spacing_m = 25.0;
  double heading_deg = 0.0;    // of the first line
  double turn_radius_m = 8.0;  // lines closer than 2.6 radii are joined by loops
  int crosslines = 1;          // at right angles, evenly spaced along the lines
  double lead_in_m = 10.0;     // straight before and after every line
  double speed_mps = 1.5;      // over ground
  double altitude_m = 11.0;    // above the smoothed seabed; 0: at constant depth_m
  double depth_m = 10.0;
  double min_depth_m = 2.0;  // never shallower
  // time at the surface before the descent and after the ascent; 0: neither
  double surface_s = 0.0;
  double dive_s = 40.0;  // duration of descent and ascent, if surface_s is above 0

  double DiveS() const { return surface_s > 0.0 ? surface_s + dive_s : 0.0; }
};

// The plan as a track over ground: straight legs and turns. The turn rate rises from zero and falls
// back smoothly, so that neither it nor its derivative has a step.
class Path {
 public:
  explicit Path(const PlanParams& params);

  struct State {
    Eigen::Vector2d p{0.0, 0.0};  // map: north, east [m]
    double course_rad = 0.0;
    double course_rate_radps = 0.0;
    double course_accel_radps2 = 0.0;
  };
  // Before the start and after the end: the state there.
  State At(double t_s) const;
  // Depth of the vehicle as a fraction of its survey depth: 0 at the surface, 1 on the survey.
  double DepthShareAt(double t_s) const;
  bool IsAtSurface(double t_s) const;
  // True from the end of the descent to the start of the ascent.
  bool IsOnSurvey(double t_s) const;
  const PlanParams& plan() const { return params_; }
  double duration_s() const { return duration_s_; }
  double speed_mps() const { return params_.speed_mps; }
  // Bounding box of the track, widened by margin_m.
  MapBox Box(double margin_m) const;

 private:
  struct Leg {
    double start_s;
    double duration_s;
    double course_rad;
    double turn_rad;  // 0: straight
  };
  struct Node {
    Eigen::Vector2d p;
    Eigen::Vector2d v;
    Eigen::Vector2d a;
  };
  void AddStraight(double length_m);
  void AddTurn(double turn_rad);
  // The shortest way of turn, straight and turn to another position and course.
  void ConnectTo(const Eigen::Vector2d& p, double course_rad);
  void AddLines();
  void AddCrosslines();
  void Tabulate();
  State CourseAt(double t_s) const;

  PlanParams params_;
  std::vector<Leg> legs_;
  std::vector<Node> nodes_;
  double duration_s_ = 0.0;
  Eigen::Vector2d start_{0.0, 0.0};
  Eigen::Vector2d end_{0.0, 0.0};  // end of the legs added so far
  double end_course_rad_ = 0.0;
};

}  // namespace seastitch::bench
