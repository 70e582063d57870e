#include "mapper/input/vertical_reference.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "common/core/median.hpp"

namespace seastitch {
namespace {

constexpr double kReachS = 3600.0;  // reach of a table's entry, and of a height
constexpr double kHoldS = 2.0;      // maximum age of depth and attitude for a height
constexpr double kPlaceHoldS = 60.0;
constexpr double kWindowS = 60.0;
constexpr double kStepS = 0.5;  // shortest time between heights that are used

}  // namespace

void VerticalReference::Add(const DepthSample& sample) {
  SetDepth(sample.time, sample.depth_m, vehicle_.p_vehicle_depth_m);
}

void VerticalReference::Add(const NavigationSample& sample) {
  if (sample.attitude) {
    const Eigen::Quaterniond q_vehicle_ins(vehicle_.T_vehicle_imu.linear());
    q_ned_vehicle_ = sample.attitude->q_ned_imu * q_vehicle_ins.conjugate();
    turned_at_ = sample.time;
  }
  if (sample.position) {
    position_ = sample.position;
    placed_at_ = sample.time;
  }
  if (sample.depth)
    SetDepth(sample.time, sample.depth->value_m, vehicle_.T_vehicle_imu.translation());
  if (sample.height) AddHeight(sample.time, sample.height->value_m);
}

void VerticalReference::SetDepth(Time t,
                                 double depth_m,
                                 const Eigen::Vector3d& p_vehicle_sensor_m) {
  newest_depth_ = t;
  if (!params_.by_heights) return;
  if (const auto below_m = Below(p_vehicle_sensor_m, t)) depth_ = Stamped{t, depth_m - *below_m};
}

void VerticalReference::AddHeight(Time t, double height_m) {
  if (!params_.by_heights || (!levels_.empty() && ToSeconds(t - levels_.back().time) < kStepS))
    return;
  const auto below_m = Below(vehicle_.T_vehicle_imu.translation(), t);
  const auto zero_m = ZeroAboveEllipsoid(t);
  if (!below_m || !zero_m || !depth_ || std::abs(ToSeconds(t - depth_->time)) > kHoldS) return;
  levels_.push_back({t, height_m + *below_m + depth_->value - *zero_m});
  while (ToSeconds(t - levels_.front().time) > kWindowS) levels_.pop_front();
  std::vector<double> values;
  for (const Stamped& level : levels_) values.push_back(level.value);
  level_ = Stamped{t, Median(std::move(values))};
}

std::optional<double> VerticalReference::Below(const Eigen::Vector3d& p_vehicle_m, Time t) const {
  if (p_vehicle_m.isZero()) return 0.0;
  if (!q_ned_vehicle_ || std::abs(ToSeconds(t - turned_at_)) > kHoldS) return std::nullopt;
  return (*q_ned_vehicle_ * p_vehicle_m).z();
}

std::optional<double> VerticalReference::ZeroAboveEllipsoid(Time t) const {
  if (params_.separation.empty()) return params_.separation_m;
  if (!position_ || std::abs(ToSeconds(t - placed_at_)) > kPlaceHoldS) return std::nullopt;
  return params_.separation.At(*position_);
}

std::optional<double> VerticalReference::LevelAt(Time t) const {
  if (!params_.by_heights) return params_.water_level.At(t);
  return level_ ? std::optional(level_->value) : std::nullopt;
}

bool VerticalReference::IsMissed() const {
  if (!newest_depth_) return false;
  if (params_.by_heights) return !level_ || ToSeconds(*newest_depth_ - level_->time) > kReachS;
  return !params_.water_level.empty() &&
         !params_.water_level.Covers(*newest_depth_, FromSeconds(kReachS));
}

}  // namespace seastitch
