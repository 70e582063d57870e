#include "bench/path.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/core/pose.hpp"

namespace seastitch::bench {
namespace {

constexpr double kNodeS = 0.1;

// Fraction of a turn's duration in which the turn rate rises, and in which it falls.
constexpr double kRamp = 0.25;
constexpr double kPeak = 1.0 / (1.0 - kRamp);  // peak turn rate divided by its mean

// Fraction of a turn completed after fraction u of its duration, and its two derivatives by u.
struct TurnShare {
  double done = 0.0;
  double rate = 0.0;
  double accel = 0.0;
};

TurnShare TurnShareAt(double u) {
  if (u > 0.5) {
    const TurnShare mirror = TurnShareAt(1.0 - u);
    return {1.0 - mirror.done, mirror.rate, -mirror.accel};
  }
  if (u >= kRamp) return {kPeak * (u - 0.5 * kRamp), kPeak, 0.0};
  const double phase = kPi * u / kRamp;
  return {0.5 * kPeak * (u - kRamp / kPi * std::sin(phase)),
          0.5 * kPeak * (1.0 - std::cos(phase)),
          0.5 * kPeak * kPi / kRamp * std::sin(phase)};
}

Eigen::Vector2d Along(double course_rad) { return {std::cos(course_rad), std::sin(course_rad)}; }

// Length of a turn whose radius at the peak of the turn rate is radius_m.
double TurnLength(double turn_rad, double radius_m) {
  return kPeak * std::abs(turn_rad) * radius_m;
}

// Displacement over a turn that begins on course 0.
Eigen::Vector2d TurnDisplacement(double turn_rad, double radius_m) {
  constexpr int kSteps = 256;  // steps of Simpson's rule: error 0.01 mm
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 0; i <= kSteps; ++i) {
    const double weight = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * Along(turn_rad * TurnShareAt(static_cast<double>(i) / kSteps).done);
  }
  return sum * (TurnLength(turn_rad, radius_m) / (3.0 * kSteps));
}

// Turn angle in (-2 pi, 2 pi), with the sign of `sense`.
double TurnAngle(double from_rad, double to_rad, double sense) {
  const double turn = std::fmod(to_rad - from_rad, 2.0 * kPi);
  if (turn * sense < 0.0) return turn + sense * 2.0 * kPi;
  return turn;
}

struct Connection {
  double turn1_rad = 0.0;
  double length_m = 0.0;
  double turn2_rad = 0.0;
  double off_m = 0.0;  // distance by which the connection misses the goal sideways
};

struct ConnectionProblem {
  Eigen::Vector2d way;
  double from_rad;
  double to_rad;
  double radius_m;

  Connection Try(double straight_rad, double sense1, double sense2) const {
    Connection c;
    c.turn1_rad = TurnAngle(from_rad, straight_rad, sense1);
    c.turn2_rad = TurnAngle(straight_rad, to_rad, sense2);
    const Eigen::Vector2d turns =
        Eigen::Rotation2Dd(from_rad) * TurnDisplacement(c.turn1_rad, radius_m) +
        Eigen::Rotation2Dd(straight_rad) * TurnDisplacement(c.turn2_rad, radius_m);
    const Eigen::Vector2d left = way - turns;
    const Eigen::Vector2d along = Along(straight_rad);
    c.length_m = along.dot(left);
    c.off_m = along.x() * left.y() - along.y() * left.x();
    return c;
  }
  double Total(const Connection& c) const {
    return TurnLength(c.turn1_rad, radius_m) + c.length_m + TurnLength(c.turn2_rad, radius_m);
  }
};

// False if a turn jumps between 0 and a full circle from a to b; otherwise the turns are
// continuous.
bool SameBranch(const Connection& a, const Connection& b) {
  return std::abs(a.turn1_rad - b.turn1_rad) < kPi && std::abs(a.turn2_rad - b.turn2_rad) < kPi;
}

Connection Bisect(
    const ConnectionProblem& problem, double lo_rad, double hi_rad, double sense1, double sense2) {
  Connection lo = problem.Try(lo_rad, sense1, sense2);
  Connection middle = lo;
  for (int i = 0; i < 60; ++i) {
    const double mid_rad = 0.5 * (lo_rad + hi_rad);
    middle = problem.Try(mid_rad, sense1, sense2);
    if ((middle.off_m > 0.0) == (lo.off_m > 0.0)) {
      lo_rad = mid_rad;
      lo = middle;
    } else {
      hi_rad = mid_rad;
    }
  }
  return middle;
}

Connection Shortest(const ConnectionProblem& problem) {
  constexpr int kCourses = 120;
  // The offset avoids round angles, at which turns vanish.
  const double first_rad = problem.from_rad + Deg2Rad(0.37);
  const double step_rad = 2.0 * kPi / kCourses;
  Connection best;
  double best_total = std::numeric_limits<double>::infinity();
  for (const double sense1 : {-1.0, 1.0}) {
    for (const double sense2 : {-1.0, 1.0}) {
      Connection last = problem.Try(first_rad, sense1, sense2);
      for (int i = 1; i <= kCourses; ++i) {
        const double course = first_rad + i * step_rad;
        const Connection next = problem.Try(course, sense1, sense2);
        const bool crosses = SameBranch(last, next) && (last.off_m > 0.0) != (next.off_m > 0.0);
        last = next;
        if (!crosses) continue;
        const Connection c = Bisect(problem, course - step_rad, course, sense1, sense2);
        if (c.length_m < 0.0 || problem.Total(c) >= best_total) continue;
        best = c;
        best_total = problem.Total(c);
      }
    }
  }
  if (!std::isfinite(best_total)) throw std::logic_error("no way between two lines of the plan");
  return best;
}

}  // namespace

Path::Path(const PlanParams& params) : params_(params) {
  end_course_rad_ = Deg2Rad(params.heading_deg);
  const double dive_m = params.DiveS() * params.speed_mps;
  start_ = end_ = -dive_m * Along(end_course_rad_);
  if (dive_m > 0.0) AddStraight(dive_m);
  AddLines();
  AddCrosslines();
  if (dive_m > 0.0) AddStraight(dive_m);
  Tabulate();
}

double Path::DepthShareAt(double t_s) const {
  if (params_.surface_s == 0.0) return 1.0;
  const double from_end_s = std::min(t_s, duration_s_ - t_s);
  const double u = std::clamp((from_end_s - params_.surface_s) / params_.dive_s, 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
}

bool Path::IsAtSurface(double t_s) const {
  return t_s <= params_.surface_s || t_s >= duration_s_ - params_.surface_s;
}

bool Path::IsOnSurvey(double t_s) const {
  return t_s >= params_.DiveS() && t_s <= duration_s_ - params_.DiveS();
}

void Path::AddLines() {
  const double course = Deg2Rad(params_.heading_deg);
  const double length = params_.line_length_m + 2.0 * params_.lead_in_m;
  for (int line = 0; line < params_.lines; ++line) {
    const bool back = line % 2 == 1;
    const Eigen::Vector2d start =
        Eigen::Rotation2Dd(course) * Eigen::Vector2d(back ? length : 0.0, line * params_.spacing_m);
    if (line > 0) ConnectTo(start, back ? course + kPi : course);
    AddStraight(length);
  }
}

void Path::AddCrosslines() {
  const double course = Deg2Rad(params_.heading_deg);
  const double width = (params_.lines - 1) * params_.spacing_m;
  const double over = params_.lead_in_m + 0.5 * params_.spacing_m;
  for (int i = 0; i < params_.crosslines; ++i) {
    // The first crossline begins at the last line.
    const bool back = i % 2 == 0;
    const double along =
        params_.lead_in_m + params_.line_length_m * (i + 1.0) / (params_.crosslines + 1.0);
    const Eigen::Vector2d start =
        Eigen::Rotation2Dd(course) * Eigen::Vector2d(along, back ? width + over : -over);
    ConnectTo(start, course + (back ? -0.5 : 0.5) * kPi);
    AddStraight(width + 2.0 * over);
  }
}

void Path::AddStraight(double length_m) {
  legs_.push_back({duration_s_, length_m / params_.speed_mps, end_course_rad_, 0.0});
  duration_s_ += legs_.back().duration_s;
  end_ += length_m * Along(end_course_rad_);
}

void Path::AddTurn(double turn_rad) {
  const double length_m = TurnLength(turn_rad, params_.turn_radius_m);
  if (length_m < 1e-6) return;
  legs_.push_back({duration_s_, length_m / params_.speed_mps, end_course_rad_, turn_rad});
  duration_s_ += legs_.back().duration_s;
  end_ += Eigen::Rotation2Dd(end_course_rad_) * TurnDisplacement(turn_rad, params_.turn_radius_m);
  end_course_rad_ += turn_rad;
}

void Path::ConnectTo(const Eigen::Vector2d& p, double course_rad) {
  const Connection c = Shortest({p - end_, end_course_rad_, course_rad, params_.turn_radius_m});
  AddTurn(c.turn1_rad);
  AddStraight(c.length_m);
  AddTurn(c.turn2_rad);
}

Path::State Path::CourseAt(double t_s) const {
  const auto after = std::upper_bound(
      legs_.begin(), legs_.end(), t_s, [](double t, const Leg& leg) { return t < leg.start_s; });
  const Leg& leg = after == legs_.begin() ? *after : *std::prev(after);
  const double u = std::clamp((t_s - leg.start_s) / leg.duration_s, 0.0, 1.0);
  const TurnShare share = TurnShareAt(u);
  State state;
  state.course_rad = leg.course_rad + leg.turn_rad * share.done;
  state.course_rate_radps = leg.turn_rad * share.rate / leg.duration_s;
  state.course_accel_radps2 = leg.turn_rad * share.accel / (leg.duration_s * leg.duration_s);
  return state;
}

// Positions by Gauss-Legendre quadrature from node to node. Between nodes a quintic that agrees
// with position, velocity and acceleration at both ends: error below 1e-8 m.
void Path::Tabulate() {
  const double v = params_.speed_mps;
  const auto intervals = static_cast<std::size_t>(std::ceil(duration_s_ / kNodeS));
  nodes_.reserve(intervals + 1);
  Eigen::Vector2d p = start_;
  for (std::size_t i = 0; i <= intervals; ++i) {
    const double t = kNodeS * static_cast<double>(i);
    const State s = CourseAt(t);
    const Eigen::Vector2d along = Along(s.course_rad);
    nodes_.push_back(
        {p, v * along, v * s.course_rate_radps * Eigen::Vector2d(-along.y(), along.x())});
    const double half = 0.5 * kNodeS;
    const double off = half * std::sqrt(0.6);
    p += v * half *
         (5.0 / 9.0 * Along(CourseAt(t + half - off).course_rad) +
          8.0 / 9.0 * Along(CourseAt(t + half).course_rad) +
          5.0 / 9.0 * Along(CourseAt(t + half + off).course_rad));
  }
}

Path::State Path::At(double t_s) const {
  const double t = std::clamp(t_s, 0.0, duration_s_);
  State state = CourseAt(t);
  const auto i = std::min(static_cast<std::size_t>(t / kNodeS), nodes_.size() - 2);
  const Node& a = nodes_[i];
  const Node& b = nodes_[i + 1];
  const double h = kNodeS;
  const double u = t / h - static_cast<double>(i);
  const Eigen::Vector2d dp = b.p - a.p - h * a.v - 0.5 * h * h * a.a;
  const Eigen::Vector2d dv = h * (b.v - a.v - h * a.a);
  const Eigen::Vector2d da = h * h * (b.a - a.a);
  const Eigen::Vector2d c3 = 10.0 * dp - 4.0 * dv + 0.5 * da;
  const Eigen::Vector2d c4 = -15.0 * dp + 7.0 * dv - da;
  const Eigen::Vector2d c5 = 6.0 * dp - 3.0 * dv + 0.5 * da;
  state.p = a.p + u * (h * a.v + u * (0.5 * h * h * a.a + u * (c3 + u * (c4 + u * c5))));
  return state;
}

MapBox Path::Box(double margin_m) const {
  MapBox box{nodes_.front().p, nodes_.front().p};
  for (const Node& node : nodes_) {
    box.min = box.min.cwiseMin(node.p);
    box.max = box.max.cwiseMax(node.p);
  }
  box.min.array() -= margin_m;
  box.max.array() += margin_m;
  return box;
}

}  // namespace seastitch::bench
