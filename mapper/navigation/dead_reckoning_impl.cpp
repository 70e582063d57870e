#include "mapper/navigation/dead_reckoning_impl.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <variant>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "mapper/navigation/filter/prediction.hpp"

namespace seastitch {
namespace {

// Number of waiting fixes, the newest ones, that keep their states over a restart: 18 kB each.
constexpr std::size_t kFixesRemembered = 8;

constexpr std::size_t kOverrulingFixes = 3;
// Part of the largest speed to which a larger one is limited: at the limit itself, rounding would
// exceed it again with the next sample.
constexpr double kLimitedTo = 0.99;
// Longest wait for an attitude after a gap of the inertial data [s]: for a device of 1 Hz and some
// jitter.
constexpr double kWaitForAttitudeS = 2.5;
// Intervals of inertial samples whose median is the unit's own.
constexpr std::size_t kIntervals = 9;
constexpr std::size_t kFewestIntervals = 5;
// The slowest unit that is integrated [s]: attitude sensors on NMEA 2000 send once a second.
constexpr double kSlowestS = 1.1;
// Longest interval [s] over which specific force, which turns with the vehicle, is integrated.
constexpr double kForceHoldsS = 1.0;
// The same of a unit by which the stamps of other sensors are found, and their samples carried.
constexpr double kStampsS = 0.5;
// Error of the mean rate between two samples of a slow unit, 1 sigma, as a part of the difference
// of their rates: by measurement, for units of 1 to 4 Hz in a swell of 6 s.
constexpr double kBetweenSamples = 0.5;
constexpr double kBetweenSamplesPerS = 1.0;  // the larger of the two counts

ErrorStateFilter::Mounting MountingOf(const VehicleGeometry& vehicle) {
  ErrorStateFilter::Mounting mounting;
  mounting.T_imu_vehicle = vehicle.T_vehicle_imu.inverse();
  mounting.T_imu_dvl = mounting.T_imu_vehicle * vehicle.T_vehicle_dvl;
  mounting.p_imu_depth = mounting.T_imu_vehicle * vehicle.p_vehicle_depth_m;
  return mounting;
}

}  // namespace

DeadReckoning::Impl::Impl(const NavigationParams& params, const VehicleGeometry& vehicle)
    : params_(params),
      vehicle_(vehicle),
      mounting_(MountingOf(vehicle)),
      earth_(vehicle.datum.latitude_rad),
      intake_(params_, vehicle, &tally_),
      filter_(params_, mounting_, earth_),
      start_(params_, mounting_),
      attitude_(params_, &history_, &filter_, &tally_),
      velocity_(params_, mounting_, earth_.gravity_mps2, &history_, &filter_, &tally_),
      fixes_(params_, &tally_),
      track_(params_),
      longest_interval_s_(params.imu_gap_s) {}

// --- in order of time --------------------------------------------------------------------------

void DeadReckoning::Impl::Add(const PositionFix& fix) {
  const std::optional<Event> late = intake_.Add(fix);
  if (late) UseLateFix(late->time, std::get<FixEvent>(late->measurement));
}

void DeadReckoning::Impl::AddSoundSpeed(Time t, double speed_mps) {
  intake_.AddSoundSpeed(t, speed_mps);
}

void DeadReckoning::Impl::Finish() {
  intake_.Finish();
  Process();
}

void DeadReckoning::Impl::Process() {
  while (const std::optional<Event> event = intake_.Next()) Handle(*event);
}

void DeadReckoning::Impl::Handle(const Event& event) {
  const auto* imu = std::get_if<ImuEvent>(&event.measurement);
  if (const auto* unusable = std::get_if<UnusableEvent>(&event.measurement))
    RefusalsOf(unusable->sensor)->AddUnusable(event.time);
  else if (!imu)
    started_ ? between_.push_back(event) : RememberForStart(event);
  else if (started_)
    Advance(event.time, imu->rates);
  else
    Start(event.time, imu->rates);
}

void DeadReckoning::Impl::RememberForStart(const Event& event) {
  if (const auto* water = std::get_if<SoundSpeedEvent>(&event.measurement))
    UseSoundSpeed(*water);
  else if (const auto* dvl = std::get_if<DvlEvent>(&event.measurement))
    StartWith(event.time, Corrected(*dvl));
  else if (const auto* depth = std::get_if<DepthEvent>(&event.measurement))
    start_.Use(event.time, *depth);
  else if (const auto* fix = std::get_if<FixEvent>(&event.measurement))
    start_.Use(event.time, *fix);
  else if (const auto* attitude = std::get_if<AttitudeEvent>(&event.measurement))
    start_.Use(event.time, *attitude);
}

void DeadReckoning::Impl::StartWith(Time t, const DvlEvent& dvl) {
  if (IsPossible(dvl, rates_)) start_.Use(t, dvl);
}

void DeadReckoning::Impl::Start(Time t, const InertialRates& rates) {
  rates_ = rates;
  const auto first = start_.Try(t, rates);
  if (!first) return Count("imu_before_start");
  if (!first->dvl) Count("start_without_dvl");
  if (!first->has_depth) Count("start_without_depth");
  if (!first->place_is_known) Count("start_without_place");
  filter_.Initialise(first->start, first->attitude.q_map_imu, first->attitude.sigma_rpy_rad);
  attitude_.Begin(t, first->attitude);
  if (first->dvl) velocity_.Begin(*first->dvl);
  place_is_known_ = first->place_is_known;
  started_ = true;
  intake_.Freeze();
  started_at_ = now_ = t;
  track_.Add(t, &filter_, first->dvl.has_value());
}

void DeadReckoning::Impl::Advance(Time t, const InertialRates& rates) {
  const double passed_s = ToSeconds(t - now_);
  const bool is_gap = passed_s > longest_interval_s_;
  track_.SetLongestInterval(longest_interval_s_);
  AddInterval(passed_s);
  if (is_gap)
    CoastTo(t, rates);
  else
    IntegrateTo(t, rates);
}

void DeadReckoning::Impl::AddInterval(double s) {
  intervals_s_.push_back(s);
  if (intervals_s_.size() > kIntervals) intervals_s_.pop_front();
  if (intervals_s_.size() < kFewestIntervals) return;
  const double typical_s = Median(std::vector<double>(intervals_s_.begin(), intervals_s_.end()));
  longest_interval_s_ =
      typical_s > kSlowestS ? params_.imu_gap_s : std::max(params_.imu_gap_s, 1.5 * typical_s);
}

// Bridges a gap in the inertial data. Of the aiding samples inside the gap only fixes can be used:
// by the graph. If there is no attitude at the end of the gap, waits for one.
void DeadReckoning::Impl::CoastTo(Time t, const InertialRates& rates) {
  const std::optional<AttitudeEvent> attitude = AttitudeAfterGap(t, rates);
  const auto is_fix = [](const Event& event) {
    return std::holds_alternative<FixEvent>(event.measurement);
  };
  const auto unused = std::count_if(between_.begin(), between_.end(), [&](const Event& event) {
    return !is_fix(event) && !std::holds_alternative<AttitudeEvent>(event.measurement);
  });
  if (unused > 0) Count("aiding_in_imu_gap", unused);
  std::erase_if(between_, std::not_fn(is_fix));
  if (!resumed_) resumed_ = t;
  if (!attitude) Count("imu_gap_without_attitude");
  if (!attitude && ToSeconds(t - *resumed_) < kWaitForAttitudeS) return;
  Count("imu_gap");
  resumed_.reset();
  filter_.Coast(
      ToSeconds(t - now_), attitude ? std::optional(attitude->q_map_imu) : std::nullopt, rates);
  history_.Clear();
  attitude_.Resume(t, attitude ? &*attitude : nullptr);
  velocity_.Interrupt();
  const std::vector<Event> waiting = std::exchange(between_, {});
  Publish(t, rates);
  for (const Event& fix : waiting)
    if (!KeepPastFix(fix.time, std::get<FixEvent>(fix.measurement))) Count("aiding_in_imu_gap");
}

// The newest attitude, if it is not older than imu_gap_s, extrapolated from its time of measurement
// to t by the rates at t.
std::optional<AttitudeEvent> DeadReckoning::Impl::AttitudeAfterGap(
    Time t, const InertialRates& rates) const {
  std::optional<AttitudeEvent> attitude;
  for (const Event& event : between_) {
    const auto* newer = std::get_if<AttitudeEvent>(&event.measurement);
    const double old_s = ToSeconds(t - event.time);
    if (!newer || old_s > longest_interval_s_) continue;
    const Eigen::Vector3d turn =
        (old_s + attitude_.stamps().carried_s()) * filter_.WithoutBias(rates).angular_rate_radps;
    attitude = *newer;
    attitude->q_map_imu = (newer->q_map_imu * QuaternionFromRotationVector(turn)).normalized();
  }
  return attitude;
}

// Integrates from now_ to t, and uses each aiding sample on the way. Rates are linear between the
// two inertial samples.
void DeadReckoning::Impl::IntegrateTo(Time t, const InertialRates& rates) {
  const double span_s = ToSeconds(t - now_);
  Time at = now_;
  InertialRates from = rates_;
  const auto carry_to = [&](Time stop) {
    if (stop <= at) return;
    const double w = ToSeconds(stop - now_) / span_s;
    const InertialRates to{(1.0 - w) * rates_.angular_rate_radps + w * rates.angular_rate_radps,
                           (1.0 - w) * rates_.specific_force_mps2 + w * rates.specific_force_mps2};
    Propagate(stop, from, to, ToSeconds(stop - at));
    at = stop;
    from = to;
  };
  if (span_s > params_.imu_gap_s) {
    const double of_s = span_s * std::max(kBetweenSamples, kBetweenSamplesPerS * span_s);
    filter_.AddErrorOfRates(of_s * (rates.angular_rate_radps - rates_.angular_rate_radps),
                            of_s * (rates.specific_force_mps2 - rates_.specific_force_mps2));
  }
  for (const Event& event : between_) {
    carry_to(event.time);
    Use(event, attitude_.Sound(event.time, from));
  }
  carry_to(t);
  LimitSpeed(t);
  Publish(t, rates);
}

void DeadReckoning::Impl::Propagate(Time to_time,
                                    const InertialRates& from,
                                    const InertialRates& to,
                                    double dt_s) {
  const Eigen::Vector3d force = 0.5 * (from.specific_force_mps2 + to.specific_force_mps2);
  const InertialRates free_from = filter_.WithoutBias(from);
  const InertialRates free_to = filter_.WithoutBias(to);
  if (longest_interval_s_ > kStampsS)
    history_.Clear();
  else
    history_.Add(to_time, free_from, free_to, dt_s);
  filter_.EstimateInertialBiases(!attitude_.HoldsInertialBiases(to_time));
  attitude_.AddTurn(0.5 * (from.angular_rate_radps + to.angular_rate_radps), dt_s);
  velocity_.AddForce(force, dt_s);
  const Eigen::Vector3d acceleration = filter_.state().q_map_imu * force + earth_.gravity_mps2;
  const bool possible = acceleration.norm() <= params_.max_acceleration_mps2;
  if (!possible) Count("acceleration_limited");
  const InertialRates sound_from = attitude_.Sound(to_time, from);
  const InertialRates sound_to = attitude_.Sound(to_time, to);
  const bool is_slow = longest_interval_s_ > kForceHoldsS;
  if (possible && !is_slow && !velocity_.accelerometers_in_doubt(to_time))
    filter_.Propagate(sound_from, sound_to, dt_s);
  else
    filter_.PropagateHoldingVelocity(sound_from, sound_to, dt_s);
}

void DeadReckoning::Impl::LimitSpeed(Time t) {
  const Eigen::Vector3d v = filter_.v_map_vehicle_mps();
  if (v.norm() <= params_.max_speed_mps) return;
  Count("speed_limited");
  const double by_lever_mps = (v - filter_.state().v_map_mps).norm();
  filter_.LimitSpeed(std::max(kLimitedTo * params_.max_speed_mps - by_lever_mps, 0.0));
  velocity_.DoubtAccelerometers(t);
}

void DeadReckoning::Impl::Publish(Time t, const InertialRates& rates) {
  between_.clear();
  now_ = t;
  rates_ = rates;
  const ErrorStateFilter::Moves& moves = filter_.moves();
  if (moves.count > 0) {
    tally_.Set("position_moved", moves.count);
    tally_.Set("position_moved_cm", std::llround(100.0 * moves.way_m));
  }
  const std::optional<Time> used = velocity_.used();
  const bool lock = used && ToSeconds(t - *used) <= params_.bottom_lock_timeout_s;
  track_.Add(t, &filter_, lock);
}

void DeadReckoning::Impl::Use(const Event& event, const InertialRates& rates) {
  if (const auto* water = std::get_if<SoundSpeedEvent>(&event.measurement))
    UseSoundSpeed(*water);
  else if (const auto* dvl = std::get_if<DvlEvent>(&event.measurement))
    UseDvl(event.time, Corrected(*dvl), rates);
  else if (const auto* depth = std::get_if<DepthEvent>(&event.measurement))
    UseDepth(event.time, *depth);
  else if (const auto* fix = std::get_if<FixEvent>(&event.measurement))
    UseFix(event.time, *fix);
  else if (const auto* attitude = std::get_if<AttitudeEvent>(&event.measurement))
    attitude_.Use(event.time, *attitude);
}

void DeadReckoning::Impl::UseSoundSpeed(const SoundSpeedEvent& water) {
  dvl_correction_ = water.speed_mps / params_.dvl_sound_speed_mps;
}

DvlEvent DeadReckoning::Impl::Corrected(const DvlEvent& dvl) const {
  return {dvl_correction_ * dvl.v_dvl_mps, dvl.sigma_mps};
}

void DeadReckoning::Impl::UseDvl(Time t, const DvlEvent& dvl, const InertialRates& rates) {
  if (!IsPossible(dvl, rates)) return velocity_.refusals()->AddUnusable(t);
  velocity_.Use(t, dvl, rates.angular_rate_radps, attitude_.IsTrusted(t));
}

// False if the measured velocity exceeds the vehicle's largest speed: then the DVL is wrong.
bool DeadReckoning::Impl::IsPossible(const DvlEvent& dvl, const InertialRates& rates) {
  const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
  const Eigen::Vector3d swing =
      rates.angular_rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
  const double speed_mps = (T_imu_dvl.linear() * dvl.v_dvl_mps - swing).norm();
  const bool possible =
      speed_mps <= params_.max_speed_mps + params_.gate_sigma * dvl.sigma_mps.maxCoeff();
  if (!possible) Count("dvl_too_fast");
  return possible;
}

void DeadReckoning::Impl::UseDepth(Time t, const DepthEvent& depth) {
  const int refused = filter_.UpdateDepth(depth.depth_m, depth.sigma_m);
  depth_refusals_.Add(t, refused > 0);
  if (refused == 0) return;
  Count("depth_gated");
  if (depth_refusals_.StreakS() < params_.gate_reset_s) return;
  depth_refusals_.EndStreak();
  tally_.CountReset("depth");
  filter_.TakeDepth(depth.depth_m, depth.sigma_m);
}

void DeadReckoning::Impl::UseFix(Time t, const FixEvent& of_antenna) {
  const Eigen::Isometry3d T_map_vehicle = filter_.T_map_vehicle();
  const FixEvent fix = of_antenna.OfVehicle(T_map_vehicle.linear());
  if (!params_.fuse_position_fixes) {
    place_is_known_ = true;
    return fixes_.Keep(t, fix, T_map_vehicle.translation().head<2>());
  }
  if (!fixes_.Passes(t, fix)) return;
  const Eigen::Vector2d off_m = fix.north_east_m - T_map_vehicle.translation().head<2>();
  const bool refused = filter_.UpdatePosition(fix.north_east_m, fix.covariance_m2) > 0;
  fix_refusals_.Add(t, refused);
  if (refused) Count("fix_gated");
  if (refused && !OverruleByFixes({off_m, fix.covariance_m2})) return;
  if (refused) {
    tally_.CountReset("fix");
    filter_.TakePosition(fix.north_east_m, fix.covariance_m2);
  }
  refused_fixes_.clear();
  place_is_known_ = true;
}

// True if several refused fixes in a row agree with each other: then the fixes are right.
bool DeadReckoning::Impl::OverruleByFixes(const RefusedFix& fix) {
  const auto agrees = [&](const RefusedFix& other) {
    const Eigen::Vector2d apart_m = fix.off_m - other.off_m;
    const Eigen::Matrix2d S = fix.covariance_m2 + other.covariance_m2;
    const double nis = apart_m.dot(S.llt().solve(apart_m));
    return nis <= params_.gate_sigma * params_.gate_sigma * 2.0;
  };
  if (!std::all_of(refused_fixes_.begin(), refused_fixes_.end(), agrees)) refused_fixes_.clear();
  refused_fixes_.push_back(fix);
  return refused_fixes_.size() >= kOverrulingFixes;
}

// A fix at a time beyond now_ lies in a gap of the inertial data that is not bridged yet.
void DeadReckoning::Impl::UseLateFix(Time t, const FixEvent& fix) {
  if (started_ && t > now_) {
    const Event event{t, fix};
    between_.insert(std::upper_bound(between_.begin(), between_.end(), event), event);
    return;
  }
  const bool for_start = !started_ && params_.start_at_first_fix;
  if (for_start) start_.Use(t, fix);
  if (for_start || KeepPastFix(t, fix))
    tally_.CountLateTaken("fix");
  else
    tally_.CountLate("fix");
}

// Keeps a fix for the graph, which can use it at its time of measurement. False: there is no state
// at that time, or the filter uses the fixes.
bool DeadReckoning::Impl::KeepPastFix(Time t, const FixEvent& of_antenna) {
  const bool can = started_ && t >= started_at_ && !params_.fuse_position_fixes &&
                   ToSeconds(now_ - t) <= params_.window_s;
  const std::optional<NavState> then = can ? track_.StateAt(t) : std::nullopt;
  if (!then) return false;
  place_is_known_ = true;
  const Eigen::Isometry3d& T_map_vehicle = then->T_map_vehicle;
  fixes_.Keep(
      t, of_antenna.OfVehicle(T_map_vehicle.linear()), T_map_vehicle.translation().head<2>());
  return true;
}

// --- over a restart ----------------------------------------------------------------------------

std::optional<std::vector<std::uint8_t>> DeadReckoning::Impl::Save(
    std::optional<Time> since) const {
  std::vector<Time> instants;
  if (since) instants.push_back(*since);
  const std::vector<MapFix> fixes = fixes_.Waiting();
  const std::size_t left_out = fixes.size() - std::min(fixes.size(), kFixesRemembered);
  for (std::size_t i = left_out; i < fixes.size(); ++i) instants.push_back(fixes[i].time);
  const std::optional<NavTrack::Memory> track = track_.Remember(std::move(instants));
  if (!track) return std::nullopt;
  ArchiveWriter archive;
  archive(*track, *this);
  return archive.Release();
}

bool DeadReckoning::Impl::Restore(Bytes saved) {
  ArchiveReader archive(saved);
  NavTrack::Memory track;
  archive(track, *this);
  const bool usable = archive.IsDone() && started_ && filter_.IsFinite() && !track.keys.empty() &&
                      track.newest.time == now_;
  if (usable) track_.Restore(track);
  return usable;
}

RefusalRecord* DeadReckoning::Impl::RefusalsOf(NavSensor sensor) {
  switch (sensor) {
    case NavSensor::kAttitude: return attitude_.refusals();
    case NavSensor::kDvl: return velocity_.refusals();
    case NavSensor::kDepth: return &depth_refusals_;
    case NavSensor::kPositionFix: break;
  }
  return &fix_refusals_;
}

NavSensorHealth DeadReckoning::Impl::health(NavSensor sensor) {
  const RefusalRecord& record = *RefusalsOf(sensor);
  return {record.Share(now_), record.Since(now_)};
}

NavDoubts DeadReckoning::Impl::doubts() const {
  return {attitude_.gyros_in_doubt(now_),
          velocity_.accelerometers_in_doubt(now_),
          attitude_.is_frozen()};
}

std::vector<SuspectedOffset> DeadReckoning::Impl::suspected_offsets() const {
  std::vector<SuspectedOffset> offsets;
  const auto add = [&offsets](NavSensor sensor, const StampOffset& stamps) {
    if (stamps.IsSuspected()) offsets.push_back({sensor, -stamps.delay_s(), stamps.sigma_s()});
  };
  add(NavSensor::kAttitude, attitude_.stamps());
  add(NavSensor::kDvl, velocity_.stamps());
  return offsets;
}

std::optional<NavState> DeadReckoning::Impl::Predicted() const {
  if (!started_) return std::nullopt;
  const std::optional<NavState> state = track_.StateAt(now_);
  const auto velocity_covariance = track_.VelocityCovariance(now_);
  if (!state || !velocity_covariance) return std::nullopt;
  Prediction prediction(*state,
                        attitude_.Sound(now_, rates_),
                        Eigen::Quaterniond(mounting_.T_imu_vehicle.linear().transpose()),
                        filter_.biases().segment<3>(kGyroBias));
  for (const Event& event : intake_.waiting())
    if (const auto* imu = std::get_if<ImuEvent>(&event.measurement))
      prediction.CarryTo(event.time, attitude_.Sound(now_, imu->rates));
  // In doubt, the gyros do not measure how the turn has changed since the device's last attitudes.
  const double turn_sigma_radps = attitude_.gyros_in_doubt(now_) ? kCoastTurnRadps : 0.0;
  return prediction.state(*velocity_covariance, turn_sigma_radps);
}

}  // namespace seastitch
