#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "bench/terrain.hpp"

namespace seastitch::bench {

// A lawn-mower survey. Its first line's lead-in begins at the origin of the map; the lines follow
// each other to starboard of the first. A vehicle that comes from the surface gets there straight
// on, and goes on straight after the last line.
struct PlanParams {
  int lines = 6;
  double line_length_m = 160.0;
  double spacing_m = 25.0;
  double heading_deg = 0.0;    // of the first line
  double turn_radius_m = 8.0;  // lines closer than 2.6 of it are joined by loops
  int crosslines = 1;          // at right angles, evenly along the lines
  double lead_in_m = 10.0;     // straight before and after every line
  double speed_mps = 1.5;      // over ground
  double altitude_m = 11.0;    // above the smoothed seabed; 0: at constant depth_m
  double depth_m = 10.0;
  double min_depth_m = 2.0;  // never shallower
  double surface_s = 0.0;    // at the surface before the way down, and after the way up; 0: neither
  double dive_s = 40.0;      // way down, and up, where there is one

  double DiveS() const { return surface_s > 0.0 ? surface_s + dive_s : 0.0; }
};

// The plan as a track over ground: straight legs, and turns whose rate swells from zero and fades
// again, so that neither it nor its derivative has a step.
class Path {
 public:
  explicit Path(const PlanParams& params);

  struct State {
    Eigen::Vector2d p{0.0, 0.0};  // map: north, east [m]
    double course_rad = 0.0;
    double course_rate_radps = 0.0;
    double course_accel_radps2 = 0.0;
  };
  // Before the start and after the end: at these.
  State At(double t_s) const;
  // How much of its depth the vehicle has at that time: 0 at the surface, 1 on the survey.
  double DepthShareAt(double t_s) const;
  bool IsAtSurface(double t_s) const;
  // From the end of the way down to the begin of the way up.
  bool IsOnSurvey(double t_s) const;
  const PlanParams& plan() const { return params_; }
  double duration_s() const { return duration_s_; }
  double speed_mps() const { return params_.speed_mps; }
  // What the track covers, widened by margin_m.
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
  // Turn, straight, turn: the shortest such way to another place and course.
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
  Eigen::Vector2d end_{0.0, 0.0};  // while the legs are laid
  double end_course_rad_ = 0.0;
};

}  // namespace seastitch::bench
