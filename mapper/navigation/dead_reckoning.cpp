#include "mapper/navigation/dead_reckoning.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/archive.hpp"
#include "common/core/pose.hpp"
#include "mapper/navigation/attitude_aiding.hpp"
#include "mapper/navigation/error_state_filter.hpp"
#include "mapper/navigation/fix_keeper.hpp"
#include "mapper/navigation/inertial_history.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/nav_track.hpp"
#include "mapper/navigation/navigation_start.hpp"
#include "mapper/navigation/prediction.hpp"
#include "mapper/navigation/refusal_record.hpp"
#include "mapper/navigation/sample_intake.hpp"
#include "mapper/navigation/velocity_aiding.hpp"

namespace seastitch {
namespace {

// Enough to compare any pair of samples with any delay of their stamps.
constexpr double kHistoryS = 2.0 * StampOffset::kLongestS + 2.0 * SamplePairs<DvlEvent>::kMostS;
// Fixes that wait for a submap keep their place over a restart, the newest so many: 18 kB each.
constexpr std::size_t kFixesRemembered = 8;

constexpr std::size_t kOverrulingFixes = 3;
// After a gap of the inertial data, for a device of 1 Hz and some jitter.
constexpr double kWaitForAttitudeS = 2.5;

ErrorStateFilter::Mounting MountingOf(const VehicleGeometry& vehicle) {
  ErrorStateFilter::Mounting mounting;
  mounting.T_imu_vehicle = vehicle.T_vehicle_imu.inverse();
  mounting.T_imu_dvl = mounting.T_imu_vehicle * vehicle.T_vehicle_dvl;
  mounting.p_imu_depth = mounting.T_imu_vehicle * vehicle.p_vehicle_depth_m;
  return mounting;
}

}  // namespace

class DeadReckoning::Impl {
 public:
  Impl(const NavigationParams& params, const VehicleGeometry& vehicle)
      : params_(params),
        vehicle_(vehicle),
        mounting_(MountingOf(vehicle)),
        earth_(vehicle.datum_latitude_rad),
        intake_(params_, vehicle, &counters_),
        filter_(params_, mounting_, earth_),
        start_(params_, mounting_),
        attitude_(params_, &history_, &filter_, &counters_),
        velocity_(params_, mounting_, earth_.gravity_mps2, &history_, &filter_, &counters_),
        fixes_(params_, &counters_),
        track_(params_) {}

  template <class Sample>
  void Add(const Sample& sample) {
    intake_.Add(sample);
    Process();
  }
  void Add(const PositionFix& fix);
  void AddSoundSpeed(Time t, double speed_mps);
  void Finish();
  std::vector<MapFix> WaitingFixes() const { return fixes_.Waiting(); }
  std::vector<MapFix> TakeFixes(Time until) { return fixes_.Take(until); }
  std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const;
  // Half of it may be read where it gives false.
  bool Restore(Bytes saved);
  std::unique_ptr<Impl> Anew() const { return std::make_unique<Impl>(params_, vehicle_); }

  // Not saved: counters_, which are of one process; track_, of which only a part is needed.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.intake_, self.filter_, self.start_, self.history_, self.attitude_, self.velocity_);
    archive(self.depth_refusals_, self.fix_refusals_, self.refused_fixes_, self.fixes_);
    archive(self.dvl_correction_, self.started_, self.place_is_known_, self.started_at_);
    archive(self.now_, self.rates_, self.between_, self.resumed_);
  }

  StartState start_state() const { return start_.state(); }
  bool place_is_known() const { return place_is_known_; }
  NavSensorHealth health(NavSensor sensor) const;
  std::vector<SuspectedOffset> suspected_offsets() const;
  std::optional<NavState> Predicted() const;
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const {
    const StampOffset& dvl = velocity_.stamps();
    return track_.RelativeCovariance(a, b, dvl.IsSuspected() ? &dvl : nullptr);
  }
  const NavTrack& track() const { return track_; }
  const ErrorStateFilter& filter() const { return filter_; }
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

 private:
  void Count(const std::string& name, std::int64_t n = 1) { counters_[name] += n; }
  void Process();
  void Handle(const Event& event);
  void RememberForStart(const Event& event);
  void StartWith(Time t, const DvlEvent& dvl);
  void Start(Time t, const InertialRates& rates);
  void Advance(Time t, const InertialRates& rates);
  void CoastTo(Time t, const InertialRates& rates);
  void IntegrateTo(Time t, const InertialRates& rates);
  void Propagate(Time to_time, const InertialRates& from, const InertialRates& to, double dt_s);
  void Publish(Time t, const InertialRates& rates);
  void LimitSpeed(Time t);
  void Use(const Event& event, const InertialRates& rates);
  void UseSoundSpeed(const SoundSpeedEvent& water);
  DvlEvent Corrected(const DvlEvent& dvl) const;
  bool IsPossible(const DvlEvent& dvl, const InertialRates& rates);
  void UseDvl(Time t, const DvlEvent& dvl, const InertialRates& rates);
  void UseDepth(Time t, const DepthEvent& depth);
  void UseFix(Time t, const FixEvent& of_antenna);
  struct RefusedFix {
    Eigen::Vector2d off_m;  // from the filter's position, which drifts little meanwhile
    Eigen::Matrix2d covariance_m2;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.off_m, self.covariance_m2);
    }
  };
  bool OverruleByFixes(const RefusedFix& fix);
  void UseLateFix(Time t, const FixEvent& of_antenna);

  const NavigationParams params_;
  const VehicleGeometry vehicle_;
  const ErrorStateFilter::Mounting mounting_;
  const EarthModel earth_;
  std::map<std::string, std::int64_t> counters_;
  SampleIntake intake_;
  ErrorStateFilter filter_;
  NavigationStart start_;
  InertialHistory history_{kHistoryS};
  AttitudeAiding attitude_;
  VelocityAiding velocity_;
  RefusalRecord depth_refusals_;
  RefusalRecord fix_refusals_;
  std::vector<RefusedFix> refused_fixes_;  // in a row, that agree with each other
  FixKeeper fixes_;
  NavTrack track_;

  double dvl_correction_ = 1.0;  // of its velocity, for the speed of sound
  bool started_ = false;
  bool place_is_known_ = false;
  Time started_at_;
  Time now_;
  InertialRates rates_;
  std::vector<Event> between_;   // aiding since now_
  std::optional<Time> resumed_;  // the first inertial sample after a gap that is not bridged yet
};

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
  if (!imu)
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
  if (ToSeconds(t - now_) > params_.imu_gap_s)
    CoastTo(t, rates);
  else
    IntegrateTo(t, rates);
}

// Over a hole in the inertial data: what was measured in it has nothing to be placed by. Without an
// attitude at its end, one is waited for.
void DeadReckoning::Impl::CoastTo(Time t, const InertialRates& rates) {
  const AttitudeEvent* attitude = nullptr;
  std::int64_t unused = 0;
  for (const Event& event : between_) {
    const auto* newer = std::get_if<AttitudeEvent>(&event.measurement);
    if (newer && ToSeconds(t - event.time) <= params_.imu_gap_s) attitude = newer;
    if (!newer) ++unused;
  }
  if (unused > 0) Count("aiding_in_imu_gap", unused);
  if (!resumed_) resumed_ = t;
  if (!attitude) Count("imu_gap_without_attitude");
  if (!attitude && ToSeconds(t - *resumed_) < kWaitForAttitudeS) return between_.clear();
  Count("imu_gap");
  resumed_.reset();
  filter_.Coast(
      ToSeconds(t - now_), attitude ? std::optional(attitude->q_map_imu) : std::nullopt, rates);
  history_.Clear();
  attitude_.Resume(t, attitude);
  velocity_.Interrupt();
  Publish(t, rates);
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
    Propagate(stop, from, to, ToSeconds(stop - at));
    at = stop;
    from = to;
  };
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
  history_.Add(to_time, free_from, free_to, dt_s);
  attitude_.AddTurn(0.5 * (free_from.angular_rate_radps + free_to.angular_rate_radps), dt_s);
  velocity_.AddForce(force, dt_s);
  const Eigen::Vector3d acceleration = filter_.state().q_map_imu * force + earth_.gravity_mps2;
  const bool possible = acceleration.norm() <= params_.max_acceleration_mps2;
  if (!possible) Count("acceleration_limited");
  const InertialRates sound_from = attitude_.Sound(to_time, from);
  const InertialRates sound_to = attitude_.Sound(to_time, to);
  if (possible && !velocity_.accelerometers_in_doubt(to_time))
    filter_.Propagate(sound_from, sound_to, dt_s);
  else
    filter_.PropagateHoldingVelocity(sound_from, sound_to, dt_s);
}

void DeadReckoning::Impl::LimitSpeed(Time t) {
  const Eigen::Vector3d v = filter_.v_map_vehicle_mps();
  if (v.norm() <= params_.max_speed_mps) return;
  Count("speed_limited");
  const double by_lever_mps = (v - filter_.state().v_map_mps).norm();
  filter_.LimitSpeed(std::max(params_.max_speed_mps - by_lever_mps, 0.0));
  velocity_.DoubtAccelerometers(t);
}

void DeadReckoning::Impl::Publish(Time t, const InertialRates& rates) {
  between_.clear();
  now_ = t;
  rates_ = rates;
  const ErrorStateFilter::Moves& moves = filter_.moves();
  if (moves.count > 0) {
    counters_["position_moved"] = moves.count;
    counters_["position_moved_cm"] = std::llround(100.0 * moves.way_m);
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
  if (!IsPossible(dvl, rates)) return;
  velocity_.Use(t, dvl, rates.angular_rate_radps, !attitude_.refusals().since());
}

// Faster than the vehicle, the inertial unit cannot be: the DVL is wrong.
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
  Count("depth_reset");
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
    Count("fix_reset");
    filter_.TakePosition(fix.north_east_m, fix.covariance_m2);
  }
  refused_fixes_.clear();
  place_is_known_ = true;
}

// Fixes that are refused one after the other and agree with each other are right.
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

// Whoever solves the graph can take it at the time at which it was measured.
void DeadReckoning::Impl::UseLateFix(Time t, const FixEvent& of_antenna) {
  const bool taken = started_ && t >= started_at_ && !params_.fuse_position_fixes &&
                     ToSeconds(now_ - t) <= params_.window_s;
  const std::optional<NavState> then = taken ? track_.StateAt(t) : std::nullopt;
  if (!then) return Count("fix_late");
  Count("fix_taken_late");
  place_is_known_ = true;
  const Eigen::Isometry3d& T_map_vehicle = then->T_map_vehicle;
  fixes_.Keep(
      t, of_antenna.OfVehicle(T_map_vehicle.linear()), T_map_vehicle.translation().head<2>());
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

NavSensorHealth DeadReckoning::Impl::health(NavSensor sensor) const {
  const auto of = [](const RefusalRecord& record) {
    return NavSensorHealth{record.Share(), record.since()};
  };
  switch (sensor) {
    case NavSensor::kAttitude: return of(attitude_.refusals());
    case NavSensor::kDvl: return of(velocity_.refusals());
    case NavSensor::kDepth: return of(depth_refusals_);
    case NavSensor::kPositionFix: return of(fix_refusals_);
  }
  return {};
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
                        rates_,
                        Eigen::Quaterniond(mounting_.T_imu_vehicle.linear().transpose()),
                        filter_.biases().segment<3>(kGyroBias));
  for (const Event& event : intake_.waiting())
    if (const auto* imu = std::get_if<ImuEvent>(&event.measurement))
      prediction.CarryTo(event.time, imu->rates);
  return prediction.state(*velocity_covariance);
}

// --- the public face ---------------------------------------------------------------------------

DeadReckoning::DeadReckoning(const NavigationParams& params, const VehicleGeometry& vehicle)
    : impl_((CheckParams(params), std::make_unique<Impl>(params, vehicle))) {}
DeadReckoning::~DeadReckoning() = default;
DeadReckoning::DeadReckoning(DeadReckoning&&) noexcept = default;
DeadReckoning& DeadReckoning::operator=(DeadReckoning&&) noexcept = default;

void DeadReckoning::Add(const ImuSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DvlSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DepthSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const PositionFix& fix) { impl_->Add(fix); }
void DeadReckoning::AddSoundSpeed(Time t, double speed_mps) { impl_->AddSoundSpeed(t, speed_mps); }
void DeadReckoning::Finish() { impl_->Finish(); }

StartState DeadReckoning::start_state() const { return impl_->start_state(); }
bool DeadReckoning::place_is_known() const { return impl_->place_is_known(); }
std::vector<SuspectedOffset> DeadReckoning::suspected_offsets() const {
  return impl_->suspected_offsets();
}
NavSensorHealth DeadReckoning::health(NavSensor sensor) const { return impl_->health(sensor); }

std::optional<Time> DeadReckoning::latest() const { return impl_->track().latest(); }
std::optional<NavState> DeadReckoning::StateAt(Time t) const { return impl_->track().StateAt(t); }
std::optional<NavState> DeadReckoning::Predicted() const { return impl_->Predicted(); }
std::optional<Eigen::Matrix2d> DeadReckoning::VelocityCovariance(Time t) const {
  return impl_->track().VelocityCovariance(t);
}
std::optional<Eigen::Matrix3d> DeadReckoning::RelativeCovariance(Time a, Time b) const {
  return impl_->RelativeCovariance(a, b);
}
std::optional<Pose2> DeadReckoning::Hindsight(Time anchor, Time t) const {
  return impl_->track().Hindsight(anchor, t);
}
std::vector<MapFix> DeadReckoning::WaitingFixes() const { return impl_->WaitingFixes(); }
std::vector<MapFix> DeadReckoning::TakeFixes(Time until) { return impl_->TakeFixes(until); }

std::optional<std::vector<std::uint8_t>> DeadReckoning::Save(std::optional<Time> since) const {
  return impl_->Save(since);
}
bool DeadReckoning::Restore(Bytes saved) {
  std::unique_ptr<Impl> restored = impl_->Anew();
  if (!restored->Restore(saved)) return false;
  impl_ = std::move(restored);
  return true;
}

const std::map<std::string, std::int64_t>& DeadReckoning::counters() const {
  return impl_->counters();
}
InnovationSummary DeadReckoning::innovations(NavSensor sensor) const {
  return impl_->filter().innovations(sensor);
}

}  // namespace seastitch
