#include "tools/survey_plan.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <variant>

#include "codecs/text.hpp"
#include "common/core/counters.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "tools/line_plan.hpp"
#include "tools/message_types.hpp"
#include "tools/sbet_beside.hpp"
#include "tools/survey_files.hpp"
#include "tools/survey_stream.hpp"
#include "tools/text_columns.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Bytes of each file that are read to find out its content; more, as long as something is missing.
constexpr std::uint64_t kHeadBytes = 16 * 1024 * 1024;

// Values for a median, at most kMost: beyond that every second is dropped, and so on.
class Sample {
 public:
  void Add(double value) {
    if (seen_++ % stride_ != 0) return;
    values_.push_back(value);
    if (values_.size() < kMost) return;
    for (std::size_t i = 0; i < kMost / 2; ++i) values_[i] = values_[2 * i];
    values_.resize(kMost / 2);
    stride_ *= 2;
  }
  double MedianOr0() const { return values_.empty() ? 0.0 : Median(values_); }

 private:
  static constexpr std::size_t kMost = 1 << 20;
  std::vector<double> values_;
  std::size_t seen_ = 0;
  std::size_t stride_ = 1;
};

// Times, depths and ranges of the raw pings, or of the placed ones.
struct Reach {
  std::int64_t pings = 0;
  std::int64_t pings_of_file = 0;
  std::optional<Time> first;
  double max_range_m = 0.0;
  Sample depths_m;
  Sample intervals_s;
  std::set<Time> times_of_file;

  void Add(Time time, const std::vector<Eigen::Vector2d>& across_down_m) {
    ++pings;
    ++pings_of_file;
    if (!first || time < *first) first = time;
    times_of_file.insert(time);
    for (const Eigen::Vector2d& p : across_down_m) {
      max_range_m = std::max(max_range_m, p.norm());
      depths_m.Add(p.y());
    }
  }
  void EndFile() {
    for (auto t = times_of_file.begin(); t != times_of_file.end(); ++t)
      if (std::next(t) != times_of_file.end()) intervals_s.Add(ToSeconds(*std::next(t) - *t));
    times_of_file.clear();
    pings_of_file = 0;
  }
};

using Counts = std::map<std::string, std::int64_t>;  // records by source

// Source of the pose that the sonar states with each ping: heading without roll and pitch, which is
// enough for soundings that the sonar has ray traced.
constexpr char kOfPings[] = "#MRZ";

// Contents of the files' heads, counted by source.
struct Census {
  Counts positions, velocities, attitudes, levels, headings, heaves, depths;
  Counts attitudes_of_pings;  // kOfPings
  std::optional<GivenPosition> first_position;
  std::optional<Eigen::Vector2d> first_grid;
  std::map<std::string, GivenPosition> first_of_source;
  std::optional<SonarInstallation> installation;
  std::vector<TimedPosition> own;
  std::int64_t placed_with_depth = 0;
  Reach raw, placed;
  Counters ignored;
  // Of the present file.
  std::optional<SonarInstallation> installation_of_file;
  std::optional<Time> begin_of_file;
  std::int64_t navigation_of_file = 0;

  void operator()(const MbesPing& ping) {
    Begin(ping.time);
    std::vector<Eigen::Vector2d> soundings;
    for (const MbesBeam& beam : ping.beams) {
      if ((beam.flags & kBeamValid) == 0 || !IsPlausible(beam)) continue;
      const double range_m = 750.0 * double{beam.twtt_s};
      soundings.emplace_back(range_m * std::sin(double{beam.rx_angle_rad}),
                             range_m * std::cos(double{beam.rx_angle_rad}));
    }
    raw.Add(ping.time, soundings);
  }
  void operator()(const PlacedPing& ping) {
    Begin(ping.time);
    std::vector<Eigen::Vector2d> soundings;
    for (const PlacedBeam& beam : ping.soundings)
      if ((beam.flags & kBeamValid) != 0)
        soundings.emplace_back(double{beam.p_level_m.y()}, double{beam.p_level_m.z()});
    placed.Add(ping.time, soundings);
    if (ping.origin_depth_m) ++placed_with_depth;
  }
  void operator()(const NavigationRecord& n) {
    Begin(n.time);
    ++navigation_of_file;
    if (n.position && first_of_source.emplace(n.source, *n.position).second && !first_position)
      first_position = n.position;
    if (n.position && !IsBeside(n.source))
      AddOwn({n.time, n.position->latitude_rad, n.position->longitude_rad});
    if (n.grid_north_east_m && !first_grid) first_grid = n.grid_north_east_m;
    positions[n.source] += n.position || n.grid_north_east_m ? 1 : 0;
    velocities[n.source] += n.velocity ? 1 : 0;
    (n.source == kOfPings ? attitudes_of_pings : attitudes)[n.source] += n.attitude ? 1 : 0;
    levels[n.source] += n.roll_pitch_rad ? 1 : 0;
    headings[n.source] += n.heading_rad ? 1 : 0;
    heaves[n.source] += n.heave_m ? 1 : 0;
    depths[n.source] += n.depth_m ? 1 : 0;
  }
  void operator()(const SoundVelocityProfile&) {}
  void operator()(const SurfaceSoundSpeed&) {}
  // A `.s7k` has a record for each head, of which the last has them all.
  void operator()(const SonarInstallation& i) {
    for (auto* const first : {&installation, &installation_of_file})
      if (!*first || (*first)->transmitters.size() < i.transmitters.size()) *first = i;
  }
  void operator()(const SonarSettings&) {}

  // For comparison with an SBET: 200 positions, 5 s apart.
  void AddOwn(const TimedPosition& position) {
    constexpr std::size_t kMost = 200;
    constexpr double kApartS = 5.0;
    if (own.empty() || (own.size() < kMost && ToSeconds(position.time - own.back().time) > kApartS))
      own.push_back(position);
  }
  void Begin(Time t) {
    if (!begin_of_file || t < *begin_of_file) begin_of_file = t;
  }
  const Reach& reach() const { return raw.pings > 0 ? raw : placed; }
  static bool Any(const Counts& counts) {
    return std::any_of(counts.begin(), counts.end(), [](const auto& c) { return c.second > 0; });
  }
  bool IsComplete() const {
    return raw.pings + placed.pings > 0 && Any(positions) &&
           (Any(attitudes) || (Any(levels) && Any(headings)));
  }
  void EndFile(PlannedFile* file) {
    file->begin = std::exchange(begin_of_file, std::nullopt);
    file->installation = std::exchange(installation_of_file, std::nullopt);
    file->placed_alone = placed.pings_of_file > 0 && raw.pings_of_file == 0;
    navigation_of_file = 0;
    raw.EndFile();
    placed.EndFile();
  }
};

void Look(PlannedFile* file, Census* census) {
  const auto reader = ReaderFor(file->path, file->params);
  if (!reader) throw DataError(file->path.string() + ": no survey file of a format that is known");
  std::ifstream in(file->path, std::ios::binary);
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < kHeadBytes || !census->IsComplete();) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    read += got;
    for (const SurveyRecord& record : reader->Add(Bytes(piece.data(), got)))
      std::visit(*census, record);
  }
  for (const SurveyRecord& record : reader->Finish()) std::visit(*census, record);
  if (IsNavigationBeside(file->path) && census->navigation_of_file == 0)
    throw DataError(file->path.string() + ": no line or record of navigation that can be read");
  for (const auto& [name, value] : reader->counters())
    if (name.find("_ignored_") != std::string::npos) census->ignored[name] += value;
  census->EndFile(file);
}

// Earliest record of all files.
std::optional<Time> BeginOf(const std::vector<PlannedFile>& files) {
  std::optional<Time> begin;
  for (const PlannedFile& file : files)
    if (file.begin && (!begin || *file.begin < *begin)) begin = file.begin;
  return begin;
}

// Time of the survey, from soundings by line if nothing else states it.
std::optional<Time> TimeOfSurvey(const std::vector<PlannedFile>& files, const Census& census) {
  std::optional<Time> time = census.reach().first ? census.reach().first : BeginOf(files);
  for (const PlannedFile& file : files)
    if (!time && IsLineFile(file.path)) time = FirstTimeOf(file.path);
  return time;
}

// All files but soundings by line. An SBET states only the time of the week: it is read after the
// survey.
Census LookAtAll(std::vector<PlannedFile>* files) {
  Census census;
  for (PlannedFile& file : *files)
    if (!IsSbet(file.path) && !IsLineFile(file.path)) Look(&file, &census);
  for (PlannedFile& file : *files) {
    if (!IsSbet(file.path)) continue;
    const std::optional<Time> time = TimeOfSurvey(*files, census);
    if (!time)
      throw DataError(file.path.string() + ": an SBET needs the survey beside it, for its week");
    file.params.sbet = SbetParamsFor(file.path, *time, census.own);
    Look(&file, &census);
  }
  return census;
}

// --- sources -------------------------------------------------------------------------------------

// Name in the installation of the sensor whose records have this source.
std::string SensorNameOf(const std::string& source) {
  const auto numbered = [&source](const char* name) {
    const auto system = ParseNumber(std::string_view(source).substr(4));
    return name + std::to_string(static_cast<int>(system.value_or(0.0)) + 1);
  };
  if (source.starts_with("#SPO")) return numbered("POSI_");
  if (source.starts_with("#SKM")) return numbered("ATTI_");
  if (source == "A1" || source == "n1") return "MS";
  if (source == "A2" || source == "n2") return "NS";
  if (source == "1003" || source == "1015") return "position";
  if (source == "1012" || source == "1016") return "motion";
  return source;
}

// The source with most records among those with this prefix.
std::string Most(const Counts& counts, const std::string& prefix = "") {
  std::string best;
  std::int64_t most = 0;
  for (const auto& [source, count] : counts)
    if (source.starts_with(prefix) && count > most) best = source, most = count;
  return best;
}

// The sources of sensors that the installation calls active.
Counts OfActive(Counts counts, const SurveyPlan& plan) {
  std::erase_if(counts, [&plan](const auto& entry) {
    const InstalledSensor* const sensor = plan.SensorOf(entry.first);
    return sensor == nullptr || !sensor->active;
  });
  return counts;
}

// The sonar's own sources.
Counts Own(Counts counts) {
  std::erase_if(counts, [](const auto& entry) { return IsBeside(entry.first); });
  return counts;
}

// Processed navigation beside the files is there on purpose: it comes before the files' own.
constexpr char kSbet[] = "sbet";
constexpr char kText[] = "text";  // text navigation, by a map of columns that the user has written

// Source of position: that of the active sensor; a pure position sensor comes before an INS's
// position, as in the makers' programs. In `.s7k`, 1015 with speed and course comes before 1003,
// because that velocity is of the same time as its position.
std::string PositionSource(const Census& census, const SurveyPlan& plan) {
  if (const std::string beside = BesideAmong(census.positions); !beside.empty()) return beside;
  if (!Most(census.velocities, "1015").empty()) return "1015";
  for (const Counts& counts : {OfActive(census.positions, plan), census.positions})
    for (const char* const alone : {"#SPO", "P", "xtf_position", "1003", "1015"})
      if (const auto best = Most(counts, alone); !best.empty()) return best;
  Counts of_sensors = census.positions;
  of_sensors.erase(kOfPings);
  const std::string best = Most(of_sensors);
  return best.empty() ? Most(census.positions) : best;
}

// Source of attitude in the sonar's own files: that of the active sensor. In `.all`, the attitude
// datagram "A" comes before the network attitude "n".
std::string OwnAttitudeSource(const Census& census, const SurveyPlan& plan) {
  const Counts own = Own(census.attitudes);
  for (const Counts& counts : {OfActive(own, plan), own})
    for (const char* const prefix : {"A", ""})
      if (const std::string best = Most(counts, prefix); !best.empty()) return best;
  return "";
}

// Source of attitude. Text has one line per ping or second: the files' own motion is finer.
std::string AttitudeSource(const Census& census, const SurveyPlan& plan) {
  if (!Most(census.attitudes, kSbet).empty()) return kSbet;
  const std::string own = OwnAttitudeSource(census, plan);
  return own.empty() && Most(Own(census.levels)).empty() ? Most(census.attitudes) : own;
}

// Source of heave. An SBET contains none: that of the motion sensor is used.
std::string HeaveSource(const Census& census, const SurveyPlan& plan) {
  const bool sbet = plan.attitude_source == kSbet;
  const std::string motion = sbet ? OwnAttitudeSource(census, plan) : plan.attitude_source;
  const auto of_motion = census.heaves.find(motion);
  if (of_motion != census.heaves.end() && of_motion->second > 0) return motion;
  return sbet ? Most(Own(census.heaves)) : std::string();
}

void ChooseAttitude(const Census& census, SurveyPlan* plan) {
  plan->attitude_source = AttitudeSource(census, *plan);
  if (!plan->attitude_source.empty() || Most(census.headings).empty()) return;
  plan->attitude_source = Most(census.levels);
  const std::string own = Most(Own(census.headings));
  plan->heading_source = own.empty() ? Most(census.headings) : own;
}

// Without the attitude of a sensor: the soundings that the sonar has ray traced.
void ChoosePings(const Census& census, SurveyPlan* plan) {
  plan->raw_pings = census.raw.pings > 0;
  if (!plan->attitude_source.empty() || census.placed_with_depth == 0) return;
  plan->attitude_source = Most(census.attitudes_of_pings);
  if (!plan->attitude_source.empty()) plan->raw_pings = false;
}

void ChooseDepth(const Census& census, SurveyPlan* plan) {
  using Depth = SurveyPlan::Depth;
  plan->depth_source = BesideAmong(census.depths);
  if (plan->depth_source.empty()) plan->depth_source = Most(census.depths);
  const std::string heave = HeaveSource(census, *plan);
  if (plan->depth_source == kText) {
    plan->depth = Depth::kNavigation;
  } else if (!plan->raw_pings && census.placed_with_depth > 0) {
    plan->depth = Depth::kPing;
  } else if (!heave.empty()) {
    plan->depth = Depth::kHeave;
    plan->heave_source = heave;
  } else if (!plan->depth_source.empty()) {
    plan->depth = Depth::kNavigation;
  } else if (census.placed_with_depth > 0) {
    plan->depth = Depth::kPing;
  }
}

void ChooseSources(const Census& census, SurveyPlan* plan) {
  plan->position_source = PositionSource(census, *plan);
  ChooseAttitude(census, plan);
  ChoosePings(census, plan);
  ChooseDepth(census, plan);
  if (!plan->level_track) return;
  plan->heading_source.clear();
  plan->attitude_source = plan->level_track->has_headings() ? "heading" : "course";
}

// The names of the files for which this holds: three, and the number of the others.
std::string Names(const std::vector<PlannedFile>& files,
                  const std::function<bool(const PlannedFile&)>& holds) {
  constexpr int kShown = 3;
  std::string text;
  int found = 0;
  for (const PlannedFile& file : files) {
    if (!holds(file) || ++found > kShown) continue;
    text += (found == 1 ? "" : ", ") + file.path.filename().string();
  }
  return found > kShown ? text + " and " + std::to_string(found - kShown) + " more" : text;
}

// --- soundings by line ---------------------------------------------------------------------------

// The track that the chosen sources give. Nothing: they give no position.
std::shared_ptr<LineTrack> TrackOf(const SurveyPlan& plan, const Census& census) {
  const auto origin = census.first_of_source.find(plan.position_source);
  if (origin == census.first_of_source.end()) return nullptr;
  const std::string heading =
      plan.heading_source.empty() ? Most(census.headings) : plan.heading_source;
  auto track = std::make_shared<LineTrack>(origin->second);
  for (const PlannedFile& file : plan.files) {
    if (IsLineFile(file.path)) continue;
    for (SurveyStream stream(file.path, SurveyFiles::kReorderS, file.params); stream.next();) {
      const SurveyRecord record = stream.Take();
      const auto* const n = std::get_if<NavigationRecord>(&record);
      if (n == nullptr) continue;
      if (n->source == plan.position_source && n->position)
        track->AddPosition(n->time, *n->position);
      if (n->source == plan.attitude_source && n->attitude)
        track->AddHeading(n->time, RpyFromRotation(n->attitude->q_ned_imu.toRotationMatrix()).z());
      else if (n->source == heading && n->heading_rad)
        track->AddHeading(n->time, *n->heading_rad);
      if (plan.depth == SurveyPlan::Depth::kNavigation && n->source == plan.depth_source &&
          n->depth_m)
        track->AddDepth(n->time, *n->depth_m);
    }
  }
  track->Finish();
  return track;
}

// Soundings by line, after the navigation that places them.
void LookAtLines(SurveyPlan* plan, Census* census) {
  if (std::none_of(plan->files.begin(), plan->files.end(), [](const PlannedFile& file) {
        return IsLineFile(file.path);
      }))
    return;
  ChooseSources(*census, plan);
  const std::shared_ptr<LineTrack> track = TrackOf(*plan, *census);
  if (!track && census->first_grid)
    throw DataError(
        plan->files[0].path.string() +
        ": the track beside it is in a grid without a name; state it as crs in the file "
        "that describes its columns");
  std::map<std::string, std::vector<PlannedFile>> by_text;
  for (PlannedFile& file : plan->files) {
    if (!IsLineFile(file.path)) continue;
    LinePlan line = PlanLine(file.path, track);
    file.params.line = std::move(line.params);
    Look(&file, census);
    file.begin = std::min(file.begin, line.begin);
    by_text[line.text].push_back(file);
  }
  // Of one attitude per second, the mapper would not interpolate every other.
  constexpr double kSlowS = 0.5;
  if (plan->attitude_source.empty() || track->heading_interval_s() > kSlowS)
    plan->level_track = track;
  for (const auto& [text, files] : by_text)
    plan->lines_text +=
        "soundings by line: " + Names(files, [](const PlannedFile&) { return true; }) + ": " +
        text + "\n";
}

// --- geometry ------------------------------------------------------------------------------------

// Position of a transmitter; if it has three parts, of the middle one.
Eigen::Isometry3d Centre(const InstalledArray& transmitter) {
  return transmitter.At(transmitter.centres_m.size() / 2);
}

// The parts of a transmitter that has several, relative to its centre, to 1 um.
std::vector<Eigen::Vector3d> PartsOf(const InstalledArray& transmitter) {
  std::vector<Eigen::Vector3d> parts_m = transmitter.centres_m;
  if (parts_m.size() < 2) return {};
  const Eigen::Vector3d centre_m = parts_m[parts_m.size() / 2];
  for (Eigen::Vector3d& part_m : parts_m)
    part_m = ((part_m - centre_m) * 1e6).array().round() / 1e6;
  return parts_m;
}

// Point of the vehicle whose depth is heave, plus its depth at rest below the water line. Heave in
// `.all` is that of the transmitter as installed, from which its acoustic centres are some
// centimetres away; that of other formats is of the reference point.
Eigen::Vector3d HeavingPoint(const SurveyPlan& plan) {
  const InstalledArray* const tx = plan.installation.TransmitterOf(0);
  const std::string sensor = SensorNameOf(plan.heave_source);
  if ((sensor == "MS" || sensor == "NS") && tx != nullptr) return tx->T_vehicle_array.translation();
  return Eigen::Vector3d::Zero();
}

VehicleGeometry VehicleOf(const SurveyPlan& plan) {
  VehicleGeometry vehicle;
  const SonarInstallation& i = plan.installation;
  if (const InstalledArray* const tx = i.TransmitterOf(0)) {
    vehicle.T_mbes_tx = Centre(*tx);
    vehicle.p_tx_parts_m = PartsOf(*tx);
  }
  if (const InstalledArray* const rx = i.ReceiverOf(0)) vehicle.T_mbes_rx = rx->At(0);
  const bool both = !i.transmitters.empty() && !i.receivers.empty();
  const std::size_t heads = both ? std::max(i.transmitters.size(), i.receivers.size()) : 1;
  for (std::size_t head = 1; head < heads; ++head)
    vehicle.more_heads.push_back({Centre(*i.TransmitterOf(head)),
                                  i.ReceiverOf(head)->At(0),
                                  PartsOf(*i.TransmitterOf(head))});
  if (plan.depth == SurveyPlan::Depth::kHeave) vehicle.p_vehicle_depth_m = HeavingPoint(plan);
  // The position sensor may be another than the attitude sensor.
  vehicle.T_vehicle_imu.translation() = plan.PointOf(plan.position_source);
  return vehicle;
}

// True if this installation has something at another place than the plan's.
bool Differs(const SonarInstallation& installation, const SurveyPlan& plan) {
  SurveyPlan other = plan;
  other.installation = installation;
  other.vehicle = VehicleOf(other);
  return other.InstallationText() != plan.InstallationText();
}

void SetDatum(const Census& census, SurveyPlan* plan) {
  plan->grid = !census.first_position && census.first_grid;
  std::optional<GivenPosition> datum;
  if (const auto first = census.first_of_source.find(plan->position_source);
      first != census.first_of_source.end())
    datum = first->second;
  else if (plan->grid)
    datum = FromGrid(*census.first_grid);
  if (!datum) return;
  // Rounded as in vehicle.yaml.
  const auto rounded = [](double rad) { return Deg2Rad(std::round(Rad2Deg(rad) * 1e9) / 1e9); };
  plan->vehicle.datum_latitude_rad = rounded(datum->latitude_rad);
  plan->vehicle.datum_longitude_rad = rounded(datum->longitude_rad);
}

// --- text ----------------------------------------------------------------------------------------

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

// A line about the delay that the installation states for a sensor; empty: none.
std::string DelayText(const InstalledSensor* sensor) {
  if (sensor == nullptr || sensor->delay_s == 0.0) return "";
  char line[120];
  std::snprintf(line,
                sizeof line,
                "    its stamps are late by %.3f s: %s\n",
                sensor->delay_s,
                sensor->delay_is_applied ? "corrected" : "not corrected (docs/survey-files.md)");
  return line;
}

// A transmit array and its parts.
std::string Text(const char* name,
                 const Eigen::Isometry3d& array,
                 const std::vector<Eigen::Vector3d>& parts_m) {
  std::string text = Text(name, array);
  for (const Eigen::Vector3d& part_m : parts_m)
    text += Text("    a part of it", array * Eigen::Translation3d(part_m));
  return text;
}

// The three commonest: "812 xtf_sonar, 3 xtf_notes".
std::string Commonest(const Counters& ignored) {
  std::vector<std::pair<std::int64_t, std::string>> by_count;
  for (const auto& [name, count] : ignored) {
    std::string type = name;
    by_count.emplace_back(-count, type.erase(type.find("_ignored"), 8));
  }
  std::sort(by_count.begin(), by_count.end());
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(by_count.size(), 3); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(-by_count[i].first) + " " + by_count[i].second;
  return text;
}

}  // namespace

GivenPosition FromGrid(const Eigen::Vector2d& north_east_m) {
  static const GeographicLib::LocalCartesian grid(0.0, 0.0, 0.0);
  double latitude_deg = 0.0, longitude_deg = 0.0, height_m = 0.0;
  grid.Reverse(north_east_m.y(), north_east_m.x(), 0.0, latitude_deg, longitude_deg, height_m);
  return {Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
}

const InstalledSensor* SurveyPlan::SensorOf(const std::string& source) const {
  return installation.SensorOf(SensorNameOf(source));
}

// #SPO already refers to the reference point, as #MRZ does.
Eigen::Vector3d SurveyPlan::PointOf(const std::string& source) const {
  const InstalledSensor* const sensor = SensorOf(source);
  if (sensor == nullptr || source.starts_with("#SPO")) return Eigen::Vector3d::Zero();
  return sensor->T_vehicle_sensor.translation();
}

std::optional<std::string> SurveyPlan::Problem() const {
  const std::string these =
      files[0].path.string() + (files.size() > 1 ? " and those beside it" : "");
  if (!soundings)
    return these + ": no sounding in it" + (ignored.empty() ? "" : "; not read: " + ignored);
  if (position_source.empty()) return these + ": no position in it to place soundings by";
  if (attitude_source.empty()) return these + ": no attitude in it to place soundings by";
  if (depth == SurveyPlan::Depth::kNone)
    return these + ": no heave and no depth in it to place soundings by";
  return std::nullopt;
}

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
  const std::string unused =
      Names(files, [this](const PlannedFile& f) { return raw_pings && f.placed_alone; });
  if (!unused.empty())
    text += "not used: " + unused +
            ": soundings without raw times and angles, which other files have; map them as a dive "
            "of their own\n";
  const std::string utc = Names(files, [](const PlannedFile& f) {
    return IsSbet(f.path) && f.params.sbet.leap_seconds == 0.0;
  });
  if (!utc.empty())
    text += "times are UTC, not GPS, as the files' own positions show: " + utc + "\n";
  const std::string otherwise =
      Names(files, [](const PlannedFile& f) { return f.is_installed_otherwise; });
  if (!otherwise.empty()) text += "not used: another installation in " + otherwise + "\n";
  return text + lines_text + sound_speed_text + InstallationText();
}

std::string SurveyPlan::InstallationText() const {
  if (!has_installation)
    return raw_pings ? "no installation parameters: the vehicle.yaml of --config applies; without "
                       "one, sonar, INS and reference point are taken to be at one place\n"
                     : "no installation parameters: soundings are relative to the position\n";
  std::string text = "installation of " + installation.model + ":\n";
  text += seastitch::Text("  transmitter", vehicle.T_mbes_tx, vehicle.p_tx_parts_m);
  text += seastitch::Text("  receiver", vehicle.T_mbes_rx);
  for (const SonarHead& head : vehicle.more_heads) {
    text += seastitch::Text("  next transmitter", head.T_mbes_tx, head.p_tx_parts_m);
    text += seastitch::Text("  next receiver", head.T_mbes_rx);
  }
  text += seastitch::Text("  position sensor", vehicle.T_vehicle_imu);
  text += DelayText(SensorOf(position_source));
  if (const InstalledSensor* const motion = SensorOf(attitude_source))
    text += seastitch::Text("  motion sensor", motion->T_vehicle_sensor) + DelayText(motion);
  char line[80];
  std::snprintf(line, sizeof line, "  water line %.3f m down\n", installation.water_line_m);
  return text + line;
}

SurveyPlan MakeSurveyPlan(const std::vector<fs::path>& files) {
  SurveyPlan plan;
  for (const fs::path& file : files) plan.files.push_back({file});
  Census census = LookAtAll(&plan.files);
  plan.has_installation = census.installation.has_value();
  if (census.installation) plan.installation = *census.installation;
  LookAtLines(&plan, &census);
  plan.soundings = census.reach().pings > 0;
  if (!plan.soundings) plan.ignored = Commonest(census.ignored);
  ChooseSources(census, &plan);
  plan.depth_m = census.reach().depths_m.MedianOr0();
  plan.max_range_m = census.reach().max_range_m;
  plan.ping_interval_s = census.reach().intervals_s.MedianOr0();
  plan.vehicle = VehicleOf(plan);
  for (PlannedFile& file : plan.files)
    file.is_installed_otherwise = file.installation && Differs(*file.installation, plan);
  SetDatum(census, &plan);
  return plan;
}

}  // namespace seastitch
