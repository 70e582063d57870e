#include "mapper/navigation/aiding/attitude_aiding.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/strapdown.hpp"

namespace seastitch {
namespace {

// Factor of the gate for increments: their bias has not been forgotten in the model, so that they
// are held to more sigmas.
constexpr double kIncrementGate = 1.5;
constexpr double kQuietS = 5.0;
// Longest time between two samples of the device that are compared with the gyros [s].
constexpr double kMaxIncrementS = 2.5;
// Turn of the vehicle above which a device that repeats its attitude counts as frozen.
constexpr double kFrozenRad = Deg2Rad(1.0);
// Smallest step of the heading that is treated as a step; smaller ones are left to the gate.
constexpr double kMinStepRad = Deg2Rad(1.0);
// Largest remainder of a step that was taken back, relative to the step.
constexpr double kSteppedBack = 0.2;
// Time after the device reports that it is aligned, during which it may step [s].
constexpr double kAfterAlignmentS = 5.0;

using HeadingHypothesis = ErrorStateFilter::HeadingHypothesis;

}  // namespace

AttitudeAiding::AttitudeAiding(const NavigationParams& params,
                               const InertialHistory* history,
                               ErrorStateFilter* filter,
                               NavTally* tally)
    : params_(params),
      history_(history),
      filter_(filter),
      tally_(tally),
      watch_(kIncrementGate * params.gate_sigma, kQuietS) {}

void AttitudeAiding::Begin(Time t, const AttitudeEvent& attitude) {
  begun_ = t;
  alignment_ = attitude.alignment;
  Resume(t, &attitude);
}

void AttitudeAiding::Resume(Time t, const AttitudeEvent* attitude) {
  compared_ = agreed_ = t;
  pairs_.Clear();
  Anchor(t, attitude);
  watch_.Interrupt();
  stuck_.Interrupt();
}

void AttitudeAiding::Anchor(Time t, const AttitudeEvent* attitude) {
  anchor_.reset();
  if (attitude) anchor_ = {t, attitude->q_map_imu};
  turn_.setIdentity();
  turned_rad_ = 0.0;
}

void AttitudeAiding::AddTurn(const Eigen::Vector3d& rate_radps, double dt_s) {
  stuck_.AddRate(rate_radps, dt_s);
  const Eigen::Vector3d turn = (rate_radps - filter_->biases().segment<3>(kGyroBias)) * dt_s;
  turn_ = (turn_ * QuaternionFromRotationVector(turn)).normalized();
  turned_rad_ += turn.norm();
}

AttitudeEvent AttitudeAiding::CarriedTo(Time t, const AttitudeEvent& attitude) const {
  if (stamps_.carried_s() == 0.0 || history_->empty()) return attitude;
  AttitudeEvent carried = attitude;
  const Time measured = t - FromSeconds(stamps_.carried_s());
  carried.q_map_imu = (carried.q_map_imu * history_->Turn(measured, t)).normalized();
  return carried;
}

InertialRates AttitudeAiding::Sound(Time t, const InertialRates& measured) const {
  if (!gyros_in_doubt(t) || !device_rate_radps_) return measured;
  return {*device_rate_radps_ + filter_->biases().segment<3>(kGyroBias),
          measured.specific_force_mps2};
}

// Turn rate of the device, measured over a time in which its noise is small compared with a turn,
// and no longer: a rate that lags in a turn moves the DVL's lever arm wrongly.
void AttitudeAiding::EstimateRate(Time t, const AttitudeEvent& attitude) {
  if (!rate_from_.empty() && ToSeconds(t - rate_from_.back().time) > kMaxIncrementS) {
    rate_from_.clear();
    device_rate_radps_.reset();
  }
  rate_from_.push_back({t, attitude.q_map_imu});
  const auto is_long_enough = [&](const Stamped<Eigen::Quaterniond>& from) {
    return ToSeconds(t - from.time) >= params_.attitude_interval_s - 1e-6;
  };
  while (rate_from_.size() > 1 && is_long_enough(rate_from_[1])) rate_from_.pop_front();
  const Stamped<Eigen::Quaterniond>& from = rate_from_.front();
  if (!is_long_enough(from)) return;
  device_rate_radps_ = RotationVectorFromQuaternion(from.value.conjugate() * attitude.q_map_imu) /
                       ToSeconds(t - from.time);
}

void AttitudeAiding::EstimateStamps(Time t, const AttitudeEvent& attitude) {
  pairs_.Add(t, attitude.q_map_imu, [this](const auto& from, const auto& to, double share) {
    AddStampPair(from, to, share);
  });
}

// Compares the device's turn between two samples with that of the gyros, for a range of delays.
void AttitudeAiding::AddStampPair(const Stamped<Eigen::Quaterniond>& from,
                                  const Stamped<Eigen::Quaterniond>& to,
                                  double share) {
  const Duration longest = FromSeconds(StampOffset::kLongestS);
  if (!history_->Covers(from.time - longest) || !history_->Covers(to.time + longest)) return;
  const Eigen::Quaterniond turn = from.value.conjugate() * to.value;
  const auto difference = [&](double delay_s) {
    const Duration late = FromSeconds(delay_s);
    const Eigen::Quaterniond expected = history_->Turn(from.time - late, to.time - late);
    return RotationVectorFromQuaternion(expected.conjugate() * turn);
  };
  const double dt_s = ToSeconds(to.time - from.time);
  const double turned_rad = turn.angularDistance(Eigen::Quaterniond::Identity());
  stamps_.Add(difference,
              IncrementSigma(dt_s, turned_rad, share),
              params_.gyro_bias_radps.sigma * dt_s,
              share * dt_s);
}

bool AttitudeAiding::IsRepeated(const AttitudeEvent& attitude) const {
  return last_ && attitude.q_map_imu.coeffs() == last_->coeffs();
}

// A vehicle that rolls is back within the limit every few seconds, and the device is still frozen.
bool AttitudeAiding::LooksFrozen(const AttitudeEvent& attitude) {
  const bool repeats = IsRepeated(attitude);
  const bool turned = turn_.angularDistance(Eigen::Quaterniond::Identity()) > kFrozenRad;
  is_frozen_ = repeats && (is_frozen_ || turned);
  return is_frozen_;
}

bool AttitudeAiding::gyros_in_doubt(Time t) const {
  return watch_.GoesOn(t) || (doubted_until_ && t < *doubted_until_);
}

bool AttitudeAiding::HoldsInertialBiases(Time t) const {
  return gyros_in_doubt(t) || (in_doubt_ && ToSeconds(t - *doubted_) < kMaxIncrementS);
}

void AttitudeAiding::Use(Time t, const AttitudeEvent& attitude) {
  const bool due = ToSeconds(t - compared_) >= params_.attitude_interval_s - 1e-6;
  if (!due && !in_doubt_) return;
  if (attitude.alignment == HeadingAlignment::kAligned && alignment_ != HeadingAlignment::kAligned)
    aligned_ = t;
  alignment_ = attitude.alignment;
  if (LooksFrozen(attitude)) {
    compared_ = t;
    watch_.Interrupt();
    Count("attitude_frozen");
    return refusals_.Add(t, true);
  }
  if (due) compared_ = t;
  EstimateRate(t, attitude);
  const bool compares = due && !IsRepeated(attitude);
  if (compares) EstimateStamps(t, attitude);
  last_ = attitude.q_map_imu;
  UseCarried(t, CarriedTo(t, attitude), compares);
}

void AttitudeAiding::UseCarried(Time t, const AttitudeEvent& attitude, bool compares) {
  if (compares) Compare(t, attitude);
  if (gyros_in_doubt(t)) {
    doubted_ = t;
    if (!in_doubt_) {
      Count("gyro_doubted");
      filter_->ReopenInertialBiases();
      filter_->ReopenAttitudeBias();
    }
    Take(t, attitude);
    in_doubt_ = true;
    return refusals_.AddTaken(t);
  }
  in_doubt_ = false;
  if (watch_.StepIsSure() && Step(t, attitude)) return refusals_.Add(t, false);
  const int refused = filter_->UpdateAttitude(attitude.q_map_imu, attitude.sigma_rpy_rad);
  refusals_.Add(t, refused > 0);
  if (refused == 0) {
    agreed_ = t;
    return;
  }
  Count("attitude_axis_gated", refused);
  if (refusals_.StreakS() < params_.gate_reset_s) return;
  refusals_.EndStreak();
  filter_->ReopenInertialBiases();
  filter_->ReopenAttitudeBias();
  tally_->CountReset("attitude");
  Take(t, attitude);
}

void AttitudeAiding::Compare(Time t, const AttitudeEvent& attitude) {
  const double dt_s = anchor_ ? ToSeconds(t - anchor_->time) : kMaxIncrementS + 1.0;
  if (dt_s <= kMaxIncrementS) {
    const Eigen::Quaterniond expected = anchor_->value * turn_;
    const Eigen::Vector3d difference =
        RotationVectorFromQuaternion(attitude.q_map_imu * expected.conjugate());
    watch_.Add(t, difference, IncrementSigma(dt_s, turned_rad_));
    CompareStuck(t, difference, dt_s);
  } else {
    watch_.Interrupt();
    stuck_.Interrupt();
  }
  Anchor(t, &attitude);
}

void AttitudeAiding::CompareStuck(Time t, const Eigen::Vector3d& difference_rad, double dt_s) {
  stuck_.AddDifference(difference_rad, dt_s, turned_rad_);
  // Over seconds the data sheet's bias would hide what the filter's does not.
  const double sigma_rad =
      IncrementSigma(stuck_.span_s(), stuck_.turned_rad(), 1.0, filter_->GyroBiasSigma());
  stuck_.Judge(kIncrementGate * params_.gate_sigma * sigma_rad);
  if (!stuck_.are_stuck()) return;
  doubted_until_ = t + FromSeconds(kQuietS);
  watch_.ForgetStep();
}

// Sigma of the difference between device and gyros over dt_s: the device's noise and the gyros'
// drift.
double AttitudeAiding::IncrementSigma(double dt_s,
                                      double turned_rad,
                                      double share,
                                      std::optional<double> bias_radps) const {
  const double white = params_.attitude_white_rad.maxCoeff();
  const double gyro = params_.gyro_noise_radps_rthz * std::sqrt(dt_s) +
                      params_.gyro_step_radps * dt_s +
                      bias_radps.value_or(params_.gyro_bias_radps.sigma) * dt_s;
  const GaussMarkov<double>& wander = params_.attitude_heading_wander_rad;
  const double wandered = wander.sigma * std::sqrt(2.0 * dt_s / wander.tau_s);
  const double deviated = params_.attitude_deviation_rad * std::min(turned_rad, 2.0);
  const double stamped = params_.attitude_time_sigma_s * turned_rad / std::max(dt_s, 1e-3);
  const double drifts =
      gyro * gyro + wandered * wandered + deviated * deviated + 2.0 * stamped * stamped;
  return std::sqrt(2.0 * white * white + drifts / share);
}

// Handles a step of the heading; false if it is too small to be one.
bool AttitudeAiding::Step(Time t, const AttitudeEvent& attitude) {
  const double step_rad = filter_->HeadingResidual(attitude.q_map_imu);
  const double seen_rad = watch_.step()->z();
  watch_.ForgetStep();
  const double gate_rad = params_.gate_sigma * filter_->HeadingResidualSigma();
  if (std::abs(seen_rad) < kMinStepRad || std::abs(step_rad) < std::max(kMinStepRad, gate_rad))
    return false;
  if (StepsBack(step_rad)) return true;
  tally_->CountHeadingStep();
  const bool announced = aligned_ && ToSeconds(t - *aligned_) < kAfterAlignmentS;
  const bool settles = announced || alignment_ == HeadingAlignment::kAligning ||
                       (alignment_ == HeadingAlignment::kUnknown &&
                        ToSeconds(t - begun_) < params_.attitude_settle_s);
  if (settles)
    filter_->FollowHeadingStep(step_rad);
  else
    filter_->KeepHeadingOverStep(step_rad);
  if (announced) filter_->EndHeadingDoubt(HeadingHypothesis::kOwn);
  return true;
}

// True if a second step takes the device back to one of the two hypotheses of the heading. This
// hypothesis is then taken as right: a device that was wrong only in between is more likely than
// one that was wrong before and is wrong again.
bool AttitudeAiding::StepsBack(double step_rad) {
  const double doubt_rad = filter_->heading_doubt_rad();
  const double back_rad = kSteppedBack * std::abs(doubt_rad);
  const double by_own_rad = filter_->heading_offset_rad() + step_rad;
  const bool own = std::abs(by_own_rad) < back_rad;
  const bool other = std::abs(by_own_rad - doubt_rad) < back_rad;
  if (!own && !other) return false;
  Count("heading_step_back");
  filter_->EndHeadingDoubt(own ? HeadingHypothesis::kOwn : HeadingHypothesis::kOther);
  filter_->TrustDeviceHeading();
  return true;
}

// Takes the attitude of the device. Since the last agreement of device and filter, the error moved
// the position sideways by at most half the difference times the distance.
void AttitudeAiding::Take(Time t, const AttitudeEvent& attitude) {
  const double off_rad = filter_->AttitudeResidual(attitude.q_map_imu).norm();
  const double way_m = filter_->state().v_map_mps.head<2>().norm() * ToSeconds(t - agreed_);
  const Eigen::Vector3d v = filter_->state().v_map_mps;
  const Eigen::Vector3d across = Eigen::Vector3d(-v.y(), v.x(), 0.0).stableNormalized();
  const double moved_m = 0.5 * std::min(off_rad, 1.0) * way_m;
  filter_->WidenPosition(moved_m * moved_m * across * across.transpose());
  filter_->TakeAttitude(attitude.q_map_imu, attitude.sigma_rpy_rad);
  agreed_ = t;
}

}  // namespace seastitch
