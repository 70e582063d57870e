#include "survey/plan/survey_files.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <variant>

#include "common/core/pose.hpp"
#include "survey/plan/survey_census.hpp"
#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kVelocityHoldS = 0.5;
// Longest time between two headings over which heading is interpolated.
constexpr double kMaxHeadingGapS = 2.0;

}  // namespace

bool SurveyFiles::IsSurveyFile(const fs::path& path) { return ReaderFor(path) != nullptr; }

SurveyFiles::SurveyFiles(SurveyPlan plan)
    : plan_(std::move(plan)),
      water_line_m_(plan_.installation.water_line_m),
      warnings_(plan_.warnings),
      profiles_(plan_.profiles) {
  for (const PlannedFile& file : plan_.files) inputs_.push_back({file, fs::file_size(file.path)});
  for (Input& input : inputs_) waiting_.push_back(&input);
  std::stable_sort(waiting_.begin(), waiting_.end(), [](const Input* a, const Input* b) {
    return b->file.begin < a->file.begin;
  });
}
SurveyFiles::~SurveyFiles() = default;

// --- records to samples --------------------------------------------------------------------------

void SurveyFiles::Coverage::AddSample(Time t, double hold_s) {
  for (; !pings.empty() && pings.front() <= t; pings.pop_front()) {
    const bool after = last && pings.front() >= *last;
    const bool between = after && ToSeconds(t - *last) <= max_gap_s;
    const bool held = (after && ToSeconds(pings.front() - *last) <= hold_s) ||
                      (!last && ToSeconds(t - pings.front()) <= hold_s);
    const bool at_once = pings.front() == t;
    if (!between && !held && !at_once) ++uncovered;
  }
  last = t;
}

std::int64_t SurveyFiles::Coverage::Uncovered(double hold_s) const {
  const auto is_held = [&](Time t) { return last && t >= *last && ToSeconds(t - *last) <= hold_s; };
  return uncovered + std::count_if(pings.begin(), pings.end(), std::not_fn(is_held));
}

struct SurveyFiles::Use {
  SurveyFiles* self;
  void operator()(const NavigationRecord& n) { self->OnNavigation(n); }
  void operator()(const MbesPing& ping) { self->OnPing(ping); }
  void operator()(const PlacedPing& ping) { self->OnPlaced(ping); }
  // With the time of its use instead of that of its cast: the mapper takes the profile nearest in
  // time, and a sonar may be given an older cast again.
  void operator()(SoundVelocityProfile profile) {
    if (self->plan_.own_profiles_unused) return;
    profile.time = self->now_;
    self->rays_ = RayTracer::Make(profile);
    self->samples_.Put(std::move(profile), self->now_);
  }
  // The water line is followed; a moved array is another dive (GroupSurveyFiles).
  void operator()(const SonarInstallation& installation) {
    const SonarInstallation& used = self->plan_.installation;
    if (installation.model == used.model &&
        installation.transmitters.size() == used.transmitters.size())
      self->water_line_m_ = installation.water_line_m;
  }
  template <class T>
  void operator()(const T&) {}
};

// The input with the earliest record. Opens those that begin before it.
SurveyFiles::Input* SurveyFiles::Earliest() {
  const auto next = [](const Input* input) { return input->stream->next(); };
  for (;; waiting_.pop_back()) {
    const auto first =
        std::min_element(open_.begin(), open_.end(), [&next](const Input* a, const Input* b) {
          return next(a) < next(b);
        });
    Input* const earliest = first == open_.end() ? nullptr : *first;
    if (waiting_.empty()) return earliest;
    if (earliest != nullptr && next(earliest) <= waiting_.back()->file.begin) return earliest;
    Open(waiting_.back());
  }
}

void SurveyFiles::Open(Input* input) {
  input->stream = std::make_unique<SurveyStream>(input->file.path, kReorderS, input->file.params);
  open_.push_back(input);
  CloseIfEnded(input);
}

void SurveyFiles::CloseIfEnded(Input* input) {
  if (input->stream->next()) return;
  for (const auto& [name, value] : input->stream->counters()) counters_[name] += value;
  const std::string name = input->file.path.filename().string();
  if (const std::uint64_t missing = input->stream->missing(); missing > 0)
    warnings_.push_back({WarningCode::kFileCutOff,
                         name + " is cut off: its head states " + std::to_string(missing) +
                             " more records than it has; copy it again"});
  const std::int64_t left_out = input->stream->pings_left_out(),
                     all = input->stream->pings() + left_out;
  if (100 * left_out > all)
    warnings_.push_back({WarningCode::kPingsLost,
                         name + ": " + std::to_string(left_out) + " of " + std::to_string(all) +
                             " pings are left out, because their stamps are far from those around "
                             "them in the file"});
  if (input->stream->is_out_of_order())
    warnings_.push_back({WarningCode::kFileOutOfOrder,
                         name + " is not in the order of time, and what comes late is lost (" +
                             std::to_string(input->stream->late()) +
                             " records); give its parts as files of their own"});
  bytes_closed_ += input->bytes;
  input->stream.reset();
  std::erase(open_, input);
}

std::optional<Received> SurveyFiles::Next() {
  std::optional<Received> sample;
  while (!(sample = samples_.Take()) && ReadNext()) {
  }
  return sample;
}

bool SurveyFiles::ReadNext() {
  Input* const input = Earliest();
  if (input == nullptr) return false;
  file_ = static_cast<std::size_t>(input - inputs_.data());
  now_ = std::max(now_, *input->stream->next());
  const SurveyRecord record = input->stream->Take();
  CloseIfEnded(input);
  for (SoundVelocityProfile& profile : std::exchange(profiles_, {})) {
    if (!rays_) rays_ = RayTracer::Make(profile);
    samples_.Put(std::move(profile), now_);
  }
  std::visit(Use{this}, record);
  return true;
}

void SurveyFiles::PutDepth(Time t, double depth_m) {
  depth_m_ = depth_m;
  depth_time_ = t;
  DepthSample sample;
  sample.time = t;
  sample.depth_m = depth_m;
  sample.sigma_m = 0.1;
  samples_.Put(std::move(sample), now_);
}

// Gives the water line as a height of the point that positions refer to.
void SurveyFiles::PutWaterLine(Time t, double height_m) {
  if (!depth_m_ || !q_ned_vehicle_) return;
  const Eigen::Vector3d p_depth_ins_m =
      plan_.vehicle.T_vehicle_imu.translation() - plan_.vehicle.p_vehicle_depth_m;
  NavigationSample sample;
  sample.time = t;
  sample.source = "h";
  sample.height = InsVertical{height_m - *depth_m_ - (*q_ned_vehicle_ * p_depth_ins_m).z(), 0.0};
  samples_.Put(std::move(sample), now_);
}

bool SurveyFiles::Choice::Uses(const NavigationRecord& n, const std::string& chosen) {
  const bool is_chosen = n.source == chosen;
  if (is_chosen || !chosen_time) chosen_time = n.time;
  if (is_chosen) return true;
  const double silent_s = IsExternal(chosen) ? 60.0 : 5.0;
  if (IsExternal(n.source) || ToSeconds(n.time - *chosen_time) <= silent_s) return false;
  if (n.source != substitute && ToSeconds(n.time - substitute_time) <= silent_s) return false;
  substitute = n.source;
  substitute_time = n.time;
  return true;
}

bool SurveyFiles::UsesPosition(const NavigationRecord& n) {
  if (!n.position && !n.grid_north_east_m) return false;
  const bool is_chosen = n.source == plan_.position_source;
  if (!is_chosen && (!n.position || plan_.grid_origin_m)) return false;
  const bool uses = position_choice_.Uses(n, plan_.position_source);
  if (uses && !is_chosen) ++counters_["survey_positions_of_another_source"];
  return uses;
}

bool SurveyFiles::UsesAttitude(const NavigationRecord& n) {
  const bool is_chosen = n.source == plan_.attitude_source;
  const bool is_sparse = plan_.raw_pings && IsOfPings(n.source);
  if (!n.attitude || (!is_chosen && (is_sparse || !plan_.heading_source.empty()))) return false;
  const bool uses = attitude_choice_.Uses(n, plan_.attitude_source);
  if (uses && !is_chosen) ++counters_["survey_attitudes_of_another_source"];
  return uses;
}

// The position of the point that the chosen source's positions are of.
GeoPosition SurveyFiles::AtChosenPoint(const NavigationRecord& n) const {
  GeoPosition position = *n.position;
  if (n.source == plan_.position_source || !q_ned_vehicle_) return position;
  const Eigen::Vector3d p_ned_m =
      *q_ned_vehicle_ * (plan_.vehicle.T_vehicle_imu.translation() - plan_.PointOf(n.source));
  position.latitude_rad += p_ned_m.x() / kMeanEarthRadiusM;
  position.longitude_rad += p_ned_m.y() / (kMeanEarthRadiusM * std::cos(position.latitude_rad));
  return position;
}

void SurveyFiles::OnNavigation(const NavigationRecord& n) {
  if (n.velocity) {
    velocity_ = n.velocity;
    velocity_time_ = n.time;
    velocity_source_ = n.source;
  }
  const bool uses_attitude = UsesAttitude(n);
  if (uses_attitude) OnAttitude(n.time, *n.attitude, n);
  if (n.source == plan_.attitude_source && !n.attitude && n.roll_pitch_rad && levels_.size() < 1000)
    levels_.push_back(n);
  const double depth_at_rest_m = plan_.vehicle.p_vehicle_depth_m.z() - water_line_m_;
  // Heave of the sensor that replaces a silent one.
  const bool replaces_heave = uses_attitude && plan_.heave_source == plan_.attitude_source;
  const bool uses_heave = n.source == plan_.heave_source || replaces_heave;
  if (plan_.depth == SurveyPlan::Depth::kHeave && uses_heave && n.heave_m)
    PutDepth(n.time, *n.heave_m + depth_at_rest_m);
  if (n.source == plan_.heading_source && n.heading_rad) OnHeading(n.time, *n.heading_rad);
  if (plan_.depth == SurveyPlan::Depth::kNavigation && n.source == plan_.depth_source && n.depth_m)
    PutDepth(n.time, *n.depth_m);
  if (n.water_line_height_m) PutWaterLine(n.time, *n.water_line_height_m);
  if (!UsesPosition(n)) return;
  NavigationSample sample;
  sample.time = n.time;
  sample.source = n.source;
  sample.position = n.position ? AtChosenPoint(n) : plan_.FromGrid(*n.grid_north_east_m);
  sample.velocity = VelocityAtPosition(n.time);
  if (n.height_m) sample.height = InsVertical{*n.height_m, 0.0};
  AddLevel(n.time);
  samples_.Put(std::move(sample), now_);
  position_.AddSample(n.time, position_.max_gap_s);
  if (n.source == plan_.position_source)
    chosen_position_.AddSample(n.time, chosen_position_.max_gap_s);
}

// Velocity of the point that positions are of. Where the velocity is that of another point, the
// mean motion of the one relative to the other since the last position is added.
std::optional<GeoVelocity> SurveyFiles::VelocityAtPosition(Time t) {
  if (!velocity_ || velocity_time_ > t || ToSeconds(t - velocity_time_) > kVelocityHoldS)
    return std::nullopt;
  GeoVelocity velocity{velocity_->v_ned_mps, velocity_->sigma_ned_mps};
  const Eigen::Vector3d p_vehicle_m =
      plan_.PointOf(plan_.position_source) - plan_.PointOf(velocity_source_);
  if (p_vehicle_m.isZero()) {
    lever_.reset();
    return velocity;
  }
  if (!q_ned_vehicle_) return std::nullopt;
  const Lever now{t, velocity_source_, *q_ned_vehicle_ * p_vehicle_m};
  const std::optional<Lever> before = std::exchange(lever_, now);
  if (!before || before->source != now.source || before->time >= t ||
      ToSeconds(t - before->time) > position_.max_gap_s)
    return std::nullopt;
  velocity.v_ned_mps += (now.p_ned_m - before->p_ned_m) / ToSeconds(t - before->time);
  return velocity;
}

// Attitude of a vehicle of which only the track is known.
void SurveyFiles::AddLevel(Time t) {
  const auto vehicle = plan_.level_track ? plan_.level_track->At(t) : std::nullopt;
  if (!vehicle) return;
  NavigationRecord level;
  level.source = plan_.attitude_source;
  const Attitude attitude{Eigen::Quaterniond(RotationFromRpy(0.0, 0.0, vehicle->heading_rad))};
  OnAttitude(t, attitude, level);
}

void SurveyFiles::OnAttitude(Time t, const Attitude& attitude, const NavigationRecord& n) {
  NavigationSample sample;
  sample.time = t;
  sample.source = n.source;
  sample.attitude = attitude;
  // From the sensor's axes to the vehicle's.
  if (const InstalledSensor* const sensor = plan_.SensorOf(n.source))
    sample.attitude->q_ned_imu =
        (attitude.q_ned_imu * Eigen::Quaterniond(sensor->T_vehicle_sensor.linear()).conjugate())
            .normalized();
  q_ned_vehicle_ = sample.attitude->q_ned_imu;
  samples_.Put(std::move(sample), now_);
  attitude_.AddSample(t, 0.0);
}

// For sensors with a separate heading: roll and pitch wait for the next heading.
void SurveyFiles::OnHeading(Time t, double heading_rad) {
  for (; !levels_.empty() && levels_.front().time <= t; levels_.pop_front()) {
    const NavigationRecord& n = levels_.front();
    double yaw = heading_rad;
    const bool gap = heading_ && ToSeconds(t - heading_->time) > kMaxHeadingGapS;
    if (heading_ && !gap && heading_->time <= n.time && heading_->time < t) {
      const double w = ToSeconds(n.time - heading_->time) / ToSeconds(t - heading_->time);
      yaw = heading_->heading_rad + w * WrapAngle(heading_rad - heading_->heading_rad);
    } else if (gap || ToSeconds(t - n.time) > attitude_.max_gap_s) {
      ++counters_["survey_attitude_without_heading"];
      continue;
    }
    const Eigen::Vector2d& level = *n.roll_pitch_rad;
    OnAttitude(n.time, Attitude{Eigen::Quaterniond(RotationFromRpy(level.x(), level.y(), yaw))}, n);
  }
  heading_ = Turn{t, heading_rad};
}

// True for a ping that another file had as well.
bool SurveyFiles::IsRepeated(Time t, const PingId& id) {
  if (t != std::exchange(ping_time_, t)) pings_at_time_.clear();
  const bool repeated =
      std::find(pings_at_time_.begin(), pings_at_time_.end(), id) != pings_at_time_.end();
  if (repeated)
    ++counters_["survey_pings_repeated"];
  else
    pings_at_time_.push_back(id);
  return repeated;
}

void SurveyFiles::OnPing(const MbesPing& ping) {
  if (!plan_.raw_pings) return;
  double sum = 0.0;
  for (const MbesBeam& beam : ping.beams) sum += double{beam.twtt_s};
  if (IsRepeated(ping.time, {ping.head, ping.ping_number, sum})) return;
  ++pings_;
  attitude_.AddPing(ping.time);
  position_.AddPing(ping.time);
  chosen_position_.AddPing(ping.time);
  MbesPing used = ping;
  // Near the reference point the profile changes by less than 0.1 m/s.
  if (plan_.profile_alone && rays_) used.sound_speed_mps = rays_->SpeedAt(depth_m_.value_or(0.0));
  samples_.Put(std::move(used), now_);
}

// Echoes come between pings: navigation interpolates depths that are at most a second apart.
void SurveyFiles::OnDepthOfPing(const PlacedPing& ping) {
  constexpr double kStepS = 0.8;
  constexpr double kLongestS = 60.0;
  const double to_m = *ping.origin_depth_m - (plan_.raw_pings ? 0.0 : ping.p_vehicle_origin_m.z());
  const double from_m = depth_m_.value_or(to_m);
  const double gap_s = depth_m_ ? ToSeconds(ping.time - depth_time_) : 0.0;
  const int steps = gap_s < kLongestS ? static_cast<int>(gap_s / kStepS) : 0;
  for (int i = steps; i >= 1; --i) {
    const double left = i / (steps + 1.0);
    PutDepth(ping.time - FromSeconds(left * gap_s), to_m + left * (from_m - to_m));
  }
  PutDepth(ping.time, to_m);
}

void SurveyFiles::OnPlaced(const PlacedPing& ping) {
  if (on_placed_ping_) on_placed_ping_(ping);
  if (plan_.raw_pings && inputs_[file_].file.placed_alone) {
    ++counters_["survey_pings_not_used"];
    return;
  }
  if (plan_.depth == SurveyPlan::Depth::kPing && ping.origin_depth_m) OnDepthOfPing(ping);
  if (plan_.raw_pings) return;
  double sum = 0.0;
  for (const PlacedBeam& beam : ping.soundings) sum += double{beam.p_level_m.z()};
  if (IsRepeated(ping.time, {ping.head, ping.ping_number, sum})) return;
  ++pings_;
  attitude_.AddPing(ping.time);
  position_.AddPing(ping.time);
  chosen_position_.AddPing(ping.time);
  AddLevel(ping.time);
  SoundingPing soundings{ping.time, ping.ping_number, ping.head, {}};
  for (const PlacedBeam& beam : ping.soundings)
    soundings.soundings.push_back(
        {beam.p_level_m + ping.p_vehicle_origin_m.cast<float>(), beam.sigma_z_m, beam.flags});
  samples_.Put(std::move(soundings), now_);
}

// --- what it came to -----------------------------------------------------------------------------

std::uint64_t SurveyFiles::bytes() const {
  std::uint64_t sum = 0;
  for (const Input& input : inputs_) sum += input.bytes;
  return sum;
}

std::uint64_t SurveyFiles::bytes_read() const {
  std::uint64_t sum = bytes_closed_;
  for (const Input* const input : open_) sum += input->stream->bytes_read();
  return sum;
}

Counters SurveyFiles::counters() const {
  Counters all = counters_;
  if (pings_ > 0) all["survey_pings"] = pings_;
  all.merge(samples_.counters());
  for (const Input* const input : open_)
    for (const auto& [name, value] : input->stream->counters()) all[name] += value;
  all["survey_pings_without_attitude"] = attitude_.Uncovered(0.0);
  all["survey_pings_without_position"] = position_.Uncovered(position_.max_gap_s);
  return all;
}

std::optional<std::string> SurveyFiles::Outcome() const {
  const std::string file = plan_.files[0].path.string();
  if (pings_ == 0) return file + ": no sounding in it";
  if (position_.Uncovered(position_.max_gap_s) == pings_)
    return file + ": none of its " + std::to_string(pings_) +
           " pings lies within 2 s of a position";
  if (IsExternal(plan_.position_source) &&
      chosen_position_.Uncovered(chosen_position_.max_gap_s) == pings_)
    return file + ": none of its " + std::to_string(pings_) +
           " pings lies within a minute of a position of the navigation beside it";
  if (attitude_.Uncovered(0.0) == pings_)
    return file + ": none of its " + std::to_string(pings_) + " pings lies within its attitude";
  return std::nullopt;
}

}  // namespace seastitch
