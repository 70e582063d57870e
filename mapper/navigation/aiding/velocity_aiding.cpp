#include "mapper/navigation/aiding/velocity_aiding.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kIncrementGate = 1.5;
constexpr double kQuietS = 5.0;
// Longest time between two ensembles that are compared with the accelerometers [s].
constexpr double kMaxIncrementS = 2.5;
// Time after a refusal or a doubt for which the DVL's scale and mounting are not estimated [s].
constexpr double kEstimateAgainS = 10.0;
// Time for which accelerometers must repeat their value (apart from rounding) to count as stuck
// [s].
constexpr double kStuckS = 0.5;
constexpr double kSameForceMps2 = 1e-9;
// Time without a doubt about the inertial unit after which the filter is trusted [s]. Until then a
// DVL is refused for at most kUnsoundResetS.
constexpr double kSoundS = 60.0;
constexpr double kUnsoundResetS = 1.0;
constexpr double kLongestStepS = 300.0;
// Time without an ensemble after which bottom lock is a new one [s]: an error of the last one is
// gone. A lock that flickers is the old one.
constexpr double kNewLockS = 10.0;
constexpr double kNotThatStep = 0.4;
// Time constant of the position error that accumulates before a doubt is raised [s].
constexpr double kBesideS = 3.0;
// Time over which the rate of change of a reading is computed [s].
constexpr double kChangeS = 0.1;
// Largest sigma of the velocity, relative to a step, at which the filter can tell whether the step
// is real.
constexpr double kMaxSigmaPerStep = 1.0 / 3.0;

}  // namespace

VelocityAiding::VelocityAiding(const NavigationParams& params,
                               const ErrorStateFilter::Mounting& mounting,
                               const Eigen::Vector3d& gravity_mps2,
                               const InertialHistory* history,
                               ErrorStateFilter* filter,
                               NavTally* tally)
    : params_(params),
      mounting_(mounting),
      gravity_mps2_(gravity_mps2),
      history_(history),
      filter_(filter),
      tally_(tally),
      watch_(kIncrementGate * params.gate_sigma, kQuietS) {}

void VelocityAiding::Interrupt() {
  pairs_.Clear();
  watch_.Interrupt();
  last_.reset();
}

void VelocityAiding::AddForce(const Eigen::Vector3d& force_mps2, double dt_s) {
  const bool repeats = (force_mps2 - last_force_mps2_).norm() < kSameForceMps2;
  repeated_s_ = repeats ? repeated_s_ + dt_s : 0.0;
  last_force_mps2_ = force_mps2;
  const Eigen::Vector3d force = force_mps2 - filter_->biases().segment<3>(kAccelBias);
  change_mps_ += dt_s * (filter_->state().q_map_imu * force + gravity_mps2_);
}

bool VelocityAiding::accelerometers_in_doubt(Time t) const {
  return watch_.GoesOn(t) || (doubted_until_ && t < *doubted_until_);
}

void VelocityAiding::Use(Time t,
                         const DvlEvent& dvl,
                         const Eigen::Vector3d& rate_radps,
                         bool attitude_is_sound) {
  if (attitude_is_sound) EstimateStamps(t, dvl);
  is_sound_ = attitude_is_sound && (!doubted_ || ToSeconds(t - *doubted_) > kSoundS);
  UseCarried(t, CarriedTo(t, dvl), rate_radps);
}

void VelocityAiding::UseCarried(Time t, const DvlEvent& dvl, const Eigen::Vector3d& rate_radps) {
  ForgetOldStep(t);
  Compare(t, dvl, rate_radps);
  Decide(t, dvl);
  off_mps_ = Off(dvl);
}

void VelocityAiding::Decide(Time t, const DvlEvent& dvl) {
  if (watch_.step() && !followed_since_ && repeated_s_ > kStuckS) DoubtAccelerometers(t);
  // Only a filter that is trusted can decide that the DVL is wrong.
  if (!is_sound_ && !followed_since_) watch_.ForgetStep();
  if (accelerometers_in_doubt(t)) {
    doubted_ = t;
    if (!in_doubt_) {
      Count("accelerometer_doubted");
      filter_->ReopenInertialBiases();
      filter_->WidenPosition(beside_m_ * beside_m_.transpose());
    }
    in_doubt_ = true;
    Take(t, dvl);
    return refusals_.AddTaken(t);
  }
  in_doubt_ = false;
  // The DVL agrees better than the step allows: it stepped back unnoticed, or there was no step.
  if (watch_.step() && !followed_since_ &&
      filter_->DvlResidual(dvl.v_dvl_mps).norm() < kNotThatStep * watch_.step()->norm())
    watch_.ForgetStep();
  if (followed_since_ && !watch_.step()) {
    followed_since_.reset();
    Follow(t, dvl);
  }
  if (watch_.StepIsSure() && RefusesStep(t, dvl)) {
    Count("dvl_stepped");
    return refusals_.Add(t, true);
  }
  Weigh(t, dvl);
}

Eigen::Vector3d VelocityAiding::Gravity(Time t) const {
  return history_->At(t).turn * (filter_->state().q_map_imu.conjugate() * gravity_mps2_);
}

Eigen::Vector3d VelocityAiding::VelocityAt(const InertialHistory::Moment& then,
                                           const DvlEvent& dvl) const {
  const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
  const Eigen::Vector3d swing = then.rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
  return then.turn * (T_imu_dvl.linear() * dvl.v_dvl_mps - swing);
}

void VelocityAiding::EstimateStamps(Time t, const DvlEvent& dvl) {
  if (repeated_s_ > kStuckS) return pairs_.Clear();
  pairs_.Add(t, dvl, [&](const auto& from, const auto& to, double share) {
    AddStampPair(t, from, to, share);
  });
}

// Compares the change between two ensembles with that by the accelerometers, for a range of delays.
void VelocityAiding::AddStampPair(Time now,
                                  const Stamped<DvlEvent>& from,
                                  const Stamped<DvlEvent>& to,
                                  double share) {
  const Duration longest = FromSeconds(StampOffset::kLongestS);
  if (!history_->Covers(from.time - longest) || !history_->Covers(to.time + longest)) return;
  const double dt_s = ToSeconds(to.time - from.time);
  const Eigen::Vector3d fall = dt_s * Gravity(now);
  const auto difference = [&](double delay_s) -> Eigen::Vector3d {
    const InertialHistory::Moment a = history_->At(from.time - FromSeconds(delay_s));
    const InertialHistory::Moment b = history_->At(to.time - FromSeconds(delay_s));
    return b.turn.conjugate() *
           (VelocityAt(b, to.value) - VelocityAt(a, from.value) - (b.push_mps - a.push_mps) - fall);
  };
  // Overlapping pairs share the accelerometers' noise.
  const double noise = params_.accel_noise_mps2_rthz * std::sqrt(dt_s / share);
  const double sigma = Hypotenuse(std::sqrt(2.0) * to.value.sigma_mps.maxCoeff(), noise);
  stamps_.Add(difference, sigma, DriftSigma(dt_s), share * dt_s);
}

DvlEvent VelocityAiding::CarriedTo(Time t, const DvlEvent& dvl) const {
  const double delay_s = stamps_.carried_s();
  if (delay_s == 0.0 || history_->empty()) return dvl;
  DvlEvent carried{Carried(t, dvl, delay_s), dvl.sigma_mps};
  const Eigen::Vector3d off = Carried(t, dvl, delay_s + stamps_.sigma_s()) - carried.v_dvl_mps;
  carried.sigma_mps = (dvl.sigma_mps.cwiseAbs2() + off.cwiseAbs2()).cwiseSqrt();
  return carried;
}

Eigen::Vector3d VelocityAiding::Carried(Time t, const DvlEvent& dvl, double delay_s) const {
  const InertialHistory::Moment then = history_->At(t - FromSeconds(delay_s));
  const InertialHistory::Moment now = history_->At(t);
  const Eigen::Vector3d v_then = VelocityAt(then, dvl);
  Eigen::Vector3d v_imu = then.turn.conjugate() * v_then;
  if (!accelerometers_in_doubt(t))
    v_imu = now.turn.conjugate() *
            (v_then + now.push_mps - then.push_mps + ToSeconds(now.time - then.time) * Gravity(t));
  const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
  const Eigen::Vector3d swing = now.rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
  return T_imu_dvl.linear().transpose() * (v_imu + swing);
}

// Change of a reading with its stamp, from the inertial unit, which measures changes better than
// the DVL.
DvlStamping VelocityAiding::StampingOf(Time t, const DvlEvent& dvl) const {
  if (history_->empty()) return {};
  return {(Carried(t, dvl, kChangeS) - dvl.v_dvl_mps) / kChangeS, stamps_.carried_s()};
}

void VelocityAiding::Weigh(Time t, const DvlEvent& dvl) {
  const std::optional<double> quiet_s = refusals_.QuietS(t);
  const bool estimates = !quiet_s || *quiet_s > kEstimateAgainS;
  const int refused = filter_->UpdateDvl(dvl.v_dvl_mps,
                                         dvl.sigma_mps,
                                         StampingOf(t, dvl),
                                         estimates ? ErrorStateFilter::SlowStates::kEstimated
                                                   : ErrorStateFilter::SlowStates::kUnchanged);
  refusals_.Add(t, refused > 0);
  if (refused == 0) {
    used_ = agreed_ = t;
    if (!watch_.StepIsSure()) watch_.ForgetStep();
    return;
  }
  Count("dvl_axis_gated", refused);
  const bool awaits_step_back = watch_.step() && !followed_since_;
  if (awaits_step_back || refusals_.StreakS() < (is_sound_ ? params_.gate_reset_s : kUnsoundResetS))
    return;
  refusals_.EndStreak();
  tally_->CountReset("dvl");
  filter_->ReopenInertialBiases();
  Take(t, dvl);
}

Eigen::Vector3d VelocityAiding::ImuVelocity(const DvlEvent& dvl,
                                            const Eigen::Vector3d& rate_radps) const {
  const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
  const Eigen::Vector3d swing = rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
  return filter_->state().q_map_imu * (T_imu_dvl.linear() * dvl.v_dvl_mps - swing);
}

double VelocityAiding::DriftSigma(double dt_s) const {
  const double tilt = params_.attitude_roll_pitch_rad.sigma.maxCoeff();
  return dt_s * Hypotenuse(params_.accel_bias_mps2.sigma + params_.accel_step_mps2,
                           gravity_mps2_.norm() * tilt);
}

// Sigma of the difference between DVL and accelerometers over dt_s: the DVL's noise and the
// accelerometers' drift.
double VelocityAiding::IncrementSigma(const DvlEvent& dvl, double dt_s) const {
  const double dvl_sigma = dvl.sigma_mps.maxCoeff();
  const double drift = DriftSigma(dt_s);
  const double noise = params_.accel_noise_mps2_rthz * std::sqrt(dt_s);
  return std::sqrt(2.0 * dvl_sigma * dvl_sigma + drift * drift + noise * noise);
}

// Accumulates the position error of the last seconds by a velocity error. A doubt is raised later
// than its cause, and until then the filter used the wrong velocity.
void VelocityAiding::AccumulateDisplacementError(const DvlEvent& dvl, double dt_s) {
  beside_m_ *= std::exp(-dt_s / kBesideS);
  beside_m_ += 0.5 * dt_s * (off_mps_ + Off(dvl));
}

Eigen::Vector3d VelocityAiding::Off(const DvlEvent& dvl) const {
  return filter_->state().q_map_imu *
         (mounting_.T_imu_dvl.linear() * filter_->DvlResidual(dvl.v_dvl_mps));
}

void VelocityAiding::Compare(Time t, const DvlEvent& dvl, const Eigen::Vector3d& rate_radps) {
  const Eigen::Quaterniond& q_map_imu = filter_->state().q_map_imu;
  const Measured now{t, ImuVelocity(dvl, rate_radps), q_map_imu};
  const double dt_s = last_ ? ToSeconds(t - last_->time) : kMaxIncrementS + 1.0;
  if (dt_s <= kMaxIncrementS) {
    // The error of a DVL that stepped is constant in the vehicle's axes: it turns with the vehicle.
    const Eigen::Vector3d step = watch_.step().value_or(Eigen::Vector3d::Zero());
    const Eigen::Vector3d difference = now.Without(step) - last_->Without(step) - change_mps_;
    const double stamp = params_.dvl_time_sigma_s * change_mps_.norm() / std::max(dt_s, 1e-3);
    const double sigma = Hypotenuse(IncrementSigma(dvl, dt_s), std::sqrt(2.0) * stamp);
    watch_.Add(t, q_map_imu.conjugate() * difference, sigma);
    AccumulateDisplacementError(dvl, dt_s);
  } else {
    watch_.Interrupt();
  }
  last_ = now;
  change_mps_.setZero();
}

// Whether the filter knows the velocity well enough to attribute the step to the DVL.
bool VelocityAiding::KnowsStep() const {
  const double sigma_mps =
      std::sqrt(filter_->covariance().diagonal().segment<2>(kVelocity).maxCoeff());
  return sigma_mps < kMaxSigmaPerStep * watch_.step()->norm();
}

// Forgets a step whose end may not have been seen: the lock is a new one, or the step has been
// followed for long.
void VelocityAiding::ForgetOldStep(Time t) {
  if (!watch_.step()) return;
  const bool long_followed = followed_since_ && ToSeconds(t - *followed_since_) > kLongestStepS;
  const bool new_lock = last_ && ToSeconds(t - last_->time) > kNewLockS;
  if (long_followed || (new_lock && (followed_since_ || !KnowsStep()))) watch_.ForgetStep();
}

bool VelocityAiding::RefusesStep(Time t, const DvlEvent& dvl) {
  if (!followed_since_) {
    const double stepped_s = ToSeconds(t - watch_.step_time());
    if (stepped_s < params_.dvl_step_s || (KnowsStep() && stepped_s < kLongestStepS)) return true;
    followed_since_ = t;
    off_by_step_m_.setZero();
    tally_->CountReset("dvl");
    Follow(t, dvl);
    return false;
  }
  // The position error by a wrong velocity grows with time, not with its square root.
  const double dt_s = agreed_ ? std::clamp(ToSeconds(t - *agreed_), 0.0, kMaxIncrementS) : 0.0;
  const Eigen::Vector3d further = dt_s * (filter_->state().q_map_imu * *watch_.step());
  const double before_m = off_by_step_m_.norm();
  off_by_step_m_ += further;
  const double grown_m2 = std::max(0.0, off_by_step_m_.squaredNorm() - before_m * before_m);
  const Eigen::Vector3d along = further.stableNormalized();
  filter_->WidenPosition(grown_m2 * along * along.transpose());
  return false;
}

// Takes the DVL's velocity. The filter's velocity error grew from zero since both last agreed: the
// position error is half the difference times that time.
void VelocityAiding::Take(Time t, const DvlEvent& dvl) {
  const Eigen::Vector3d before = filter_->state().v_map_mps;
  const double wrong_s = agreed_ ? ToSeconds(t - *agreed_) : 0.0;
  Follow(t, dvl);
  const Eigen::Vector3d way = 0.5 * wrong_s * (filter_->state().v_map_mps - before);
  Move(way);
}

void VelocityAiding::Move(const Eigen::Vector3d& way_m) {
  filter_->MovePosition(way_m);
  filter_->WidenPosition(way_m * way_m.transpose());
}

void VelocityAiding::Follow(Time t, const DvlEvent& dvl) {
  filter_->TakeVelocity(dvl.v_dvl_mps, dvl.sigma_mps, StampingOf(t, dvl));
  used_ = agreed_ = t;
}

}  // namespace seastitch
