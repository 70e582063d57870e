#include "survey/plan/survey_plan.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "codecs/text.hpp"
#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"
#include "survey/errors.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/plan/profiles_beside.hpp"
#include "survey/plan/survey_census.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

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
std::string Most(const Counters& counts, const std::string& prefix = "") {
  std::string best;
  std::int64_t most = 0;
  for (const auto& [source, count] : counts)
    if (source.starts_with(prefix) && count > most) best = source, most = count;
  return best;
}

// The sources of sensors that the installation calls active.
Counters OfActive(Counters counts, const SurveyPlan& plan) {
  std::erase_if(counts, [&plan](const auto& entry) {
    const InstalledSensor* const sensor = plan.SensorOf(entry.first);
    return sensor == nullptr || !sensor->active;
  });
  return counts;
}

// The sonar's own sources.
Counters Own(Counters counts) {
  std::erase_if(counts, [](const auto& entry) { return IsExternal(entry.first); });
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
  const bool has_1015 = census.positions.contains("1015") && census.velocities.contains("1015");
  if (has_1015) return "1015";
  for (const Counters& counts : {OfActive(census.positions, plan), census.positions})
    for (const char* const alone : {"#SPO", "P", "xtf_position", "1003", "1015"})
      if (const auto best = Most(counts, alone); !best.empty()) return best;
  Counters of_sensors = census.positions;
  std::erase_if(of_sensors, [](const auto& entry) { return IsOfPings(entry.first); });
  return Most(of_sensors.empty() ? census.positions : of_sensors);
}

// Source of attitude in the sonar's own files: that of the active sensor. In `.all`, the attitude
// datagram "A" comes before the network attitude "n".
std::string OwnAttitudeSource(const Census& census, const SurveyPlan& plan) {
  const Counters own = Own(census.attitudes);
  for (const Counters& counts : {OfActive(own, plan), own})
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

// Source of heave among these. An SBET contains none: that of the motion sensor is used.
std::string HeaveSource(const Counters& heaves, const Census& census, const SurveyPlan& plan) {
  const bool sbet = plan.attitude_source == kSbet;
  const std::string motion = sbet ? OwnAttitudeSource(census, plan) : plan.attitude_source;
  if (heaves.contains(motion)) return motion;
  return sbet ? Most(Own(heaves)) : std::string();
}

void ChooseAttitude(const Census& census, SurveyPlan* plan) {
  plan->attitude_source = AttitudeSource(census, *plan);
  if (!plan->attitude_source.empty() || Most(census.headings).empty()) return;
  plan->attitude_source = Most(census.levels);
  const std::string own = Most(Own(census.headings));
  plan->heading_source = own.empty() ? Most(census.headings) : own;
}

// Without the attitude of a sensor: the sonar's own soundings, which need the heading of each ping
// alone.
void ChoosePings(const Census& census, SurveyPlan* plan) {
  plan->raw_pings = census.raw_pings > 0;
  if (!plan->attitude_source.empty() || census.placed_with_depth == 0) return;
  plan->attitude_source = Most(census.attitudes_of_pings);
  if (plan->attitude_source.empty()) return;
  plan->heading_source.clear();
  if (!std::exchange(plan->raw_pings, false)) return;
  plan->warnings.push_back({WarningCode::kSonarsOwnSoundings,
                            "no attitude of a sensor: the sonar's own soundings are used"});
}

// A heave that is always 0 is that of a sensor which does not measure it: a stated depth comes
// before it.
void ChooseDepth(const Census& census, SurveyPlan* plan) {
  using Depth = SurveyPlan::Depth;
  plan->depth_source = BesideAmong(census.depths);
  if (plan->depth_source.empty()) plan->depth_source = Most(census.depths);
  const std::string heave = HeaveSource(census.heaves, census, *plan);
  const std::string still = HeaveSource(census.still_heaves, census, *plan);
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
  } else if (!still.empty()) {
    plan->depth = Depth::kHeave;
    plan->heave_source = still;
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

// --- soundings by line ---------------------------------------------------------------------------

// The track that the chosen sources give. Nothing: they give no position.
std::shared_ptr<LineTrack> TrackOf(const SurveyPlan& plan, const Census& census) {
  const auto origin = census.start.find(plan.position_source);
  if (origin == census.start.end()) return nullptr;
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
  if (!track && !census->grid_start.empty())
    throw DataError(
        plan->files[0].path.string() +
        ": the track beside it is in a grid without a name; state it as crs in the file "
        "that describes its columns");
  for (PlannedFile& file : plan->files) {
    if (!IsLineFile(file.path)) continue;
    LinePlan line = PlanLine(file.path, track);
    file.params.line = std::move(line.params);
    file.line_text = line.text;
    if (!line.warning.empty())
      plan->warnings.push_back(
          {WarningCode::kUnitAssumed, file.path.filename().string() + ": " + line.warning});
    file.begin = line.begin;
  }
  AddLines(TakeLineCensus(&plan->files), census);
  // Of one attitude per second, the mapper would not interpolate every other.
  constexpr double kSlowS = 0.5;
  const bool is_slow = plan->attitude_source.empty() || track->heading_interval_s() > kSlowS;
  if (census->raw_pings == 0 && is_slow) plan->level_track = track;
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

// Point of the vehicle that depths are of. In `.all`, heave is that of the transmitter as
// installed, from which its acoustic centres are some centimetres away, and stated depths are those
// of its centre. In other formats both are those of the reference point.
Eigen::Vector3d DepthPoint(const SurveyPlan& plan) {
  const bool is_heave = plan.depth == SurveyPlan::Depth::kHeave;
  const InstalledArray* const tx = plan.installation.TransmitterOf(0);
  const std::string sensor = SensorNameOf(plan.heave_source);
  const bool of_transmitter =
      is_heave ? sensor == "MS" || sensor == "NS" : plan.SensorOf("A1") != nullptr;
  if (!of_transmitter || tx == nullptr) return Eigen::Vector3d::Zero();
  return (is_heave ? tx->T_vehicle_array : Centre(*tx)).translation();
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
  const bool by_sonar = plan.depth == SurveyPlan::Depth::kPing && plan.raw_pings;
  if (plan.depth == SurveyPlan::Depth::kHeave || by_sonar)
    vehicle.p_vehicle_depth_m = DepthPoint(plan);
  // The lever arm is that of the position sensor, which may be another than the attitude sensor.
  vehicle.T_vehicle_imu.translation() = plan.PointOf(plan.position_source);
  return vehicle;
}

// True if this installation has an array or a sensor at another place than the plan's.
bool Differs(const SonarInstallation& installation, const SurveyPlan& plan) {
  SurveyPlan other = plan;
  other.installation = installation;
  other.installation.water_line_m = plan.installation.water_line_m;
  other.vehicle = VehicleOf(other);
  return other.InstallationText() != plan.InstallationText();
}

// Rounded as in vehicle.yaml.
void PlaceDatum(const GeoPosition& datum, VehicleGeometry* vehicle) {
  const auto rounded = [](double rad) { return Deg2Rad(std::round(Rad2Deg(rad) * 1e9) / 1e9); };
  vehicle->datum.latitude_rad = rounded(datum.latitude_rad);
  vehicle->datum.longitude_rad = rounded(datum.longitude_rad);
}

// The map's origin: the first position of the source that is used.
void SetDatum(const Census& census, SurveyPlan* plan) {
  GeoPosition datum;
  if (const auto start = census.start.find(plan->position_source); start != census.start.end())
    datum = start->second;
  else if (const auto grid = census.grid_start.find(plan->position_source);
           grid != census.grid_start.end())
    plan->grid_origin_m = grid->second;
  PlaceDatum(datum, &plan->vehicle);
}

// Names files that give nothing, or less than they hold.
void WarnOfFiles(SurveyPlan* plan) {
  const auto warn = [&](WarningCode code, const std::string& files, const char* why) {
    if (!files.empty()) plan->warnings.push_back({code, files + ": " + why});
  };
  warn(WarningCode::kSoundingsNotUsed,
       plan->NamesOf([&](const PlannedFile& f) { return plan->raw_pings && f.placed_alone; }),
       "soundings without raw times and angles, which other files have, are not used; map them as "
       "a dive of their own");
  warn(WarningCode::kOtherInstallation,
       plan->NamesOf([](const PlannedFile& f) { return f.is_installed_otherwise; }),
       "its installation is not used; without --one-dive it is a dive of its own");
  warn(WarningCode::kFileWithoutRecords,
       plan->NamesOf([](const PlannedFile& f) { return !f.begin && !IsLineFile(f.path); }),
       "no ping and no position that can be read");
}

// Takes whole seconds off sensors' stamps where the sonar's own clock shows them. True if a file
// has to be read anew.
bool MendClocks(SurveyPlan* plan) {
  bool mended = false;
  for (PlannedFile& file : plan->files)
    for (const auto& [source, clock] : file.clocks) {
      if (clock.is_moved) file.params.clock_offsets_s[source] = clock.ahead_s;
      mended = mended || clock.is_moved;
      const auto is_like_this = [name = source, clock = clock](const PlannedFile& f) {
        const auto found = f.clocks.find(name);
        return found != f.clocks.end() && found->second.is_moved == clock.is_moved &&
               std::round(found->second.ahead_s) == std::round(clock.ahead_s);
      };
      // Once for all files of which it holds.
      const auto first = std::find_if(plan->files.begin(), plan->files.end(), is_like_this);
      if (&*first == &file)
        plan->warnings.push_back({WarningCode::kSensorClock,
                                  plan->NamesOf(is_like_this) + ": " + ClockText(source, clock),
                                  EffectOf(clock)});
    }
  return mended;
}

}  // namespace

GeoPosition SurveyPlan::FromGrid(const Eigen::Vector2d& north_east_m) const {
  static const MapFrame grid(Datum{});
  const Datum point = grid.PointAt(north_east_m - grid_origin_m.value_or(Eigen::Vector2d::Zero()));
  return {Deg2Rad(point.latitude_deg), Deg2Rad(point.longitude_deg)};
}

const InstalledSensor* SurveyPlan::SensorOf(const std::string& source) const {
  return installation.SensorOf(SensorNameOf(source));
}

// #SPO already refers to the reference point, as #MRZ does.
Eigen::Vector3d SurveyPlan::PointOf(const std::string& source) const {
  const InstalledSensor* const sensor = source.starts_with("#SPO") ? nullptr : SensorOf(source);
  return sensor == nullptr ? Eigen::Vector3d::Zero()
                           : Eigen::Vector3d(sensor->T_vehicle_sensor.translation());
}

void SurveyPlan::UseGridOrigin(const Eigen::Vector2d& north_east_m) {
  const Eigen::Vector2d start_m = *grid_origin_m;
  grid_origin_m = north_east_m;
  PlaceDatum(FromGrid(start_m), &vehicle);
}

SurveyPlan SurveyPlan::WithDepthOfPings() const {
  SurveyPlan other = *this;
  other.depth = Depth::kPing;
  other.heave_source.clear();
  other.vehicle.p_vehicle_depth_m = other.raw_pings ? DepthPoint(other) : Eigen::Vector3d::Zero();
  return other;
}

SurveyPlan SurveyPlan::WithPlacedSoundings() const {
  SurveyPlan other = *this;
  other.raw_pings = false;
  other.profile_alone = false;
  return other.WithDepthOfPings();
}

SurveyPlan MakeSurveyPlan(const std::vector<std::filesystem::path>& files,
                          const ProfileChoice& profiles) {
  SurveyPlan plan;
  for (const auto& file : files) plan.files.push_back({file});
  Census census = TakeCensus(&plan.files);
  if (MendClocks(&plan)) census = TakeCensus(&plan.files);
  plan.has_installation = census.installation.has_value();
  if (census.installation) plan.installation = *census.installation;
  LookAtLines(&plan, &census);
  plan.soundings = census.raw_pings + census.placed_pings > 0;
  plan.not_read = census.not_read;
  ChooseSources(census, &plan);
  plan.depth_m = census.depth_m;
  plan.max_range_m = census.max_range_m;
  plan.ping_interval_s = census.ping_interval_s;
  plan.vehicle = VehicleOf(plan);
  for (PlannedFile& file : plan.files)
    file.is_installed_otherwise = file.installation && Differs(*file.installation, plan);
  SetDatum(census, &plan);
  WarnOfFiles(&plan);
  ChooseProfiles(profiles, census.profiles > 0, &plan);
  return plan;
}

}  // namespace seastitch
