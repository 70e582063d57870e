#include "bench/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "bench/random.hpp"
#include "common/core/pose.hpp"

namespace seastitch::bench {
namespace {

constexpr double kKnotS = 2.0;
constexpr double kAtSurfaceM = 0.3;   // depth of the reference point
constexpr double kSmoothingS = 10.0;  // the vehicle follows slopes, not ripples

// Gaussian smoothing, exp(-x^2 / 2), over +-2 smoothing times.
std::vector<double> Smooth(const std::vector<double>& values) {
  const int reach = static_cast<int>(2.0 * kSmoothingS / kKnotS);
  const int n = static_cast<int>(values.size());
  std::vector<double> smooth(values.size());
  for (int i = 0; i < n; ++i) {
    double sum = 0.0;
    double weights = 0.0;
    for (int k = -reach; k <= reach; ++k) {
      const double x = k * kKnotS / kSmoothingS;
      const double w = std::exp(-0.5 * x * x);
      sum += w * values[static_cast<std::size_t>(std::clamp(i + k, 0, n - 1))];
      weights += w;
    }
    smooth[static_cast<std::size_t>(i)] = sum / weights;
  }
  return smooth;
}

}  // namespace

Trajectory::Trajectory(const Path& path,
                       const PlanParams& plan,
                       const MotionParams& motion,
                       const Terrain& terrain,
                       std::uint64_t seed)
    : path_(path),
      roll_(MakeSines(Deg2Rad(motion.roll_rms_deg), motion.period_s, seed, "roll")),
      pitch_(MakeSines(Deg2Rad(motion.pitch_rms_deg), motion.period_s, seed, "pitch")),
      heading_(MakeSines(Deg2Rad(motion.heading_rms_deg), motion.period_s, seed, "heading")),
      heave_(MakeSines(motion.heave_rms_m, motion.period_s, seed, "heave")) {
  PlanDepth(plan, terrain);
}

Trajectory::Sines Trajectory::MakeSines(double rms,
                                        double period_s,
                                        std::uint64_t seed,
                                        const char* name) {
  constexpr int kSines = 5;
  if (rms <= 0.0) return {};
  Random random(seed, name);
  Sines sines;
  for (int i = 0; i < kSines; ++i) {
    // Periods from 2 to 1/2 times period_s, spread evenly in octaves; none is a multiple of
    // another.
    const double octave = -1.0 + 2.0 * (i + random.Uniform()) / kSines;
    sines.push_back({rms * std::sqrt(2.0 / kSines),
                     2.0 * kPi / period_s * std::exp2(octave),
                     2.0 * kPi * random.Uniform()});
  }
  return sines;
}

Trajectory::Motion Trajectory::Sum(const Sines& sines, double t_s) {
  Motion m;
  for (const Sine& s : sines) {
    const double sine = s.amplitude * std::sin(s.frequency_radps * t_s + s.phase_rad);
    const double cosine = s.amplitude * std::cos(s.frequency_radps * t_s + s.phase_rad);
    m.value += sine;
    m.rate += s.frequency_radps * cosine;
    m.accel -= s.frequency_radps * s.frequency_radps * sine;
  }
  return m;
}

void Trajectory::PlanDepth(const PlanParams& plan, const Terrain& terrain) {
  const auto knots = static_cast<std::size_t>(std::ceil(duration_s() / kKnotS)) + 4;
  depth_knots_m_.assign(knots, plan.depth_m);
  if (plan.altitude_m > 0.0) {
    std::vector<double> seabed(knots, plan.depth_m + plan.altitude_m);
    bool known = false;
    for (std::size_t i = 0; i < knots; ++i) {
      const Eigen::Vector2d p = path_.At((static_cast<double>(i) - 1.0) * kKnotS).p;
      const auto depth = terrain.DepthAt(p.x(), p.y());
      if (depth && !known) std::fill(seabed.begin(), seabed.end(), *depth);
      if (depth) seabed[i] = *depth;
      if (!depth && i > 0) seabed[i] = seabed[i - 1];
      known = known || depth.has_value();
    }
    depth_knots_m_ = Smooth(seabed);
    for (double& depth : depth_knots_m_) depth -= plan.altitude_m;
  }
  for (std::size_t i = 0; i < knots; ++i) {
    const double survey_m = std::max(depth_knots_m_[i], plan.min_depth_m);
    const double share = path_.DepthShareAt((static_cast<double>(i) - 1.0) * kKnotS);
    depth_knots_m_[i] = kAtSurfaceM + share * (survey_m - kAtSurfaceM);
  }
}

// B-spline of the depth; knot i is at the time (i - 1) kKnotS.
Trajectory::Motion Trajectory::CruiseDepthAt(double t_s) const {
  const double at = std::clamp(t_s, 0.0, duration_s()) / kKnotS;
  const auto i = std::min(static_cast<std::size_t>(at), depth_knots_m_.size() - 4);
  const double u = at - static_cast<double>(i);
  const double* k = &depth_knots_m_[i];
  const double v = 1.0 - u;
  Motion m;
  m.value = (v * v * v * k[0] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * k[1] +
             (3.0 * v * v * v - 6.0 * v * v + 4.0) * k[2] + u * u * u * k[3]) /
            6.0;
  m.rate = (-v * v * k[0] + (3.0 * u * u - 4.0 * u) * k[1] + (4.0 * v - 3.0 * v * v) * k[2] +
            u * u * k[3]) /
           (2.0 * kKnotS);
  m.accel =
      (v * k[0] + (3.0 * u - 2.0) * k[1] + (1.0 - 3.0 * u) * k[2] + u * k[3]) / (kKnotS * kKnotS);
  return m;
}

Trajectory::Attitude Trajectory::AttitudeAt(double t_s) const {
  const Path::State course = path_.At(t_s);
  const Motion cruise = CruiseDepthAt(t_s);
  Attitude a{Sum(roll_, t_s), Sum(pitch_, t_s), Sum(heading_, t_s)};
  a.yaw.value += course.course_rad;
  a.yaw.rate += course.course_rate_radps;
  a.yaw.accel += course.course_accel_radps2;
  // The vehicle pitches down to dive.
  a.pitch.value -= cruise.rate / path_.speed_mps();
  a.pitch.rate -= cruise.accel / path_.speed_mps();
  return a;
}

Eigen::Isometry3d Trajectory::PoseAt(double t_s) const {
  const Eigen::Vector2d p = path_.At(t_s).p;
  const Attitude a = AttitudeAt(t_s);
  return MakePose({p.x(), p.y(), CruiseDepthAt(t_s).value + Sum(heave_, t_s).value},
                  RotationFromRpy(a.roll.value, a.pitch.value, a.yaw.value));
}

Eigen::Vector3d Trajectory::RateAt(double t_s) const {
  const Attitude a = AttitudeAt(t_s);
  const double sr = std::sin(a.roll.value);
  const double cr = std::cos(a.roll.value);
  const double sp = std::sin(a.pitch.value);
  const double cp = std::cos(a.pitch.value);
  return {a.roll.rate - a.yaw.rate * sp,
          a.pitch.rate * cr + a.yaw.rate * sr * cp,
          -a.pitch.rate * sr + a.yaw.rate * cr * cp};
}

TrueState Trajectory::StateAt(double t_s) const {
  const Path::State course = path_.At(t_s);
  const Motion cruise = CruiseDepthAt(t_s);
  const Motion heave = Sum(heave_, t_s);
  const double v = path_.speed_mps();
  const double c = std::cos(course.course_rad);
  const double s = std::sin(course.course_rad);

  TrueState state;
  state.T_map_vehicle = PoseAt(t_s);
  state.v_map_mps = {v * c, v * s, cruise.rate + heave.rate};
  state.a_map_mps2 = {-v * course.course_rate_radps * s,
                      v * course.course_rate_radps * c,
                      cruise.accel + heave.accel};
  state.rate_vehicle_radps = RateAt(t_s);
  // Numerical derivative. Only the lever arm of the inertial unit uses it: a rounding error of 1e-7
  // rad/s2 gives 1e-8 g there.
  constexpr double kH = 1e-4;
  state.accel_vehicle_radps2 = (RateAt(t_s + kH) - RateAt(t_s - kH)) / (2.0 * kH);
  return state;
}

}  // namespace seastitch::bench
