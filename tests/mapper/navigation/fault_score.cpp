#include "tests/mapper/navigation/fault_score.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"

namespace seastitch::test {
namespace {

constexpr double kSteadyS = 10.0;
constexpr double kPairS = 30.0;

class ErrorSum {
 public:
  void Add(double error_m) {
    sum2_ += error_m * error_m;
    ++count_;
    largest_m_ = std::max(largest_m_, error_m);
  }
  TrackScore Score() const {
    return {count_ > 0 ? std::sqrt(sum2_ / count_) : std::nan(""),
            count_ > 0 ? largest_m_ : std::nan("")};
  }

 private:
  double sum2_ = 0.0;
  double largest_m_ = 0.0;
  int count_ = 0;
};

// Velocity, tilt and heading within 3 stated sigma.
bool IsWithinThreeSigma(const DeadReckoning& navigation, const TruthSample& truth) {
  const auto state = navigation.StateAt(truth.time);
  const auto v_covariance = navigation.VelocityCovariance(truth.time);
  if (!state || !v_covariance) return false;
  Eigen::Vector3d rpy = RpyFromRotation(state->T_map_vehicle.linear()) -
                        RpyFromRotation(truth.T_map_vehicle.linear());
  for (double& angle : rpy) angle = WrapAngle(angle);
  const Eigen::Vector2d v = (state->v_map_mps - truth.v_map_mps).head<2>();
  // The truth of a real dive is itself only so good.
  constexpr double kTruthSigmaMps = 0.03;
  constexpr double kTruthSigmaRad = Deg2Rad(0.2);
  for (int i = 0; i < 3; ++i) {
    const double sigma2 = state->covariance(3 + i, 3 + i) + kTruthSigmaRad * kTruthSigmaRad;
    if (!(rpy(i) * rpy(i) <= 9.0 * sigma2)) return false;
  }
  for (int i = 0; i < 2; ++i)
    if (!(v(i) * v(i) <= 9.0 * ((*v_covariance)(i, i) + kTruthSigmaMps * kTruthSigmaMps)))
      return false;
  return true;
}

std::optional<double> RecoveryS(const Dive& dive,
                                const DeadReckoning& navigation,
                                double fault_end_s) {
  std::optional<double> since;
  for (const TruthSample& truth : dive.truth) {
    const double t = ToSeconds(truth.time - dive.imu[0].time) - fault_end_s;
    if (t < 0.0) continue;
    if (!IsWithinThreeSigma(navigation, truth)) {
      since.reset();
      continue;
    }
    if (!since) since = t;
    if (t - *since >= kSteadyS) return since;
  }
  return std::nullopt;
}

double MeanRelativeNees(const Dive& dive, const DeadReckoning& navigation) {
  double sum = 0.0;
  int count = 0;
  const auto apart = static_cast<std::size_t>(kPairS);
  for (std::size_t i = 0; i + apart < dive.truth.size(); i += 5) {
    const auto nees = RelativeNees(dive.truth[i], dive.truth[i + apart], navigation);
    if (!nees) continue;
    sum += *nees / 3.0;
    ++count;
  }
  return count > 0 ? sum / count : std::nan("");
}

double LargestSpeed(const Dive& dive, const DeadReckoning& navigation) {
  double largest = 0.0;
  for (const ImuSample& imu : dive.imu)
    if (const auto state = navigation.StateAt(imu.time))
      largest = std::max(largest, state->v_map_mps.norm());
  return largest;
}

// Body velocity by the DVL at t: even between two ensembles, held over gaps.
Eigen::Vector3d DvlVelocityAt(const std::vector<DvlSample>& valid, Time t) {
  constexpr double kGapS = 2.5;
  const auto after =
      std::upper_bound(valid.begin(), valid.end(), t, [](Time time, const DvlSample& dvl) {
        return time < dvl.time;
      });
  if (after == valid.begin()) return valid.front().v_dvl_mps;
  const DvlSample& a = *std::prev(after);
  if (after == valid.end() || ToSeconds(after->time - a.time) > kGapS) return a.v_dvl_mps;
  const double w = ToSeconds(t - a.time) / ToSeconds(after->time - a.time);
  return (1.0 - w) * a.v_dvl_mps + w * after->v_dvl_mps;
}

}  // namespace

void FeedDive(const Dive& dive, DeadReckoning* navigation) {
  std::size_t dvl = 0;
  std::size_t depth = 0;
  std::size_t fix = 0;
  for (const ImuSample& imu : dive.imu) {
    navigation->Add(imu);
    for (; depth < dive.depth.size() && dive.depth[depth].time <= imu.time; ++depth)
      navigation->Add(dive.depth[depth]);
    for (; dvl < dive.dvl.size() && dive.dvl[dvl].time <= imu.time; ++dvl)
      navigation->Add(dive.dvl[dvl]);
    for (; fix < dive.fixes.size() && dive.fixes[fix].time <= imu.time; ++fix)
      navigation->Add(dive.fixes[fix]);
  }
  navigation->Finish();
}

std::optional<double> RelativeNees(const TruthSample& from,
                                   const TruthSample& to,
                                   const DeadReckoning& navigation) {
  const auto state_from = navigation.StateAt(from.time);
  const auto state_to = navigation.StateAt(to.time);
  const auto covariance = navigation.RelativeCovariance(from.time, to.time);
  if (!state_from || !state_to || !covariance) return std::nullopt;
  const auto between = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return Inverse(LevelPose(a)) * LevelPose(b);
  };
  const Pose2 estimate = between(state_from->T_map_vehicle, state_to->T_map_vehicle);
  const Pose2 truth = between(from.T_map_vehicle, to.T_map_vehicle);
  Eigen::Vector3d error = estimate.Vector() - truth.Vector();
  error.z() = WrapAngle(error.z());
  return error.dot(covariance->llt().solve(error));
}

FilterScore ScoreFilter(const Dive& dive, double fault_end_s) {
  Dive placed = dive;
  placed.params.pose_window_s = placed.params.window_s = 3600.0;
  DeadReckoning navigation(placed.params, dive.vehicle);
  FeedDive(dive, &navigation);
  FilterScore score;
  score.counters = navigation.counters();
  score.offsets = navigation.suspected_offsets();
  std::optional<Eigen::Vector2d> first;
  ErrorSum errors;
  double nees_sum = 0.0;
  int states = 0;
  for (const TruthSample& truth : dive.truth) {
    const auto state = navigation.StateAt(truth.time);
    if (!state) continue;
    Eigen::Vector2d error =
        (state->T_map_vehicle.translation() - truth.T_map_vehicle.translation()).head<2>();
    if (!first) first = error;
    error -= *first;
    errors.Add(error.norm());
    const Eigen::Matrix2d covariance = state->covariance.topLeftCorner<2, 2>();
    const double nees = error.dot(covariance.llt().solve(error)) / 2.0;
    nees_sum += nees;
    ++states;
    score.worst_nees = std::max(score.worst_nees, nees);
    score.sigma_m = std::sqrt(covariance.trace());
  }
  static_cast<TrackScore&>(score) = errors.Score();
  score.nees = states > 0 ? nees_sum / states : std::nan("");
  score.relative_nees = MeanRelativeNees(dive, navigation);
  score.largest_speed_mps = LargestSpeed(dive, navigation);
  if (fault_end_s >= 0.0) score.recovery_s = RecoveryS(dive, navigation, fault_end_s);
  return score;
}

TrackScore ScoreBaseline(const Dive& dive) {
  std::vector<DvlSample> valid;
  std::copy_if(
      dive.dvl.begin(), dive.dvl.end(), std::back_inserter(valid), [](const DvlSample& dvl) {
        return dvl.bottom_lock;
      });
  const Eigen::Isometry3d T_imu_dvl =
      dive.vehicle.T_vehicle_imu.inverse() * dive.vehicle.T_vehicle_dvl;
  const Eigen::Isometry3d T_dvl_vehicle = dive.vehicle.T_vehicle_dvl.inverse();
  ErrorSum errors;
  std::optional<Eigen::Vector2d> first;
  std::size_t next = 0;
  Eigen::Vector3d p_map_dvl = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_map_imu = dive.imu[0].attitude->q_ned_imu;
  for (std::size_t i = 1; i < dive.imu.size() && next < dive.truth.size(); ++i) {
    if (dive.imu[i].attitude) q_map_imu = dive.imu[i].attitude->q_ned_imu;
    const Eigen::Matrix3d R_map_dvl = q_map_imu.toRotationMatrix() * T_imu_dvl.linear();
    p_map_dvl += ToSeconds(dive.imu[i].time - dive.imu[i - 1].time) *
                 (R_map_dvl * DvlVelocityAt(valid, dive.imu[i].time));
    for (; next < dive.truth.size() && dive.truth[next].time <= dive.imu[i].time; ++next) {
      const Eigen::Vector3d p_map_vehicle = p_map_dvl + R_map_dvl * T_dvl_vehicle.translation();
      Eigen::Vector2d error =
          (p_map_vehicle - dive.truth[next].T_map_vehicle.translation()).head<2>();
      if (!first) first = error;
      errors.Add((error - *first).norm());
    }
  }
  return errors.Score();
}

}  // namespace seastitch::test
