#include "mapper/navigation/dead_reckoning.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/error_state_filter.hpp"
#include "mapper/navigation/nav_track.hpp"

namespace seastitch {
namespace {

// Beyond these no vehicle of ours moves and no sensor of ours measures.
constexpr double kMaxRateRadps = 35.0;  // what SBG ECAN can carry, and then some
constexpr double kMaxForceMps2 = 200.0;
constexpr double kMaxSpeedMps = 20.0;
constexpr double kMaxSpeedSigmaMps = 10.0;
constexpr double kMinDepthM = -20.0;
constexpr double kMaxDepthM = 12000.0;
constexpr double kMaxDepthSigmaM = 1000.0;
constexpr double kMinSoundSpeedMps = 1300.0;
constexpr double kMaxSoundSpeedMps = 1800.0;
constexpr double kMaxFixVarianceM2 = 1e8;
constexpr double kMaxFixDistanceM = 100e3;  // from the datum: the map is flat
// A sensor may be this far ahead of the inertial unit.
constexpr double kMaxAheadS = 5.0;
// What was measured so long before the start still tells of it.
constexpr double kFreshS = 2.0;
// Two attitudes a moment apart that agree so well are not a stray one.
constexpr double kSteadyAttitudeRad = 0.2;
constexpr double kSteadyAttitudeS = 1.0;
constexpr std::size_t kMaxWaiting = 20000;

template <class M>
bool Within(const M& values, double limit) {
  return (values.array().abs() <= limit).all();  // this way round NaN is refused
}

struct ImuEvent {
  InertialRates rates;
  std::optional<Attitude> attitude;
};
struct SoundSpeedEvent {
  double speed_mps;
};
struct DvlEvent {
  Eigen::Vector3d v_dvl_mps;
  Eigen::Vector3d sigma_mps;
};
struct DepthEvent {
  double depth_m;
  double sigma_m;
};
struct FixEvent {
  Eigen::Vector2d north_east_m;
  Eigen::Matrix2d covariance_m2;
};

// At one instant sound speed comes before the DVL that it corrects, and aiding before inertial
// data, which carry the state beyond it.
using Measurement = std::variant<SoundSpeedEvent, DvlEvent, DepthEvent, FixEvent, ImuEvent>;

struct Event {
  Time time;
  Measurement measurement;
  friend bool operator<(const Event& a, const Event& b) {
    return std::pair(a.time, a.measurement.index()) < std::pair(b.time, b.measurement.index());
  }
};

template <class T>
struct Stamped {
  Time time;
  T value;
};

ErrorStateFilter::Mounting MountingOf(const VehicleGeometry& vehicle) {
  ErrorStateFilter::Mounting mounting;
  mounting.T_imu_vehicle = vehicle.T_vehicle_imu.inverse();
  mounting.T_imu_dvl = mounting.T_imu_vehicle * vehicle.T_vehicle_dvl;
  mounting.p_imu_depth = mounting.T_imu_vehicle * vehicle.p_vehicle_depth_m;
  return mounting;
}

NavigationParams Checked(const NavigationParams& params) {
  const std::string problem = params.Validate();
  if (!problem.empty()) throw std::invalid_argument(problem);
  return params;
}

// Since when a sensor has been refused without a break.
class RefusalClock {
 public:
  // True when the refusals have lasted long enough, and begins anew.
  bool Refused(Time t, double limit_s) {
    if (!since_) since_ = t;
    if (ToSeconds(t - *since_) < limit_s) return false;
    since_.reset();
    return true;
  }
  void Accepted() { since_.reset(); }

 private:
  std::optional<Time> since_;
};

}  // namespace

class DeadReckoning::Impl {
 public:
  Impl(const NavigationParams& params, const VehicleGeometry& vehicle)
      : params_(Checked(params)),
        mounting_(MountingOf(vehicle)),
        to_map_(Rad2Deg(vehicle.datum_latitude_rad), Rad2Deg(vehicle.datum_longitude_rad), 0.0),
        filter_(params_, mounting_, EarthModel(vehicle.datum_latitude_rad)),
        track_(params_) {}

  void Add(const ImuSample& sample);
  void Add(const DvlSample& sample);
  void Add(const DepthSample& sample);
  void Add(const PositionFix& fix);
  void AddSoundSpeed(Time t, double speed_mps);
  void Finish();
  std::vector<MapFix> TakeFixes(Time until);

  const NavTrack& track() const { return track_; }
  const ErrorStateFilter& filter() const { return filter_; }
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

 private:
  void Count(const std::string& name, std::int64_t n = 1) { counters_[name] += n; }
  bool TakesTime(Time t);
  void AddAiding(const std::string& sensor, Time t, Measurement measurement);
  bool Insert(Event event);
  void ProcessUpTo(Time t);

  void Handle(const Event& event);
  void HandleImu(Time t, const ImuEvent& imu);
  void Start(Time t, const ImuEvent& imu);
  bool AttitudeIsSteady(Time t, const ImuEvent& imu);
  void RememberForStart(const Event& event);
  void Advance(Time t, const ImuEvent& imu);
  void IntegrateTo(Time t, const InertialRates& rates);
  void Use(Time t, const Measurement& measurement);
  void UseAttitude(Time t, const Attitude& attitude);
  void UseSoundSpeed(const SoundSpeedEvent& water);
  DvlEvent Corrected(const DvlEvent& dvl) const;
  void UseDvl(Time t, const DvlEvent& dvl);
  void UseDepth(Time t, const DepthEvent& depth);
  void UseFix(Time t, const FixEvent& fix);
  void KeepFix(const MapFix& fix);

  const NavigationParams params_;
  const ErrorStateFilter::Mounting mounting_;
  const GeographicLib::LocalCartesian to_map_;
  ErrorStateFilter filter_;
  NavTrack track_;
  std::map<std::string, std::int64_t> counters_;

  // In order of time, none at or before settled_.
  std::deque<Event> waiting_;
  std::optional<Time> settled_;
  std::optional<Time> newest_imu_;
  double dvl_correction_ = 1.0;  // of its velocity, for the speed of sound
  std::optional<Time> leap_;     // last of a run of stamps beyond clock_jump_s
  int leap_samples_ = 0;

  // Before the start.
  std::optional<Time> first_attitude_;
  std::optional<Stamped<Eigen::Quaterniond>> last_attitude_;
  std::optional<Stamped<DvlEvent>> last_dvl_;
  std::optional<Stamped<DepthEvent>> last_depth_;
  std::optional<Stamped<FixEvent>> last_fix_;

  // After it.
  bool started_ = false;
  Time now_;
  InertialRates rates_;
  std::vector<Event> between_;  // aiding since now_
  Time attitude_used_;
  std::optional<Time> dvl_used_;
  std::optional<Time> fix_used_;
  std::deque<MapFix> fixes_;  // for TakeFixes()
  RefusalClock attitude_refused_;
  RefusalClock dvl_refused_;
  RefusalClock depth_refused_;
};

// --- what comes in -----------------------------------------------------------------------------

void DeadReckoning::Impl::Add(const ImuSample& sample) {
  ImuEvent imu{{sample.angular_rate_radps, sample.specific_force_mps2}, sample.attitude};
  const bool possible = Within(imu.rates.angular_rate_radps, kMaxRateRadps) &&
                        Within(imu.rates.specific_force_mps2, kMaxForceMps2);
  if (!possible) return Count("imu_refused");
  if (imu.attitude) {
    const bool usable = std::abs(imu.attitude->q_ned_imu.norm() - 1.0) < 1e-2 &&
                        Within(imu.attitude->sigma_rpy_rad, kPi) &&
                        (imu.attitude->sigma_rpy_rad.array() >= 0.0).all();
    if (!usable) {
      Count("attitude_refused");
      imu.attitude.reset();
    } else {
      imu.attitude->q_ned_imu.normalize();
    }
  }
  if (!TakesTime(sample.time)) return;
  if (!Insert({sample.time, imu})) return;
  newest_imu_ = newest_imu_ ? std::max(*newest_imu_, sample.time) : sample.time;
  ProcessUpTo(*newest_imu_ - FromSeconds(params_.reorder_window_s));
}

// The inertial unit is the clock: one wild stamp must not move it.
bool DeadReckoning::Impl::TakesTime(Time t) {
  if (!newest_imu_) return true;
  const bool late = settled_ && t <= *settled_;
  const bool leaps = t > *newest_imu_ + FromSeconds(params_.clock_jump_s);
  if (!late && !leaps) {
    leap_.reset();
    return true;
  }
  Count(late ? "imu_late" : "imu_ahead");
  const bool goes_on = leap_ && t > *leap_ && t <= *leap_ + FromSeconds(params_.clock_jump_s);
  leap_samples_ = goes_on ? leap_samples_ + 1 : 1;
  leap_ = t;
  if (leap_samples_ < params_.clock_jump_samples) return false;
  // Forward it is a gap in the data. Backward it can only be mended while nothing was built on it.
  if (late && started_) return false;
  Count("clock_jump");
  if (late) {
    waiting_.clear();
    settled_.reset();
    newest_imu_.reset();
  }
  leap_.reset();
  return true;
}

void DeadReckoning::Impl::Add(const DvlSample& sample) {
  if (!sample.bottom_lock) return Count("dvl_without_bottom_lock");
  const bool possible = Within(sample.v_dvl_mps, kMaxSpeedMps) &&
                        Within(sample.sigma_v_mps, kMaxSpeedSigmaMps) &&
                        (sample.sigma_v_mps.array() >= 0.0).all();
  if (!possible) return Count("dvl_refused");
  DvlEvent dvl{sample.v_dvl_mps, sample.sigma_v_mps};
  for (double& sigma : dvl.sigma_mps)
    sigma = sigma > 0.0 ? std::max(sigma, params_.dvl_sigma_floor_mps) : params_.dvl_sigma_mps;
  AddAiding("dvl", sample.time, dvl);
}

void DeadReckoning::Impl::Add(const DepthSample& sample) {
  const bool possible = sample.depth_m >= kMinDepthM && sample.depth_m <= kMaxDepthM &&
                        sample.sigma_m >= 0.0 && sample.sigma_m <= kMaxDepthSigmaM;
  if (!possible) return Count("depth_refused");
  const double sigma = sample.sigma_m > 0.0 ? std::max(sample.sigma_m, params_.depth_sigma_floor_m)
                                            : params_.depth_sigma_m;
  AddAiding("depth", sample.time, DepthEvent{sample.depth_m, sigma});
}

void DeadReckoning::Impl::Add(const PositionFix& fix) {
  const Eigen::Matrix2d& C = fix.covariance_north_east_m2;
  const bool possible = std::abs(fix.latitude_rad) <= kPi / 2.0 &&
                        std::abs(fix.longitude_rad) <= kPi && Within(C, kMaxFixVarianceM2) &&
                        C(0, 0) > 0.0 && C.determinant() > 0.0 &&
                        std::abs(C(0, 1) - C(1, 0)) <= 1e-9 * C.trace();
  if (!possible) return Count("fix_refused");
  double east = 0.0;
  double north = 0.0;
  double up = 0.0;
  to_map_.Forward(Rad2Deg(fix.latitude_rad), Rad2Deg(fix.longitude_rad), 0.0, east, north, up);
  const Eigen::Vector2d north_east(north, east);
  if (!Within(north_east, kMaxFixDistanceM)) return Count("fix_refused");
  AddAiding("fix", fix.time, FixEvent{north_east, C});
}

void DeadReckoning::Impl::AddSoundSpeed(Time t, double speed_mps) {
  if (params_.dvl_sound_speed_mps == 0.0) return;
  if (!(speed_mps >= kMinSoundSpeedMps && speed_mps <= kMaxSoundSpeedMps))
    return Count("sound_speed_refused");
  AddAiding("sound_speed", t, SoundSpeedEvent{speed_mps});
}

void DeadReckoning::Impl::AddAiding(const std::string& sensor, Time t, Measurement measurement) {
  if (!newest_imu_) return Count(sensor + "_before_imu");
  if (settled_ && t <= *settled_) return Count(sensor + "_late");
  if (t > *newest_imu_ + FromSeconds(kMaxAheadS)) return Count(sensor + "_ahead");
  Insert({t, std::move(measurement)});
}

bool DeadReckoning::Impl::Insert(Event event) {
  if (waiting_.size() >= kMaxWaiting) {
    Count("queue_full");
    return false;
  }
  const auto at = std::upper_bound(waiting_.begin(), waiting_.end(), event);
  const bool is_imu = std::holds_alternative<ImuEvent>(event.measurement);
  if (is_imu && at != waiting_.begin() && std::prev(at)->time == event.time &&
      std::holds_alternative<ImuEvent>(std::prev(at)->measurement)) {
    Count("imu_duplicate");
    return false;
  }
  waiting_.insert(at, std::move(event));
  return true;
}

void DeadReckoning::Impl::ProcessUpTo(Time t) {
  while (!waiting_.empty() && waiting_.front().time <= t) {
    const Event event = std::move(waiting_.front());
    waiting_.pop_front();
    Handle(event);
  }
  settled_ = settled_ ? std::max(*settled_, t) : t;
}

void DeadReckoning::Impl::Finish() {
  if (newest_imu_) ProcessUpTo(*newest_imu_);
}

// --- in order of time --------------------------------------------------------------------------

void DeadReckoning::Impl::Handle(const Event& event) {
  if (const auto* imu = std::get_if<ImuEvent>(&event.measurement)) {
    HandleImu(event.time, *imu);
  } else if (started_) {
    between_.push_back(event);
  } else {
    RememberForStart(event);
  }
}

void DeadReckoning::Impl::RememberForStart(const Event& event) {
  if (const auto* water = std::get_if<SoundSpeedEvent>(&event.measurement))
    UseSoundSpeed(*water);
  else if (const auto* dvl = std::get_if<DvlEvent>(&event.measurement))
    last_dvl_ = {event.time, Corrected(*dvl)};
  else if (const auto* depth = std::get_if<DepthEvent>(&event.measurement))
    last_depth_ = {event.time, *depth};
  else if (const auto* fix = std::get_if<FixEvent>(&event.measurement))
    last_fix_ = {event.time, *fix};
}

void DeadReckoning::Impl::HandleImu(Time t, const ImuEvent& imu) {
  if (!started_)
    Start(t, imu);
  else
    Advance(t, imu);
}

bool DeadReckoning::Impl::AttitudeIsSteady(Time t, const ImuEvent& imu) {
  const Eigen::Quaterniond& q = imu.attitude->q_ned_imu;
  const bool steady = last_attitude_ && ToSeconds(t - last_attitude_->time) < kSteadyAttitudeS &&
                      last_attitude_->value.angularDistance(q) < kSteadyAttitudeRad;
  last_attitude_ = {t, q};
  if (!steady) first_attitude_ = t;
  return steady;
}

void DeadReckoning::Impl::Start(Time t, const ImuEvent& imu) {
  if (!imu.attitude || !AttitudeIsSteady(t, imu)) return Count("imu_before_start");
  const auto fresh = [t](const auto& last) { return last && ToSeconds(t - last->time) <= kFreshS; };
  const bool patient = ToSeconds(t - *first_attitude_) < params_.start_wait_s;
  const bool aided = fresh(last_dvl_) && fresh(last_depth_);
  if ((!aided && patient) || (params_.start_at_first_fix && !last_fix_))
    return Count("imu_before_start");

  const Eigen::Matrix3d R = imu.attitude->q_ned_imu.toRotationMatrix();
  Eigen::Vector3d p_map_vehicle(params_.start_north_m, params_.start_east_m, 0.0);
  ErrorStateFilter::Start start;
  start.sigma_p_m.setConstant(params_.start_sigma_m);
  if (params_.start_at_first_fix) {
    const double moved_m = ToSeconds(t - last_fix_->time) * params_.start_speed_sigma_mps;
    const Eigen::Vector2d variance = last_fix_->value.covariance_m2.diagonal();
    p_map_vehicle.head<2>() = last_fix_->value.north_east_m;
    start.sigma_p_m.head<2>() = (variance.array() + moved_m * moved_m).sqrt();
  }
  start.p_map_imu = p_map_vehicle - R * mounting_.T_imu_vehicle.translation();
  start.sigma_p_m.z() = params_.start_depth_sigma_m;  // until the first depth after the start
  if (fresh(last_depth_)) {
    start.p_map_imu.z() = last_depth_->value.depth_m - (R * mounting_.p_imu_depth).z();
  }
  start.sigma_v_mps = params_.start_speed_sigma_mps;
  if (fresh(last_dvl_)) {
    const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
    const Eigen::Vector3d swing =
        imu.rates.angular_rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
    start.v_map_mps = R * (T_imu_dvl.linear() * last_dvl_->value.v_dvl_mps - swing);
    dvl_used_ = last_dvl_->time;
  } else {
    Count("start_without_dvl");
  }
  if (!fresh(last_depth_)) Count("start_without_depth");

  filter_.Initialise(start, imu.attitude->q_ned_imu, imu.attitude->sigma_rpy_rad);
  started_ = true;
  now_ = t;
  attitude_used_ = t;
  rates_ = imu.rates;
  track_.Add(t, &filter_, dvl_used_.has_value());
}

void DeadReckoning::Impl::Advance(Time t, const ImuEvent& imu) {
  if (ToSeconds(t - now_) > params_.imu_gap_s) {
    if (!imu.attitude) return Count("imu_gap_without_attitude");
    Count("imu_gap");
    if (!between_.empty()) Count("aiding_in_imu_gap", static_cast<std::int64_t>(between_.size()));
    filter_.Coast(ToSeconds(t - now_), imu.attitude->q_ned_imu, imu.rates);
    attitude_used_ = t;
  } else {
    IntegrateTo(t, imu.rates);
    const bool due = ToSeconds(t - attitude_used_) >= params_.attitude_interval_s - 1e-6;
    if (imu.attitude && due) UseAttitude(t, *imu.attitude);
  }
  between_.clear();
  now_ = t;
  rates_ = imu.rates;
  const bool lock = dvl_used_ && ToSeconds(t - *dvl_used_) <= params_.bottom_lock_timeout_s;
  track_.Add(t, &filter_, lock);
}

// From now_ to t with a stop at each aiding sample on the way: rates change evenly between the two
// inertial samples.
void DeadReckoning::Impl::IntegrateTo(Time t, const InertialRates& rates) {
  const double span_s = ToSeconds(t - now_);
  Time at = now_;
  InertialRates from = rates_;
  const auto carry_to = [&](Time stop) {
    if (stop <= at) return;
    const double w = ToSeconds(stop - now_) / span_s;
    const InertialRates to{(1.0 - w) * rates_.angular_rate_radps + w * rates.angular_rate_radps,
                           (1.0 - w) * rates_.specific_force_mps2 + w * rates.specific_force_mps2};
    filter_.Propagate(from, to, ToSeconds(stop - at));
    at = stop;
    from = to;
  };
  for (const Event& event : between_) {
    carry_to(event.time);
    Use(event.time, event.measurement);
  }
  carry_to(t);
}

void DeadReckoning::Impl::Use(Time t, const Measurement& measurement) {
  if (const auto* water = std::get_if<SoundSpeedEvent>(&measurement))
    UseSoundSpeed(*water);
  else if (const auto* dvl = std::get_if<DvlEvent>(&measurement))
    UseDvl(t, Corrected(*dvl));
  else if (const auto* depth = std::get_if<DepthEvent>(&measurement))
    UseDepth(t, *depth);
  else if (const auto* fix = std::get_if<FixEvent>(&measurement))
    UseFix(t, *fix);
}

void DeadReckoning::Impl::UseAttitude(Time t, const Attitude& attitude) {
  attitude_used_ = t;
  const int refused = filter_.UpdateAttitude(attitude.q_ned_imu, attitude.sigma_rpy_rad);
  if (refused == 0) return attitude_refused_.Accepted();
  Count("attitude_axis_gated", refused);
  if (!attitude_refused_.Refused(t, params_.gate_reset_s)) return;
  Count("attitude_reset");
  filter_.OpenAttitudeBias();
}

void DeadReckoning::Impl::UseSoundSpeed(const SoundSpeedEvent& water) {
  dvl_correction_ = water.speed_mps / params_.dvl_sound_speed_mps;
}

DvlEvent DeadReckoning::Impl::Corrected(const DvlEvent& dvl) const {
  return {dvl_correction_ * dvl.v_dvl_mps, dvl.sigma_mps};
}

void DeadReckoning::Impl::UseDvl(Time t, const DvlEvent& dvl) {
  const int refused = filter_.UpdateDvl(dvl.v_dvl_mps, dvl.sigma_mps);
  if (refused == 0) {
    dvl_used_ = t;
    return dvl_refused_.Accepted();
  }
  Count("dvl_axis_gated", refused);
  if (!dvl_refused_.Refused(t, params_.gate_reset_s)) return;
  Count("dvl_reset");
  filter_.OpenVelocity();
}

void DeadReckoning::Impl::UseDepth(Time t, const DepthEvent& depth) {
  if (filter_.UpdateDepth(depth.depth_m, depth.sigma_m) == 0) return depth_refused_.Accepted();
  Count("depth_gated");
  if (!depth_refused_.Refused(t, params_.gate_reset_s)) return;
  Count("depth_reset");
  filter_.OpenDepth();
}

void DeadReckoning::Impl::UseFix(Time t, const FixEvent& fix) {
  if (fix_used_ && ToSeconds(t - *fix_used_) < params_.fix_interval_s) return;
  fix_used_ = t;
  if (!params_.fuse_position_fixes) return KeepFix({t, fix.north_east_m, fix.covariance_m2});
  if (filter_.UpdatePosition(fix.north_east_m, fix.covariance_m2) > 0) Count("fix_gated");
}

void DeadReckoning::Impl::KeepFix(const MapFix& fix) {
  fixes_.push_back(fix);
  if (ToSeconds(fix.time - fixes_.front().time) <= params_.window_s) return;
  fixes_.pop_front();
  Count("fix_never_taken");
}

std::vector<MapFix> DeadReckoning::Impl::TakeFixes(Time until) {
  const auto end = std::find_if(
      fixes_.begin(), fixes_.end(), [until](const MapFix& fix) { return fix.time > until; });
  std::vector<MapFix> taken(fixes_.begin(), end);
  fixes_.erase(fixes_.begin(), end);
  return taken;
}

// --- the public face ---------------------------------------------------------------------------

DeadReckoning::DeadReckoning(const NavigationParams& params, const VehicleGeometry& vehicle)
    : impl_(std::make_unique<Impl>(params, vehicle)) {}
DeadReckoning::~DeadReckoning() = default;
DeadReckoning::DeadReckoning(DeadReckoning&&) noexcept = default;
DeadReckoning& DeadReckoning::operator=(DeadReckoning&&) noexcept = default;

void DeadReckoning::Add(const ImuSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DvlSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DepthSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const PositionFix& fix) { impl_->Add(fix); }
void DeadReckoning::AddSoundSpeed(Time t, double speed_mps) { impl_->AddSoundSpeed(t, speed_mps); }
void DeadReckoning::Finish() { impl_->Finish(); }

std::optional<Time> DeadReckoning::latest() const { return impl_->track().latest(); }
std::optional<NavState> DeadReckoning::StateAt(Time t) const { return impl_->track().StateAt(t); }
std::optional<Eigen::Matrix3d> DeadReckoning::RelativeCovariance(Time a, Time b) const {
  return impl_->track().RelativeCovariance(a, b);
}
std::optional<Pose2> DeadReckoning::Hindsight(Time anchor, Time t) const {
  return impl_->track().Hindsight(anchor, t);
}
std::vector<MapFix> DeadReckoning::TakeFixes(Time until) { return impl_->TakeFixes(until); }
const std::map<std::string, std::int64_t>& DeadReckoning::counters() const {
  return impl_->counters();
}
InnovationSummary DeadReckoning::innovations(NavSensor sensor) const {
  return impl_->filter().innovations(sensor);
}

}  // namespace seastitch
