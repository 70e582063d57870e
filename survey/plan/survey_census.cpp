#include "survey/plan/survey_census.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <set>
#include <utility>
#include <variant>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "survey/errors.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/read/checked_reader.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

// Bytes of each file that are read to find out its content; more, as long as something is missing.
constexpr std::uint64_t kHeadBytes = 16 * 1024 * 1024;
// A source is used if it covers this share of the pings that the best one covers.
constexpr double kLeastShare = 0.9;
// A ping is covered if the source has a record within so many seconds.
constexpr std::int64_t kCoveredS = 2;
// Positions farther than this from the median are no start of a survey.
constexpr double kFarM = 100'000.0;

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

std::int64_t SecondOf(Time t) { return ToUtime(t) / 1'000'000; }

// Times, depths and ranges of the raw pings, or of the placed ones.
struct Reach {
  std::int64_t pings = 0;
  std::int64_t pings_of_file = 0;
  std::optional<Time> first;
  double max_range_m = 0.0;
  Sample depths_m;
  Sample intervals_s;
  std::set<Time> times_of_file;
  std::map<std::int64_t, std::int64_t> by_second;

  void Add(Time time, const std::vector<Eigen::Vector2d>& across_down_m) {
    ++pings;
    ++pings_of_file;
    if (!first || time < *first) first = time;
    times_of_file.insert(time);
    ++by_second[SecondOf(time)];
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

// One quantity of navigation: records by source, and the seconds in which there are any.
struct Quantity {
  Counters records;
  std::map<std::string, std::set<std::int64_t>> seconds;

  void Add(const NavigationRecord& n, bool stated) {
    if (!stated) return;
    ++records[n.source];
    seconds[n.source].insert(SecondOf(n.time));
  }
  std::int64_t PingsCovered(const std::string& source, const Reach& reach) const {
    const std::set<std::int64_t>& of_source = seconds.at(source);
    std::int64_t covered = 0;
    for (const auto& [second, pings] : reach.by_second) {
      const auto next = of_source.lower_bound(second - kCoveredS);
      if (next != of_source.end() && *next <= second + kCoveredS) covered += pings;
    }
    return covered;
  }
};

// Positions of one source, at most one in 5 s.
struct Places {
  std::vector<TimedPosition> positions;

  void Add(const TimedPosition& position) {
    constexpr double kApartS = 5.0;
    if (positions.empty() || std::abs(ToSeconds(position.time - positions.back().time)) > kApartS)
      positions.push_back(position);
  }
  // The first position near the median.
  GeoPosition Start() const {
    const double longitude_rad = positions[0].longitude_rad;
    std::vector<double> norths, easts;
    for (const TimedPosition& p : positions) {
      norths.push_back(p.latitude_rad);
      easts.push_back(WrapAngle(p.longitude_rad - longitude_rad));
    }
    const GeoPoint median{Median(norths), longitude_rad + Median(easts)};
    for (const TimedPosition& p : positions)
      if (DistanceM(median, p) < kFarM) return GeoPosition{p};
    return GeoPosition{positions[0]};
  }
};

// Takes the census record by record.
class Counter {
 public:
  // needs_navigation: false for soundings whose navigation is in other files.
  explicit Counter(bool needs_navigation) : needs_navigation_(needs_navigation) {}

  void operator()(const MbesPing& ping) {
    Begin(ping.time);
    std::vector<Eigen::Vector2d> soundings;
    for (const MbesBeam& beam : ping.beams) {
      if ((beam.flags & kBeamValid) == 0 || !IsPlausible(beam)) continue;
      const double range_m = 750.0 * double{beam.twtt_s};
      soundings.emplace_back(range_m * std::sin(double{beam.rx_angle_rad}),
                             range_m * std::cos(double{beam.rx_angle_rad}));
    }
    raw_.Add(ping.time, soundings);
    double longest_s = 0.0;
    for (const MbesBeam& beam : ping.beams) longest_s = std::max(longest_s, double{beam.twtt_s});
    clocks_.AddPing(ping.time, longest_s);
  }
  void operator()(const PlacedPing& ping) {
    Begin(ping.time);
    std::vector<Eigen::Vector2d> soundings;
    for (const PlacedBeam& beam : ping.soundings)
      if ((beam.flags & kBeamValid) != 0)
        soundings.emplace_back(double{beam.p_level_m.y()}, double{beam.p_level_m.z()});
    placed_.Add(ping.time, soundings);
    clocks_.AddPing(ping.time, 0.0);
    if (ping.origin_depth_m) ++census_.placed_with_depth;
  }
  void operator()(const NavigationRecord& n) {
    Begin(n.time);
    ++navigation_of_file_;
    clocks_.Add(n);
    if (n.position) {
      const TimedPosition position{*n.position, n.time};
      places_[n.source].Add(position);
      if (!IsExternal(n.source)) AddOwn(position);
    }
    if (n.grid_north_east_m) census_.grid_start.emplace(n.source, *n.grid_north_east_m);
    positions_.Add(n, n.position || n.grid_north_east_m);
    velocities_.Add(n, n.velocity.has_value());
    attitudes_.Add(n, n.attitude.has_value());
    levels_.Add(n, n.roll_pitch_rad.has_value());
    headings_.Add(n, n.heading_rad.has_value());
    heaves_.Add(n, n.heave_m && *n.heave_m != 0.0);
    still_heaves_.Add(n, n.heave_m == 0.0);
    depths_.Add(n, n.depth_m.has_value());
  }
  void operator()(const SoundVelocityProfile&) { ++census_.profiles; }
  void operator()(const SurfaceSoundSpeed&) {}
  // A `.s7k` has a record for each head, of which the last has them all.
  void operator()(const SonarInstallation& i) {
    for (auto* const first : {&census_.installation, &installation_of_file_})
      if (!*first || (*first)->transmitters.size() < i.transmitters.size()) *first = i;
  }
  void operator()(const ClockComparison& clock) { clocks_.Add(clock); }
  void operator()(const SonarSettings&) {}

  bool IsComplete() const {
    if (raw_.pings + placed_.pings == 0) return false;
    return !needs_navigation_ ||
           (IsStated(positions_) &&
            (IsStated(attitudes_) || (IsStated(levels_) && IsStated(headings_))));
  }
  const Reach& reach() const { return raw_.pings > 0 ? raw_ : placed_; }
  const std::vector<TimedPosition>& own() const { return own_; }

  void EndFile(const CheckedReader& reader, PlannedFile* file) {
    const std::string why = reader.problem().empty() ? "" : "; " + reader.problem();
    if (IsExternalNavigation(file->path) && navigation_of_file_ == 0)
      throw DataError(file->path.string() + ": no line or record of navigation that can be read" +
                      why);
    const Counters counters = reader.counters();
    for (const auto& [name, value] : counters)
      if (value > 0 && name != "mbes_beam_unusable") census_.not_read[name] += value;
    auto clocks = clocks_.Finish();
    if (file->clocks.empty()) file->clocks = std::move(clocks);  // not again where they are mended
    file->begin = std::exchange(begin_of_file_, std::nullopt);
    file->installation = std::exchange(installation_of_file_, std::nullopt);
    file->placed_alone = placed_.pings_of_file > 0 && raw_.pings_of_file == 0;
    navigation_of_file_ = 0;
    raw_.EndFile();
    placed_.EndFile();
  }
  Census Finish() {
    SetAttitudesOfPingsApart();
    KeepWhatCovers({&positions_});
    // Roll and pitch with a heading of another record are as good as an attitude.
    if (headings_.records.empty())
      KeepWhatCovers({&attitudes_});
    else
      KeepWhatCovers({&attitudes_, &levels_});
    KeepWhatCovers({&headings_});
    KeepWhatCovers({&depths_});
    for (const auto& [source, records] : heaves_.records) still_heaves_.records.erase(source);
    census_.positions = positions_.records;
    census_.velocities = velocities_.records;
    census_.attitudes = attitudes_.records;
    census_.levels = levels_.records;
    census_.headings = headings_.records;
    census_.heaves = heaves_.records;
    census_.still_heaves = still_heaves_.records;
    census_.depths = depths_.records;
    for (const auto& [source, places] : places_) census_.start.emplace(source, places.Start());
    census_.raw_pings = raw_.pings;
    census_.placed_pings = placed_.pings;
    census_.depth_m = reach().depths_m.MedianOr0();
    census_.max_range_m = reach().max_range_m;
    census_.ping_interval_s = reach().intervals_s.MedianOr0();
    return std::move(census_);
  }

 private:
  // For comparison with an SBET: 200 positions, 5 s apart.
  void AddOwn(const TimedPosition& position) {
    constexpr std::size_t kMost = 200;
    constexpr double kApartS = 5.0;
    if (own_.empty() ||
        (own_.size() < kMost && ToSeconds(position.time - own_.back().time) > kApartS))
      own_.push_back(position);
  }
  void Begin(Time t) {
    if (!begin_of_file_ || t < *begin_of_file_) begin_of_file_ = t;
  }
  bool IsStated(const Quantity& quantity) const {
    return std::any_of(quantity.records.begin(), quantity.records.end(), [this](const auto& entry) {
      return entry.first != kHeadingOfPings && (raw_.pings == 0 || !IsOfPings(entry.first));
    });
  }
  // Beside raw pings they are too seldom; a heading alone is for want of an attitude.
  void SetAttitudesOfPingsApart() {
    for (const auto& [source, records] : attitudes_.records)
      if (IsOfPings(source) && (raw_.pings > 0 || source == kHeadingOfPings))
        census_.attitudes_of_pings[source] = records;
    for (const auto& [source, records] : census_.attitudes_of_pings)
      attitudes_.records.erase(source);
  }
  // Erases the sources that cover much less of the pings than the best among these quantities.
  void KeepWhatCovers(std::initializer_list<Quantity*> quantities) const {
    std::map<std::string, std::int64_t> covered;
    std::int64_t best = 0;
    for (const Quantity* const quantity : quantities)
      for (const auto& [source, records] : quantity->records) {
        if (IsExternal(source)) continue;
        covered[source] = quantity->PingsCovered(source, reach());
        best = std::max(best, covered[source]);
      }
    const double least = kLeastShare * static_cast<double>(best);
    for (Quantity* const quantity : quantities)
      std::erase_if(quantity->records, [&](const auto& entry) {
        const auto found = covered.find(entry.first);
        return found != covered.end() && static_cast<double>(found->second) < least;
      });
  }

  const bool needs_navigation_;
  Census census_;
  Reach raw_, placed_;
  Quantity positions_, velocities_, attitudes_, levels_, headings_, heaves_, still_heaves_, depths_;
  std::map<std::string, Places> places_;
  std::vector<TimedPosition> own_;
  // Of the present file.
  FileClocks clocks_;
  std::optional<SonarInstallation> installation_of_file_;
  std::optional<Time> begin_of_file_;
  std::int64_t navigation_of_file_ = 0;
};

void Look(PlannedFile* file, Counter* counter) {
  auto found = ReaderFor(file->path, file->params);
  if (!found) throw DataError(file->path.string() + ": no survey file of a format that is known");
  CheckedReader reader(std::move(found), file->params.clock_offsets_s);
  std::ifstream in(file->path, std::ios::binary);
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < kHeadBytes || !counter->IsComplete();) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    read += got;
    for (const SurveyRecord& record : reader.Add(Bytes(piece.data(), got)))
      std::visit(*counter, record);
  }
  for (const SurveyRecord& record : reader.Finish()) std::visit(*counter, record);
  counter->EndFile(reader, file);
}

// Time of the survey: the first ping, else the earliest record, else that which soundings by line
// state.
std::optional<Time> TimeOfSurvey(const std::vector<PlannedFile>& files, const Counter& counter) {
  std::optional<Time> time = counter.reach().first;
  if (time) return time;
  for (const PlannedFile& file : files)
    if (file.begin && (!time || *file.begin < *time)) time = file.begin;
  for (const PlannedFile& file : files)
    if (!time && IsLineFile(file.path)) time = FirstTimeOf(file.path);
  return time;
}

}  // namespace

Census TakeCensus(std::vector<PlannedFile>* files) {
  Counter counter(true);
  for (PlannedFile& file : *files)
    if (!IsSbet(file.path) && !IsLineFile(file.path)) Look(&file, &counter);
  // An SBET states only the time of the week: it is read after the survey.
  for (PlannedFile& file : *files) {
    if (!IsSbet(file.path)) continue;
    const std::optional<Time> time = TimeOfSurvey(*files, counter);
    if (!time)
      throw DataError(file.path.string() + ": an SBET needs the survey beside it, for its week");
    file.params.sbet = SbetParamsFor(file.path, *time, counter.own());
    Look(&file, &counter);
  }
  return counter.Finish();
}

Census TakeLineCensus(std::vector<PlannedFile>* files) {
  Counter counter(false);
  for (PlannedFile& file : *files) {
    if (!IsLineFile(file.path)) continue;
    const std::optional<Time> begin = file.begin;
    Look(&file, &counter);
    if (begin && (!file.begin || *begin < *file.begin)) file.begin = begin;
  }
  return counter.Finish();
}

void AddLines(const Census& lines, Census* census) {
  const bool alone = census->raw_pings + census->placed_pings == 0;
  census->placed_pings += lines.placed_pings;
  census->placed_with_depth += lines.placed_with_depth;
  for (const auto& [reason, records] : lines.not_read) census->not_read[reason] += records;
  if (!alone) return;
  census->depth_m = lines.depth_m;
  census->max_range_m = lines.max_range_m;
  census->ping_interval_s = lines.ping_interval_s;
}

bool IsOfPings(const std::string& source) {
  return source == "#MRZ" || source == "gsf_ping" || source == kHeadingOfPings;
}

}  // namespace seastitch
