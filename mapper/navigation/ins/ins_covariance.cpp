#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"

// How well an INS's track is known.
namespace seastitch {
namespace {

// Number of pieces of the track in the sum for a relative covariance.
constexpr int kPieces = 24;

Eigen::Vector2d Turn90(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

}  // namespace

double InsNavigation::HeadingError::Covariance(Time s, Time t) const {
  return constant2 + wander2 * std::exp(-std::abs(ToSeconds(t - s)) / tau_s);
}

// A sigma stated by the sample is divided between the parts in the same ratio as the configured
// one.
InsNavigation::HeadingError InsNavigation::HeadingErrorAt(double own_sigma_rad) const {
  const GaussMarkov<double>& wander = params_.heading_wander_rad;
  const double sheet2 = params_.heading_rad * params_.heading_rad + wander.sigma * wander.sigma;
  const bool given = own_sigma_rad > 0.0 && sheet2 > 0.0;
  const double scale2 = given ? own_sigma_rad * own_sigma_rad / sheet2 : 1.0;
  return {scale2 * params_.heading_rad * params_.heading_rad,
          scale2 * wander.sigma * wander.sigma,
          wander.tau_s};
}

// Relative covariance. With h the heading error, p the position and J a rotation by 90 degrees, the
// error of b relative to a is, in map axes,
//   position, by dead reckoning: J sum (h(t_i) - h(a)) dp_i
//   position, with fixes:        -J h(a) (p_b - p_a)
//   heading: h(b) - h(a)
// plus the errors of scale and random walk.
std::optional<Eigen::Matrix3d> InsNavigation::RelativeCovariance(Time a, Time b) const {
  const auto at_a = PlaceAt(a);
  const auto at_b = PlaceAt(b);
  const auto attitude_a = AttitudeAt(a);
  if (!at_a || !at_b || !attitude_a || !AttitudeAt(b)) return std::nullopt;
  const HeadingError h = HeadingErrorAt(attitude_a->heading_sigma_rad);
  const Eigen::Vector2d d = at_b->p_map - at_a->p_map;

  // Columns: derivative of (x, y, yaw) by the heading error at each of `times`.
  std::vector<Time> times{a, b};
  Eigen::Matrix3Xd effect = Eigen::Matrix3Xd::Zero(3, kPieces + 2);
  effect.col(0) << -Turn90(d), -1.0;
  effect(2, 1) = 1.0;
  if (!params_.uses_position_fixes) {
    Eigen::Vector2d from = at_a->p_map;
    for (int i = 0; i < kPieces; ++i) {
      const auto part = [&](double w) { return a + FromSeconds(w / kPieces * ToSeconds(b - a)); };
      const auto to = i + 1 == kPieces ? at_b : PlaceAt(part(i + 1.0));
      // in a gap all of the distance is counted at its end
      const Eigen::Vector2d p = to ? to->p_map : from;
      times.push_back(part(i + 0.5));
      effect.col(i + 2) << Turn90(p - from), 0.0;
      from = p;
    }
  }
  const auto n = static_cast<Eigen::Index>(times.size());
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index r = 0; r < n; ++r)
    for (Eigen::Index c = 0; c < n; ++c)
      covariance(r, c) =
          h.Covariance(times[static_cast<std::size_t>(r)], times[static_cast<std::size_t>(c)]);
  Eigen::Matrix3d of_b = effect.leftCols(n) * covariance * effect.leftCols(n).transpose();

  const double walk = params_.random_walk_m_per_rtm;
  const double travelled_m = std::abs(at_b->travelled_m - at_a->travelled_m);
  const double variance_m2 =
      walk * walk * travelled_m + std::abs(at_b->jump_variance_m2 - at_a->jump_variance_m2);
  of_b.topLeftCorner<2, 2>() += variance_m2 * Eigen::Matrix2d::Identity() +
                                params_.distance_ratio * params_.distance_ratio * d * d.transpose();
  const double yaw = RpyFromRotation(attitude_a->q_map_vehicle.toRotationMatrix()).z();
  Eigen::Matrix3d level_from_map = Eigen::Matrix3d::Identity();
  level_from_map.topLeftCorner<2, 2>() = Pose2{0.0, 0.0, yaw}.Rotation().transpose();
  return level_from_map * of_b * level_from_map.transpose();
}

}  // namespace seastitch
