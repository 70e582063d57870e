#include "mapper/navigation/ins/ins_navigation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

// Longest time between samples over which attitude and depth are interpolated [s].
constexpr double kMaxGapS = 1.0;
// Time without a depth of the INS after which that of a pressure sensor is used [s].
constexpr double kInsDepthHoldsS = 5.0;
constexpr std::size_t kMaxWaiting = 20'000;  // positions that wait for an attitude
constexpr std::size_t kMostEarlyFixes = 1000;
// Longest time by which a fix may be ahead of the INS [s].
constexpr double kMaxAheadS = 5.0;
constexpr char kOfIns[] = "ins";  // source of the fixes that the INS used
// State kept over a restart: everything of the last kRememberedS; before that, one position per
// kWayStepS.
constexpr double kRememberedS = 3.0;
constexpr double kWayStepS = 1.0;
// Assumed sigmas for values without a stated one: depth, and roll and pitch, of an INS.
constexpr double kDepthSigmaM = 0.1;
constexpr double kLevelSigmaRad = Deg2Rad(0.05);
// Error of the velocity with which a state is extrapolated for some seconds: that of an INS, or of
// a velocity that is held.
constexpr double kPredictionSigmaMps = 0.1;
const Eigen::Vector2d kUnknownVelocity =
    Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());

template <class T>
void TrimTo(Time oldest, std::deque<T>* items) {
  while (items->size() > 2 && (*items)[1].time < oldest) items->pop_front();
}

// Keeps the items around `since`, all from `recent` on, and between them one per every_s (0: none).
template <class T>
std::deque<T> Thinned(const std::deque<T>& items,
                      std::optional<Time> since,
                      Time recent,
                      double every_s) {
  const auto from = since ? FirstAfter(items, *since) : items.end();
  std::deque<T> kept;
  for (auto item = items.begin(); item != items.end(); ++item) {
    const bool around = from != items.end() && (item == from || std::next(item) == from);
    const bool between = every_s > 0.0 && since && item->time > *since && !kept.empty() &&
                         ToSeconds(item->time - kept.back().time) >= every_s;
    if (around || between || item->time >= recent) kept.push_back(*item);
  }
  return kept;
}

double Share(Time from, Time t, Time to) {
  return from == to ? 0.0 : ToSeconds(t - from) / ToSeconds(to - from);
}

}  // namespace

InsNavigation::InsNavigation(const InsNavigationParams& params,
                             const NavigationParams& navigation,
                             const VehicleGeometry& vehicle)
    : params_(params),
      navigation_(navigation),
      vehicle_(vehicle),
      map_frame_(DatumOf(vehicle)),
      jumps_(params.min_jump_m, params.follow_velocity) {}
InsNavigation::~InsNavigation() = default;

// --- samples in ----------------------------------------------------------------------------------

void InsNavigation::Add(const NavigationSample& sample) {
  if (sample.status == InsStatus::kInvalid) return Count("ins_invalid");
  if (sample.status == InsStatus::kAligning) return Count("ins_aligning");
  if (sample.attitude) AddAttitude(sample);
  if (sample.depth) {
    ins_gives_depth_ = true;
    ins_depth_at_ = sample.time;
    AddDepth(sample.time, sample.depth->value_m, vehicle_.T_vehicle_imu.translation());
  }
  if (sample.position) AddPosition(sample);
  Proceed(false);
}

void InsNavigation::Add(const DepthSample& sample) {
  if (ins_gives_depth_ && !ins_depth_at_) ins_depth_at_ = sample.time;  // after a restart
  if (ins_gives_depth_ && ToSeconds(sample.time - *ins_depth_at_) <= kInsDepthHoldsS)
    return Count("depth_not_used");
  ins_gives_depth_ = false;
  if (!std::isfinite(sample.depth_m)) return Count("depth_not_finite");
  AddDepth(sample.time, sample.depth_m, vehicle_.p_vehicle_depth_m);
}

// Position fixes of other sensors go to the graph: the INS uses fixes by itself.
void InsNavigation::Add(const PositionFix& fix) {
  const Eigen::Vector2d north_east = map_frame_.NorthEastOf(fix);
  if (!(north_east.norm() < kLargestMapM)) return Count("fix_far_from_datum");
  AddFix(fix.time,
         {north_east, fix.covariance_north_east_m2, fix.source, vehicle_.FixPointOf(fix.source)});
  KeepFixes();
}

void InsNavigation::AddFix(Time t, FixEvent fix) {
  std::optional<Time> newest = last_position_;
  if (!attitudes_.empty()) newest = std::max(newest, std::optional(attitudes_.back().time));
  if (newest && t > *newest + FromSeconds(kMaxAheadS)) return tally_.CountAhead("fix");
  early_fixes_.insert(FirstAfter(early_fixes_, t), {t, std::move(fix)});
  if (early_fixes_.size() <= kMostEarlyFixes) return;
  early_fixes_.pop_front();
  Count("fix_without_pose");
}

// Groups the fixes for whose time the pose is known by now.
void InsNavigation::KeepFixes() {
  const std::optional<Time> end = latest();
  for (; end && !early_fixes_.empty() && early_fixes_.front().time <= *end;
       early_fixes_.pop_front())
    KeepFix(early_fixes_.front().time, early_fixes_.front().value);
}

void InsNavigation::KeepFix(Time t, const FixEvent& fix) {
  const std::optional<NavState> then = StateAt(t);
  if (!then) {
    const bool late = ToSeconds(*latest() - t) > navigation_.window_s;
    return late ? tally_.CountLate("fix") : Count("fix_without_pose");
  }
  const Eigen::Isometry3d& T_map_vehicle = then->T_map_vehicle;
  fixes_.Keep(t, fix.OfVehicle(T_map_vehicle.linear()), T_map_vehicle.translation().head<2>());
}

void InsNavigation::AddAttitude(const NavigationSample& sample) {
  if (!attitudes_.empty() && sample.time <= attitudes_.back().time)
    return tally_.CountLate("ins_attitude");
  const Attitude& attitude = *sample.attitude;
  const Eigen::Quaterniond q_vehicle_ins(vehicle_.T_vehicle_imu.linear());
  attitudes_.push_back({sample.time,
                        (attitude.q_ned_imu * q_vehicle_ins.conjugate()).normalized(),
                        attitude.sigma_rpy_rad.z()});
}

void InsNavigation::AddDepth(Time t, double depth_m, const Eigen::Vector3d& p_vehicle_sensor_m) {
  if (!depths_.empty() && t <= depths_.back().time) return tally_.CountLate("ins_depth");
  depths_.push_back({t, depth_m, p_vehicle_sensor_m});
}

void InsNavigation::AddPosition(const NavigationSample& sample) {
  if (last_position_ && sample.time <= *last_position_) return tally_.CountLate("ins_position");
  last_position_ = sample.time;
  const Eigen::Vector2d north_east = map_frame_.NorthEastOf(*sample.position);
  if (!(north_east.norm() < kLargestMapM)) return tally_.CountTooFar();
  JumpFinder::Position position;
  position.time = sample.time;
  position.given_m = north_east;
  if (sample.velocity) position.v_mps = sample.velocity->v_ned_mps.head<2>();
  position.sigma_m = std::sqrt(0.5) * sample.position->sigma_north_east_m.norm();
  positions_.push_back(position);
  if (positions_.size() <= kMaxWaiting) return;
  positions_.pop_front();
  Count("ins_position_without_attitude");
}

void InsNavigation::Finish() {
  finished_ = true;
  Proceed(true);
  if (!early_fixes_.empty())
    Count("fix_without_pose", static_cast<std::int64_t>(early_fixes_.size()));
  early_fixes_.clear();
}

// Finds the jumps of the INS's positions, which its velocities are of as well, and stores them as
// places of the vehicle.
void InsNavigation::Proceed(bool finish) {
  if (attitudes_.empty()) return;
  const bool has_lever = !vehicle_.T_vehicle_imu.translation().isZero();
  const auto waits_for_attitude = [&](const JumpFinder::Position& position) {
    return (has_lever || !position.v_mps) && position.time > attitudes_.back().time;
  };
  while (!positions_.empty() && (finish || !waits_for_attitude(positions_.front()))) {
    JumpFinder::Position position = positions_.front();
    positions_.pop_front();
    const auto attitude = AttitudeAt(position.time);
    if (has_lever && !attitude) {
      Count("ins_position_without_attitude");
      continue;
    }
    if (attitude)
      position.heading_rad = RpyFromRotation(attitude->q_map_vehicle.toRotationMatrix()).z();
    jumps_.Add(position);
  }
  const Time now = positions_.empty() ? attitudes_.back().time : positions_.front().time;
  for (const auto& steady : finish ? jumps_.Finish() : jumps_.Take(now)) AddPlace(steady);
  tally_.Set("ins_position_spikes", jumps_.spikes());
  KeepFixes();
  Trim();
}

void InsNavigation::AddPlace(const JumpFinder::Steady& steady) {
  Place place{steady.time, steady.steady_m, kUnknownVelocity, steady.sigma_m, 0.0, 0.0};
  const Eigen::Vector3d& lever_m = vehicle_.T_vehicle_imu.translation();
  if (!lever_m.isZero())
    place.p_map -= (AttitudeAt(steady.time)->q_map_vehicle * lever_m).head<2>();
  if (place.sigma_m <= 0.0) place.sigma_m = params_.position_sigma_m;
  if (!places_.empty()) {
    const Place& from = places_.back();
    const Eigen::Vector2d moved = place.p_map - from.p_map;
    const double dt_s = ToSeconds(place.time - from.time);
    if (dt_s <= kHoldS) place.v_map_mps = moved / dt_s;
    place.travelled_m = from.travelled_m + moved.norm();
    place.jump_variance_m2 = from.jump_variance_m2 + steady.jump_variance_m2;
  }
  if (steady.v_mps) place.v_map_mps = *steady.v_mps;
  if (!first_) first_ = place;
  places_.push_back(place);
  // After this distance the error of the random walk has become independent.
  const double walk = params_.random_walk_m_per_rtm;
  const double renewed_m = 2.0 * place.sigma_m * place.sigma_m / std::max(walk * walk, 1e-9);
  const bool known_anew =
      params_.uses_position_fixes && place.travelled_m - travelled_at_fix_m_ > renewed_m;
  if (steady.jumped) tally_.CountJump();
  if (steady.jumped || known_anew) GiveFix(steady);
}

void InsNavigation::GiveFix(const JumpFinder::Steady& steady) {
  const double sigma_m = places_.back().sigma_m;
  travelled_at_fix_m_ = places_.back().travelled_m;
  AddFix(steady.time,
         {steady.given_m,
          sigma_m * sigma_m * Eigen::Matrix2d::Identity(),
          kOfIns,
          vehicle_.T_vehicle_imu.translation()});
}

void InsNavigation::Trim() {
  if (places_.empty()) return;
  const Time oldest = places_.back().time - FromSeconds(navigation_.window_s);
  TrimTo(oldest, &attitudes_);
  TrimTo(oldest, &depths_);
  TrimTo(oldest, &places_);
}

// --- states out ----------------------------------------------------------------------------------

std::optional<Time> InsNavigation::latest() const {
  if (attitudes_.empty() || depths_.empty() || places_.empty()) return std::nullopt;
  const bool moves = places_[0].v_map_mps.allFinite() || places_.size() > 1;
  if (!moves && !finished_) return std::nullopt;  // how fast is not known yet
  const Time held = places_.back().time + FromSeconds(kHoldS);
  const bool none_comes =
      finished_ || (jumps_.empty() && positions_.empty() && attitudes_.back().time > held);
  const Time placed = none_comes ? held : places_.back().time;
  return std::min({attitudes_.back().time, depths_.back().time, placed});
}

std::optional<InsNavigation::AttitudeRecord> InsNavigation::AttitudeAt(Time t) const {
  const auto next = FirstAfter(attitudes_, t);
  if (next == attitudes_.begin()) return std::nullopt;
  const AttitudeRecord& a = *std::prev(next);
  if (a.time == t) return a;
  if (next == attitudes_.end() || ToSeconds(next->time - a.time) > kMaxGapS) return std::nullopt;
  return AttitudeRecord{t,
                        a.q_map_vehicle.slerp(Share(a.time, t, next->time), next->q_map_vehicle),
                        a.heading_sigma_rad};
}

std::optional<double> InsNavigation::DepthAt(Time t,
                                             const Eigen::Quaterniond& q_map_vehicle) const {
  const auto next = FirstAfter(depths_, t);
  if (next == depths_.begin()) return std::nullopt;
  const DepthRecord& a = *std::prev(next);
  const double lever_m = (q_map_vehicle * a.p_vehicle_sensor_m).z();
  if (a.time == t) return a.depth_m - lever_m;
  if (next == depths_.end() || ToSeconds(next->time - a.time) > kHoldS) return std::nullopt;
  const double w = Share(a.time, t, next->time);
  return a.depth_m + w * (next->depth_m - a.depth_m) - lever_m;
}

std::optional<InsNavigation::Place> InsNavigation::PlaceAt(Time t) const {
  const auto next = FirstAfter(places_, t);
  if (next == places_.begin()) return BeforeFirst(t);
  Place place = *std::prev(next);
  const double since_s = ToSeconds(t - place.time);
  if (since_s == 0.0) return place;
  const Eigen::Vector2d from = place.p_map;
  if (next != places_.end() && ToSeconds(next->time - place.time) <= kHoldS) {
    const double w = Share(place.time, t, next->time);
    place.p_map += w * (next->p_map - place.p_map);
    if (place.v_map_mps.allFinite())
      place.v_map_mps += w * (next->v_map_mps - place.v_map_mps);
    else
      place.v_map_mps = next->v_map_mps;
  } else if (since_s <= kHoldS && place.v_map_mps.allFinite()) {
    place.p_map += since_s * place.v_map_mps;
  } else {
    return std::nullopt;
  }
  place.travelled_m += (place.p_map - from).norm();
  place.time = t;
  return place;
}

// Extrapolates to a time before the first position, with the velocity of the first two.
std::optional<InsNavigation::Place> InsNavigation::BeforeFirst(Time t) const {
  if (places_.empty() || places_.front().time != first_->time) return std::nullopt;
  Place place = places_.front();
  const double before_s = ToSeconds(place.time - t);
  if (!place.v_map_mps.allFinite() && places_.size() > 1) place.v_map_mps = places_[1].v_map_mps;
  if (before_s > kHoldS || !place.v_map_mps.allFinite()) return std::nullopt;
  const Eigen::Vector2d back = before_s * place.v_map_mps;
  place.p_map -= back;
  place.travelled_m -= back.norm();
  place.time = t;
  return place;
}

std::optional<NavState> InsNavigation::Predicted() const {
  const std::optional<Time> end = latest();
  std::optional<NavState> state = end ? StateAt(*end) : std::nullopt;
  if (!state || !PlaceAt(*end)->v_map_mps.allFinite()) return state;
  const Duration hold = FromSeconds(kHoldS);
  const Time until =
      std::min({attitudes_.back().time, depths_.back().time + hold, *last_position_ + hold});
  for (const JumpFinder::Position& position : jumps_.Waiting())
    if (position.time <= until) CarryTo(position.time, position.v_mps, &*state);
  CarryTo(until, std::nullopt, &*state);
  const double further_m = kPredictionSigmaMps * ToSeconds(state->time - *end);
  const double sigma_m = std::sqrt(state->covariance(0, 0)) + further_m;
  state->covariance(0, 0) = state->covariance(1, 1) = sigma_m * sigma_m;
  return state;
}

// Extrapolates a state with this velocity at t; without one, with its velocity in vehicle axes. The
// depth is that of its last sample.
void InsNavigation::CarryTo(Time t,
                            const std::optional<Eigen::Vector2d>& v_map_mps,
                            NavState* state) const {
  const auto attitude = AttitudeAt(t);
  if (!attitude || t <= state->time) return;
  const Eigen::Matrix3d R = attitude->q_map_vehicle.toRotationMatrix();
  const double turn_rad =
      RpyFromRotation(R).z() - RpyFromRotation(state->T_map_vehicle.linear()).z();
  const Eigen::Vector2d before_mps = state->v_map_mps.head<2>();
  const Eigen::Vector2d now_mps =
      v_map_mps ? *v_map_mps : Pose2{0.0, 0.0, turn_rad}.Rotation() * before_mps;
  state->T_map_vehicle.translation().head<2>() +=
      0.5 * ToSeconds(t - state->time) * (before_mps + now_mps);
  state->v_map_mps.head<2>() = now_mps;
  state->T_map_vehicle.linear() = R;
  if (const auto depth_m = DepthAt(std::min(t, depths_.back().time), attitude->q_map_vehicle))
    state->T_map_vehicle.translation().z() = *depth_m;
  const HeadingError heading = HeadingErrorAt(attitude->heading_sigma_rad);
  state->covariance(5, 5) = heading.constant2 + heading.wander2;
  state->time = t;
}

std::optional<NavState> InsNavigation::StateAt(Time t) const {
  const std::optional<Time> end = latest();
  if (!end || t > *end) return std::nullopt;
  const auto place = PlaceAt(t);
  const auto attitude = AttitudeAt(t);
  if (!place || !attitude) return std::nullopt;
  const auto depth_m = DepthAt(t, attitude->q_map_vehicle);
  if (!depth_m) return std::nullopt;
  NavState state;
  state.time = t;
  state.T_map_vehicle = MakePose({place->p_map.x(), place->p_map.y(), *depth_m},
                                 attitude->q_map_vehicle.toRotationMatrix());
  if (place->v_map_mps.allFinite()) state.v_map_mps << place->v_map_mps, 0.0;
  const HeadingError heading = HeadingErrorAt(attitude->heading_sigma_rad);
  const double heading2 = heading.constant2 + heading.wander2;
  const double travelled_m = place->travelled_m - first_->travelled_m;
  const double walk = params_.random_walk_m_per_rtm;
  const double far2 = (place->p_map - first_->p_map).squaredNorm();
  const double sideways2 = params_.uses_position_fixes ? 0.0 : heading2;
  const double position2 = place->sigma_m * place->sigma_m + walk * walk * travelled_m +
                           (sideways2 + params_.distance_ratio * params_.distance_ratio) * far2 +
                           place->jump_variance_m2;
  const double level2 = kLevelSigmaRad * kLevelSigmaRad;
  state.covariance.diagonal() << position2, position2, kDepthSigmaM * kDepthSigmaM, level2, level2,
      heading2;
  state.bottom_lock = true;  // unknown for an INS
  return state;
}

Time InsNavigation::AfterGap(Time t) const {
  const auto next = FirstAfter(attitudes_, t);
  if (next == attitudes_.end()) return t;
  if (next == attitudes_.begin()) return next->time;
  const Time last = std::prev(next)->time;
  return last == t || ToSeconds(next->time - last) <= kMaxGapS ? t : next->time;
}

// --- over a restart ------------------------------------------------------------------------------

std::optional<std::vector<std::uint8_t>> InsNavigation::Save(std::optional<Time> since) const {
  const std::optional<Time> end = latest();
  if (!end) return std::nullopt;
  const Time recent = *end - FromSeconds(kRememberedS);
  ArchiveWriter archive;
  History(archive,
          Thinned(attitudes_, since, recent, 0.0),
          Thinned(depths_, since, recent, 0.0),
          Thinned(places_, since, recent, kWayStepS));
  Fields(archive, *this);
  return archive.Release();
}

bool InsNavigation::Restore(Bytes saved) {
  InsNavigation read(params_, navigation_, vehicle_);
  ArchiveReader archive(saved);
  History(archive, read.attitudes_, read.depths_, read.places_);
  Fields(archive, read);
  if (!archive.IsDone() || !read.first_ || !read.latest()) return false;
  ArchiveReader again(saved);
  History(again, attitudes_, depths_, places_);
  Fields(again, *this);
  return true;
}

StartState InsNavigation::start_state() const {
  if (attitudes_.empty()) return StartState::kNoGivenAttitude;
  if (places_.empty()) return StartState::kNoGivenPosition;
  return depths_.empty() ? StartState::kNoGivenDepth : StartState::kStarted;
}

std::optional<Pose2> InsNavigation::Hindsight(Time anchor, Time t) const {
  if (!PlaceAt(anchor) || !PlaceAt(t)) return std::nullopt;
  return Pose2{};
}

}  // namespace seastitch
