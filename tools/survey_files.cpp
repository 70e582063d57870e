#include "tools/survey_files.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <utility>
#include <variant>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "tools/message_types.hpp"
#include "tools/sbet_beside.hpp"
#include "tools/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Bytes of each file that are read to find out its content.
constexpr std::uint64_t kHeadBytes = 16 * 1024 * 1024;
constexpr double kVelocityHoldS = 0.5;

// Latitude and longitude of a point of a local grid whose origin stands for the datum.
GivenPosition FromGrid(const Eigen::Vector2d& north_east_m) {
  static const GeographicLib::LocalCartesian grid(0.0, 0.0, 0.0);
  double latitude_deg = 0.0, longitude_deg = 0.0, height_m = 0.0;
  grid.Reverse(north_east_m.y(), north_east_m.x(), 0.0, latitude_deg, longitude_deg, height_m);
  return {Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
}

// Contents of the files' first parts, counted by source.
struct Census {
  std::map<std::string, std::int64_t> positions, attitudes, levels, headings, heaves, depths;
  std::optional<GivenPosition> first_position;
  std::optional<Eigen::Vector2d> first_grid;
  std::map<std::string, GivenPosition> first_of_source;
  std::optional<SonarInstallation> installation;
  std::int64_t raw = 0;
  std::int64_t placed = 0;
  std::int64_t placed_with_depth = 0;

  // Times, depths and ranges of the raw pings, or of the placed ones.
  struct Reach {
    std::vector<double> depths_m;
    double max_range_m = 0.0;
    std::set<Time> times;
    void Add(Time time, const std::vector<Eigen::Vector2d>& across_down_m) {
      times.insert(time);
      for (const Eigen::Vector2d& p : across_down_m) {
        max_range_m = std::max(max_range_m, p.norm());
        depths_m.push_back(p.y());
      }
    }
  } raw_reach, placed_reach;

  void operator()(const MbesPing& ping) {
    ++raw;
    std::vector<Eigen::Vector2d> soundings;
    for (const MbesBeam& beam : ping.beams) {
      if ((beam.flags & kBeamValid) == 0 || !IsPlausible(beam)) continue;
      const double range_m = 750.0 * double{beam.twtt_s};
      soundings.emplace_back(range_m * std::sin(double{beam.rx_angle_rad}),
                             range_m * std::cos(double{beam.rx_angle_rad}));
    }
    raw_reach.Add(ping.time, soundings);
  }
  void operator()(const PlacedPing& ping) {
    ++placed;
    std::vector<Eigen::Vector2d> soundings;
    for (const PlacedBeam& beam : ping.soundings)
      if ((beam.flags & kBeamValid) != 0)
        soundings.emplace_back(double{beam.p_level_m.y()}, double{beam.p_level_m.z()});
    placed_reach.Add(ping.time, soundings);
    if (ping.origin_depth_m) ++placed_with_depth;
  }
  void operator()(const NavigationRecord& n) {
    if (n.position && first_of_source.emplace(n.source, *n.position).second && !first_position)
      first_position = n.position;
    if (n.grid_north_east_m && !first_grid) first_grid = n.grid_north_east_m;
    positions[n.source] += n.position || n.grid_north_east_m ? 1 : 0;
    attitudes[n.source] += n.attitude ? 1 : 0;
    levels[n.source] += n.roll_pitch_rad ? 1 : 0;
    headings[n.source] += n.heading_rad ? 1 : 0;
    heaves[n.source] += n.heave_m ? 1 : 0;
    depths[n.source] += n.depth_m ? 1 : 0;
  }
  void operator()(const SoundVelocityProfile&) {}
  void operator()(const SurfaceSoundSpeed&) {}
  void operator()(const SonarInstallation& i) {
    if (!installation) installation = i;
  }
  void operator()(const SonarSettings&) {}
};

void Look(const fs::path& file, const SbetParams& sbet, Census* census) {
  const auto reader = ReaderFor(file, sbet);
  if (!reader) throw DataError(file.string() + ": no survey file of a format that is known");
  std::ifstream in(file, std::ios::binary);
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < kHeadBytes;) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    read += got;
    for (const SurveyRecord& record : reader->Add(Bytes(piece.data(), got)))
      std::visit(*census, record);
  }
  for (const SurveyRecord& record : reader->Finish()) std::visit(*census, record);
}

// The source with most records among those with this prefix.
std::string Most(const std::map<std::string, std::int64_t>& counts,
                 const std::string& prefix = "") {
  std::string best;
  std::int64_t most = 0;
  for (const auto& [source, count] : counts)
    if (source.starts_with(prefix) && count > most) best = source, most = count;
  return best;
}

bool IsPositionSensor(const InstalledSensor& s) {
  return s.name.starts_with("P") || s.name == "position";
}

const InstalledSensor* ActiveSensor(const SonarInstallation& installation, bool position) {
  for (const InstalledSensor& sensor : installation.sensors)
    if (sensor.active && IsPositionSensor(sensor) == position) return &sensor;
  return nullptr;
}

// Processed navigation beside the files is there on purpose: it comes before the files' own.
constexpr char kSbet[] = "sbet";
constexpr char kText[] = "text";  // text navigation, by a map of columns that the user has written

// The source with most records among the sonar's own.
std::string MostOwn(std::map<std::string, std::int64_t> counts) {
  std::erase_if(counts, [](const auto& entry) { return IsBeside(entry.first); });
  return Most(counts);
}

// Source of position: a pure position sensor comes before an INS's position, as in the makers'
// programs; in `.all`, "A" comes before "n".
std::string PositionSource(const Census& census, const SonarInstallation& installation) {
  if (const std::string beside = BesideAmong(census.positions); !beside.empty()) return beside;
  if (const InstalledSensor* const active = ActiveSensor(installation, true)) {
    const std::string number = active->name.substr(active->name.size() - 1);
    for (const std::string& name : {active->name, "#SPO" + number, std::string("#SPO")})
      if (const auto best = Most(census.positions, name); !best.empty()) return best;
  }
  for (const char* const alone : {"#SPO", "P", "xtf_position", "1003", "1015"})
    if (const auto best = Most(census.positions, alone); !best.empty()) return best;
  return Most(census.positions);
}

// Source of attitude. Text has one line per ping or second: the files' own motion is finer.
std::string AttitudeSource(const Census& census) {
  if (!Most(census.attitudes, kSbet).empty()) return kSbet;
  if (const std::string em = Most(census.attitudes, "A"); !em.empty()) return em;
  const std::string own = MostOwn(census.attitudes);
  return own.empty() && MostOwn(census.levels).empty() ? Most(census.attitudes) : own;
}

// Source of heave. An SBET contains none: that of the motion sensor is used.
std::string HeaveSource(const Census& census, const std::string& attitude_source) {
  if (attitude_source == kSbet) return MostOwn(census.heaves);
  const auto own = census.heaves.find(attitude_source);
  return own != census.heaves.end() && own->second > 0 ? attitude_source : std::string();
}

// Position of a transmitter; if it has three parts, of the middle one.
Eigen::Isometry3d Centre(const InstalledArray& transmitter) {
  return transmitter.At(transmitter.centres_m.size() / 2);
}

VehicleGeometry VehicleOf(const SurveyPlan& plan) {
  VehicleGeometry vehicle;
  const SonarInstallation& i = plan.installation;
  if (const InstalledArray* const tx = i.TransmitterOf(0)) vehicle.T_mbes_tx = Centre(*tx);
  if (const InstalledArray* const rx = i.ReceiverOf(0)) vehicle.T_mbes_rx = rx->At(0);
  const bool both = !i.transmitters.empty() && !i.receivers.empty();
  const std::size_t heads = both ? std::max(i.transmitters.size(), i.receivers.size()) : 1;
  for (std::size_t head = 1; head < heads; ++head)
    vehicle.more_heads.push_back({Centre(*i.TransmitterOf(head)), i.ReceiverOf(head)->At(0)});
  // The lever arm is that of the position sensor, which may be another than the attitude sensor.
  // #SPO already refers to the reference point, as #MRZ does.
  if (IsBeside(plan.position_source) || plan.position_source.starts_with("#SPO")) return vehicle;
  const bool alone = plan.position_source != plan.attitude_source;
  const InstalledSensor* const sensor = ActiveSensor(i, alone);
  if (sensor != nullptr)
    vehicle.T_vehicle_imu.translation() = sensor->T_vehicle_sensor.translation();
  return vehicle;
}

std::string Text(const char* name, const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d& p = pose.translation();
  const Eigen::Vector3d rpy = RpyFromRotation(pose.linear()) * (180.0 / kPi);
  char line[200];
  std::snprintf(line,
                sizeof line,
                "%s at %.3f forward, %.3f starboard, %.3f down [m], roll %.3f, pitch %.3f, yaw "
                "%.3f deg\n",
                name,
                p.x(),
                p.y(),
                p.z(),
                rpy.x(),
                rpy.y(),
                rpy.z());
  return line;
}

}  // namespace

// --- the plan ------------------------------------------------------------------------------------

std::string SurveyPlan::Text() const {
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  const char* const depths[] = {
      "none", "heave and water line", "of the navigation", "of the sonar, by ping"};
  std::string text = "position: " + or_none(position_source) +
                     ", attitude: " + or_none(attitude_source) +
                     (heading_source.empty() ? "" : " with heading of " + heading_source) +
                     ", depth: " + depths[static_cast<int>(depth)] + ", pings: " +
                     (!soundings  ? "none"
                      : raw_pings ? "raw times and angles"
                                  : "soundings as they were placed") +
                     "\n";
  if (!has_installation) {
    text +=
        "no installation parameters: sonar, INS and reference point are taken to be at one "
        "place\n";
    return text;
  }
  text += "installation of " + installation.model + ":\n";
  text += seastitch::Text("  transmitter", vehicle.T_mbes_tx);
  text += seastitch::Text("  receiver", vehicle.T_mbes_rx);
  for (const SonarHead& head : vehicle.more_heads) {
    text += seastitch::Text("  next transmitter", head.T_mbes_tx);
    text += seastitch::Text("  next receiver", head.T_mbes_rx);
  }
  text += seastitch::Text("  position sensor", vehicle.T_vehicle_imu);
  if (const InstalledSensor* const motion = ActiveSensor(installation, false))
    text += seastitch::Text("  motion sensor", motion->T_vehicle_sensor);
  char line[80];
  std::snprintf(line, sizeof line, "  water line %.3f m down\n", installation.water_line_m);
  return text + line;
}

bool SurveyFiles::IsSurveyFile(const fs::path& path) { return ReaderFor(path) != nullptr; }

SurveyFiles::SurveyFiles(const std::vector<fs::path>& files) : files_(files) {
  Plan(files);
  for (const fs::path& file : files) {
    const auto sbet = sbets_.find(file);
    streams_.push_back(std::make_unique<SurveyStream>(
        file, kReorderS, sbet == sbets_.end() ? SbetParams{} : sbet->second));
  }
}
SurveyFiles::~SurveyFiles() = default;

void SurveyFiles::Plan(const std::vector<fs::path>& files) {
  Census census;
  for (const fs::path& file : files)
    if (!IsSbet(file)) Look(file, {}, &census);
  for (const fs::path& file : files) {
    if (!IsSbet(file)) continue;
    const std::set<Time>& pings =
        census.raw > 0 ? census.raw_reach.times : census.placed_reach.times;
    if (pings.empty())
      throw DataError(file.string() + ": an SBET needs the survey beside it, for its week");
    sbets_[file] = SbetParamsFor(file, *pings.begin());
    Look(file, sbets_[file], &census);
  }
  plan_.has_installation = census.installation.has_value();
  if (census.installation) plan_.installation = *census.installation;
  plan_.soundings = census.raw + census.placed > 0;
  plan_.raw_pings = census.raw > 0;
  plan_.position_source = PositionSource(census, plan_.installation);
  plan_.attitude_source = AttitudeSource(census);
  if (plan_.attitude_source.empty() && !Most(census.headings).empty()) {
    plan_.attitude_source = Most(census.levels);
    const std::string own = MostOwn(census.headings);
    plan_.heading_source = own.empty() ? Most(census.headings) : own;
  }
  plan_.depth_source = BesideAmong(census.depths);
  if (plan_.depth_source.empty()) plan_.depth_source = Most(census.depths);
  if (plan_.depth_source == kText)
    plan_.depth = SurveyPlan::Depth::kNavigation;
  else if (!plan_.raw_pings && census.placed_with_depth > 0)
    plan_.depth = SurveyPlan::Depth::kPing;
  else if (plan_.heave_source = HeaveSource(census, plan_.attitude_source);
           !plan_.heave_source.empty())
    plan_.depth = SurveyPlan::Depth::kHeave;
  else if (!plan_.depth_source.empty())
    plan_.depth = SurveyPlan::Depth::kNavigation;
  else if (census.placed_with_depth > 0)
    plan_.depth = SurveyPlan::Depth::kPing;
  Census::Reach& reach = plan_.raw_pings ? census.raw_reach : census.placed_reach;
  if (!reach.depths_m.empty()) {
    plan_.depth_m = Median(reach.depths_m);
    plan_.max_range_m = reach.max_range_m;
  }
  // Median: between files there may be days.
  std::vector<double> intervals_s;
  for (auto t = reach.times.begin(); t != reach.times.end() && std::next(t) != reach.times.end();
       ++t)
    intervals_s.push_back(ToSeconds(*std::next(t) - *t));
  std::sort(intervals_s.begin(), intervals_s.end());
  if (!intervals_s.empty()) plan_.ping_interval_s = intervals_s[intervals_s.size() / 2];
  plan_.vehicle = VehicleOf(plan_);
  plan_.grid = !census.first_position && census.first_grid;
  std::optional<GivenPosition> datum;
  if (const auto first = census.first_of_source.find(plan_.position_source);
      first != census.first_of_source.end())
    datum = first->second;
  else if (plan_.grid)
    datum = FromGrid(*census.first_grid);
  if (!datum) return;
  // Rounded as in vehicle.yaml.
  const auto rounded = [](double rad) { return Deg2Rad(std::round(Rad2Deg(rad) * 1e9) / 1e9); };
  plan_.vehicle.datum_latitude_rad = rounded(datum->latitude_rad);
  plan_.vehicle.datum_longitude_rad = rounded(datum->longitude_rad);
}

std::optional<std::string> SurveyFiles::Problem() const {
  const std::string files = files_[0].string() + (files_.size() > 1 ? " and those beside it" : "");
  if (!plan_.soundings) return files + ": no sounding in it";
  if (plan_.position_source.empty()) return files + ": no position in it to place soundings by";
  if (plan_.attitude_source.empty()) return files + ": no attitude in it to place soundings by";
  if (plan_.depth == SurveyPlan::Depth::kNone)
    return files + ": no heave and no depth in it to place soundings by";
  return std::nullopt;
}

// --- records to messages -------------------------------------------------------------------------

void SurveyFiles::Coverage::AddSample(Time t, double hold_s) {
  for (; !pings.empty() && pings.front() <= t; pings.pop_front()) {
    const bool between = last && ToSeconds(t - *last) <= max_gap_s;
    const bool held = (last && ToSeconds(pings.front() - *last) <= hold_s) ||
                      (!last && ToSeconds(t - pings.front()) <= hold_s);
    const bool at_once = pings.front() == t;
    if (!between && !held && !at_once) ++uncovered;
  }
  last = t;
}

struct SurveyFiles::Publish {
  SurveyFiles* self;
  Bus* bus;
  void operator()(const NavigationRecord& n) { self->OnNavigation(n, bus); }
  void operator()(const MbesPing& ping) { self->OnPing(ping, bus); }
  void operator()(const PlacedPing& ping) { self->OnPlaced(ping, bus); }
  void operator()(const SoundVelocityProfile& profile) {
    bus->Publish(channels::kSvp, ToLcm(profile, {self->now_, self->seqs_[channels::kSvp]++}));
  }
  template <class T>
  void operator()(const T&) {}
};

bool SurveyFiles::PublishNext(Bus* bus) {
  SurveyStream* earliest = nullptr;
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    SurveyStream* const stream = streams_[i].get();
    if (!stream->next() || (earliest != nullptr && *earliest->next() <= *stream->next())) continue;
    earliest = stream;
    file_ = i;
  }
  if (earliest == nullptr) return false;
  const SurveyRecord record = earliest->Take();
  now_ = std::max(now_, TimeOf(record));
  std::visit(Publish{this, bus}, record);
  return true;
}

void SurveyFiles::PublishIns(const NavigationSample& sample, Bus* bus) {
  bus->Publish(channels::kIns, ToLcm(sample, {now_, seqs_[channels::kIns]++}));
}

void SurveyFiles::PublishDepth(Time t, double depth_m, Bus* bus) {
  depth_m_ = depth_m;
  DepthSample sample;
  sample.time = t;
  sample.depth_m = depth_m;
  sample.sigma_m = 0.1;
  bus->Publish(channels::kDepth, ToLcm(sample, {now_, seqs_[channels::kDepth]++}));
}

// Publishes the water line as a height of the point that positions refer to.
void SurveyFiles::PublishWaterLine(Time t, double height_m, Bus* bus) {
  if (!depth_m_ || !q_ned_vehicle_) return;
  const Eigen::Vector3d& p_vehicle_ins_m = plan_.vehicle.T_vehicle_imu.translation();
  NavigationSample sample;
  sample.time = t;
  sample.source = "h";
  sample.height = InsVertical{height_m - *depth_m_ - (*q_ned_vehicle_ * p_vehicle_ins_m).z(), 0.0};
  PublishIns(sample, bus);
}

void SurveyFiles::OnNavigation(const NavigationRecord& n, Bus* bus) {
  if (n.velocity) {
    velocity_ = n.velocity;
    velocity_time_ = n.time;
  }
  if (n.source == plan_.attitude_source) {
    if (n.attitude)
      OnAttitude(n.time, *n.attitude, n, bus);
    else if (n.roll_pitch_rad && levels_.size() < 1000)
      levels_.push_back(n);
  }
  if (plan_.depth == SurveyPlan::Depth::kHeave && n.source == plan_.heave_source && n.heave_m)
    PublishDepth(n.time, *n.heave_m - plan_.installation.water_line_m, bus);
  if (n.source == plan_.heading_source && n.heading_rad) OnHeading(n.time, *n.heading_rad, bus);
  if (plan_.depth == SurveyPlan::Depth::kNavigation && n.source == plan_.depth_source && n.depth_m)
    PublishDepth(n.time, *n.depth_m, bus);
  if (n.water_line_height_m) PublishWaterLine(n.time, *n.water_line_height_m, bus);
  if (n.source != plan_.position_source || !(n.position || n.grid_north_east_m)) return;
  const GivenPosition position = n.position ? *n.position : FromGrid(*n.grid_north_east_m);
  NavigationSample sample;
  sample.time = n.time;
  sample.source = n.source;
  sample.position =
      InsPosition{position.latitude_rad, position.longitude_rad, position.sigma_north_east_m};
  if (velocity_ && velocity_time_ <= n.time && ToSeconds(n.time - velocity_time_) <= kVelocityHoldS)
    sample.velocity = InsVelocity{velocity_->v_ned_mps, velocity_->sigma_mps};
  if (n.height_m) sample.height = InsVertical{*n.height_m, 0.0};
  PublishIns(sample, bus);
  position_.AddSample(n.time, position_.max_gap_s);
}

void SurveyFiles::OnAttitude(Time t,
                             const Attitude& attitude,
                             const NavigationRecord& n,
                             Bus* bus) {
  NavigationSample sample;
  sample.time = t;
  sample.source = n.source;
  sample.attitude = attitude;
  // From the sensor's axes to the vehicle's.
  const InstalledSensor* const sensor = ActiveSensor(plan_.installation, false);
  if (sensor != nullptr && !IsBeside(n.source))
    sample.attitude->q_ned_imu =
        (attitude.q_ned_imu * Eigen::Quaterniond(sensor->T_vehicle_sensor.linear()).conjugate())
            .normalized();
  q_ned_vehicle_ = sample.attitude->q_ned_imu;
  PublishIns(sample, bus);
  attitude_.AddSample(t, 0.0);
}

// For sensors with a separate heading: roll and pitch wait for the next heading.
void SurveyFiles::OnHeading(Time t, double heading_rad, Bus* bus) {
  for (; !levels_.empty() && levels_.front().time <= t; levels_.pop_front()) {
    const NavigationRecord& n = levels_.front();
    double yaw = heading_rad;
    if (heading_ && heading_->time <= n.time && heading_->time < t) {
      const double w = ToSeconds(n.time - heading_->time) / ToSeconds(t - heading_->time);
      yaw = heading_->heading_rad + w * WrapAngle(heading_rad - heading_->heading_rad);
    } else if (ToSeconds(t - n.time) > attitude_.max_gap_s) {
      continue;
    }
    const Eigen::Vector2d& level = *n.roll_pitch_rad;
    OnAttitude(
        n.time, Attitude{Eigen::Quaterniond(RotationFromRpy(level.x(), level.y(), yaw))}, n, bus);
  }
  heading_ = Turn{t, heading_rad};
}

void SurveyFiles::OnPing(const MbesPing& ping, Bus* bus) {
  ++counters_["survey_pings"];
  attitude_.AddPing(ping.time);
  position_.AddPing(ping.time);
  bus->Publish(channels::kMbesPing, ToLcm(ping, {now_, seqs_[channels::kMbesPing]++}));
}

void SurveyFiles::OnPlaced(const PlacedPing& ping, Bus* bus) {
  if (plan_.depth == SurveyPlan::Depth::kPing && ping.origin_depth_m)
    PublishDepth(ping.time, *ping.origin_depth_m - ping.p_vehicle_origin_m.z(), bus);
  if (plan_.raw_pings) return;
  ++counters_["survey_pings"];
  attitude_.AddPing(ping.time);
  position_.AddPing(ping.time);
  SoundingPing soundings{ping.time, ping.ping_number, ping.head, {}};
  for (const PlacedBeam& beam : ping.soundings)
    soundings.soundings.push_back(
        {beam.p_level_m + ping.p_vehicle_origin_m.cast<float>(), beam.sigma_z_m, beam.flags});
  std::int64_t& seq = seqs_[channels::kMbesSoundings];
  for (const auto& message : ToLcm(soundings, {now_, seq})) {
    bus->Publish(channels::kMbesSoundings, message);
    ++seq;
  }
}

// --- what it came to -----------------------------------------------------------------------------

std::uint64_t SurveyFiles::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& stream : streams_) sum += stream->bytes();
  return sum;
}

std::uint64_t SurveyFiles::bytes_read() const {
  std::uint64_t sum = 0;
  for (const auto& stream : streams_) sum += stream->bytes_read();
  return sum;
}

Counters SurveyFiles::counters() const {
  Counters all = counters_;
  for (const auto& stream : streams_)
    for (const auto& [name, value] : stream->counters()) all[name] += value;
  const auto uncovered = [](const Coverage& c) {
    const auto held = [&c](Time t) { return c.last && ToSeconds(t - *c.last) <= 0.0; };
    return c.uncovered + std::count_if(c.pings.begin(), c.pings.end(), std::not_fn(held));
  };
  all["survey_pings_without_attitude"] = uncovered(attitude_);
  all["survey_pings_without_position"] = position_.uncovered;
  for (const Time t : position_.pings)
    if (!position_.last || ToSeconds(t - *position_.last) > position_.max_gap_s)
      ++all["survey_pings_without_position"];
  return all;
}

std::optional<std::string> SurveyFiles::Outcome() const {
  const Counters all = counters();
  const auto count = [&all](const char* name) {
    const auto found = all.find(name);
    return found == all.end() ? 0 : found->second;
  };
  const std::int64_t pings = count("survey_pings");
  const std::string file = files_[0].string();
  if (pings == 0) return file + ": no sounding in it";
  if (count("survey_pings_without_position") == pings)
    return file + ": none of its " + std::to_string(pings) + " pings lies within 2 s of a position";
  if (count("survey_pings_without_attitude") == pings)
    return file + ": none of its " + std::to_string(pings) + " pings lies within its attitude";
  return std::nullopt;
}

}  // namespace seastitch
