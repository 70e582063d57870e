#include "survey/replay/finished_map.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <variant>

#include "common/core/archive.hpp"
#include "common/geo/map_frame.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "common/runtime/process/process.hpp"
#include "common/storage/crc32.hpp"
#include "mapper/restart/saved_map.hpp"
#include "products/map/map_points.hpp"
#include "survey/errors.hpp"
#include "survey/session/dive_front.hpp"

namespace seastitch {

template <class Archive>
void Fields(Archive& archive, Of<Archive, TimeOffsetEstimate>& offset) {
  archive(offset.add_s, offset.sigma_s, offset.pings, offset.change_before, offset.change_after);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, SonarTimingEstimate>& timing) {
  // The place of an estimate that earlier versions of the program made.
  std::optional<TimeOffsetEstimate> unused;
  archive(timing.configured_s, timing.placed_by_source, timing.roll, unused);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, StampOffsetEstimate>& offset) {
  archive(offset.key, offset.configured_s, offset.add_s, offset.sigma_s, offset.suspected_s);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, NavigationDifference>& difference) {
  archive(difference.source, difference.states, difference.duration_s, difference.rms_m);
  archive(difference.max_m, difference.heading_mean_deg);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, TrackState>& state) {
  archive(state.time, state.p_map, state.rpy_rad, state.sigma, state.chain);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, SurveyInput>& input) {
  archive(input.name, input.first, input.last);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, UnreadDive>& dive) {
  archive(dive.name, dive.reason);
}

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "SEASTITCH MAP\n";
// Every change of the format changes it; the journal inside has its own, kJournalFormat.
// Format 1 has no smoothed track, and 2 no submaps that know the DVL's angle (journals of format
// 5).
constexpr std::uint32_t kFormat = 3;
constexpr std::uint32_t kOldestFormat = 1;
constexpr std::uint32_t kOldestJournal = 5;

using Counts = std::vector<std::pair<std::string, std::int64_t>>;

// Content of the file.
struct StoredDive {
  std::string name;
  double dvl_yaw_rad = 0.0;
  Counts counters;
  std::vector<std::string> conditions;
  SonarTimingEstimate sonar;
  std::vector<StampOffsetEstimate> stamp_offsets;
  std::optional<NavigationDifference> other_navigation;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.name, self.dvl_yaw_rad, self.counters, self.conditions, self.sonar);
    archive(self.stamp_offsets, self.other_navigation);
  }
};

struct StoredMap {
  std::string program_version;
  std::optional<std::pair<double, double>> datum;  // latitude, longitude [degrees]
  std::vector<StoredDive> dives;
  std::vector<std::vector<std::uint8_t>> journal;
  std::vector<std::pair<SubmapId, std::uint32_t>> points_crc;
  std::vector<TrackState> track;
  std::vector<SurveyInput> inputs;
  std::vector<UnreadDive> unread;
  Counts refused;
  ConfigTexts configuration;
  // Not saved as fields: is_straight, whether the clouds among the products were straightened by
  // what navigation learnt later; journal_format.
  bool is_straight = false;
  std::uint32_t journal_format = kJournalFormat;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.program_version, self.datum, self.dives, self.journal, self.points_crc);
    archive(self.track, self.inputs, self.unread, self.refused, self.configuration);
  }
};

std::string BytesOf(const fs::path& path) {
  std::optional<std::string> bytes = ReadWholeFile(path);
  if (!bytes) throw std::runtime_error(path.string() + ": cannot be read");
  return *std::move(bytes);
}

fs::path PointsFile(const fs::path& folder, SubmapId id) {
  return folder / "submaps" / ("submap_" + std::to_string(id.value) + ".pcd");
}

// ---- writing

StoredDive ToStored(const Survey& survey,
                    const ProductOptions& products,
                    Outcome outcome,
                    std::size_t dive) {
  StoredDive stored;
  if (dive < survey.dives.size()) stored.name = survey.dives[dive];
  const auto chain = static_cast<std::int32_t>(dive);
  if (outcome == Outcome::kCorrected)
    stored.dvl_yaw_rad = survey.solution.MountingOf(chain).dvl_yaw_rad;
  if (dive >= products.dives.size()) return stored;
  const DiveReport& report = products.dives[dive];
  stored.counters.assign(report.counters.begin(), report.counters.end());
  stored.conditions = report.conditions;
  stored.sonar = report.sonar;
  stored.stamp_offsets = report.stamp_offsets;
  stored.other_navigation = report.other_navigation;
  return stored;
}

// ---- reading

// The journal does not fit together: a fault of the program that wrote it.
std::runtime_error Inconsistent() {
  return std::runtime_error("its content does not fit together");
}

void Expect(bool fits) {
  if (!fits) throw Inconsistent();
}

bool IsFinite(const Pose2& pose) { return pose.Vector().allFinite(); }

bool IsFinite(const GraphEdge& edge) {
  return IsFinite(edge.T_from_to) && edge.information.allFinite() &&
         edge.overlap_center_m.allFinite() && std::isfinite(edge.dvl_yaw_rad);
}

StoredMap Decode(std::string_view bytes) {
  if (!bytes.starts_with(kMagic)) throw std::runtime_error("not a file of a map");
  const Bytes rest = AsBytes(bytes.substr(kMagic.size()));
  ByteReader reader(rest);
  const auto format = reader.Le<std::uint32_t>();
  const auto journal_format = reader.Le<std::uint32_t>();
  const auto crc = reader.Le<std::uint32_t>();
  const bool is_known = format >= kOldestFormat && format <= kFormat;
  if (reader.ok() &&
      (!is_known || journal_format < kOldestJournal || journal_format > kJournalFormat))
    throw std::runtime_error("of another version of Seastitch: map its dives again");
  const Bytes content = rest.subspan(reader.at());
  if (!reader.ok() || crc != Crc32(content)) throw std::runtime_error("damaged");
  StoredMap stored;
  ArchiveReader archive(content);
  archive(stored);
  std::vector<std::optional<Pose2>> smoothed(stored.track.size());
  if (format > 1) archive(smoothed);
  if (format > 2) archive(stored.is_straight);
  stored.journal_format = journal_format;
  Expect(archive.IsDone() && !stored.dives.empty() && smoothed.size() == stored.track.size());
  for (std::size_t i = 0; i < smoothed.size(); ++i) {
    Expect(!smoothed[i] || IsFinite(*smoothed[i]));
    stored.track[i].smoothed = smoothed[i];
  }
  return stored;
}

// Builds the submaps from the journal's entries, in their order.
class SubmapReader {
 public:
  explicit SubmapReader(std::size_t num_dives) : num_dives_(static_cast<std::int32_t>(num_dives)) {}

  void Add(const JournalEntry& entry) {
    if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) Add(*closed);
    if (const auto* growth = std::get_if<GraphGrowth>(&entry)) Add(*growth);
  }

  std::vector<FinishedSubmap> Take() {
    Expect(!submaps_.empty() && in_graph_.size() == submaps_.size());
    std::int32_t dive = 0;
    for (FinishedSubmap& submap : submaps_) {
      Chain& chain = submap.dive.chain;
      Expect(chain.number >= dive && chain.number < num_dives_);
      dive = chain.number;
      chain.map_begins_at = submaps_.front().submap.id;
      for (const GraphEdge& edge : submap.dive.position_edges)
        if (edge.kind == EdgeKind::kDeadReckoning)
          chain.start_covariance =
              StartCovariance(edge, submap.submap.heading_sigma_rad.value_or(kPi));
    }
    return std::move(submaps_);
  }

 private:
  void Add(const ClosedSubmap& closed) {
    const Submap& submap = *closed.submap;
    Expect(submap.id.value >= 0 && submap.T_map_submap.matrix().allFinite());
    Expect(!submap.covariance_from_previous || submap.covariance_from_previous->allFinite());
    Expect(!submap.heading_sigma_rad || std::isfinite(*submap.heading_sigma_rad));
    Expect(std::isfinite(submap.heading_spread) && std::isfinite(submap.drift_per_m) &&
           std::isfinite(submap.dvl_yaw_rad));
    Expect(submaps_.empty() || submaps_.back().submap.id < submap.id);
    submaps_.push_back({submap, {}, std::nullopt});
  }

  void Add(const GraphGrowth& growth) {
    for (const GraphStep& step : growth.steps) Add(step.update);
    if (growth.pairs.empty()) return;
    RegistrationResultSet job;
    for (const LoopPair& pair : growth.pairs) {
      Expect(IsInGraph(pair.target) && IsInGraph(pair.source) && pair.target < pair.source);
      Expect(IsFinite(pair.prior.T_a_b) && pair.prior.covariance.allFinite());
      pairs_.insert({pair.target, pair.source});
    }
    for (const GraphEdge& edge : growth.registered)
      Expect(pairs_.contains({edge.from, edge.to}) && IsFinite(edge));
    for (const std::vector<double>& numbers : growth.statistics) {
      ClosureStatistics closure = ClosureStatisticsFromNumbers(numbers);
      Expect(pairs_.contains({closure.target, closure.source}));
      job.statistics.push_back(std::move(closure));
    }
    job.job.pairs = growth.pairs;
    job.edges = growth.registered;
    submaps_.back().dive.replayed_jobs.push_back(std::move(job));
  }

  // Takes what comes from outside the graph: dives and absolute positions.
  void Add(const GraphUpdate& update) {
    for (const GraphVertex& vertex : update.vertices) {
      Chain& chain = Find(vertex.id)->dive.chain;
      Expect(in_graph_.insert(vertex.id).second && update.mounting.AreUsable());
      chain.number = vertex.chain;
      chain.mounting = update.mounting;
    }
    for (const GraphEdge& edge : update.edges) {
      Expect(IsFinite(edge));
      if (edge.from == edge.to) Find(edge.from)->dive.position_edges.push_back(edge);
    }
  }

  FinishedSubmap* Find(SubmapId id) {
    const auto found =
        std::lower_bound(submaps_.begin(), submaps_.end(), id, [](const auto& s, SubmapId wanted) {
          return s.submap.id < wanted;
        });
    Expect(found != submaps_.end() && found->submap.id == id);
    return &*found;
  }
  bool IsInGraph(SubmapId id) const { return in_graph_.contains(id); }

  const std::int32_t num_dives_;
  std::vector<FinishedSubmap> submaps_;
  std::set<SubmapId> in_graph_;
  std::set<std::pair<SubmapId, SubmapId>> pairs_;  // registered
};

std::vector<FinishedSubmap> SubmapsOf(const StoredMap& stored, const fs::path& folder) {
  SubmapReader reader(stored.dives.size());
  for (const std::vector<std::uint8_t>& bytes : stored.journal) {
    const std::optional<JournalEntry> entry = DecodeJournalEntry(bytes, stored.journal_format);
    Expect(entry.has_value());
    reader.Add(*entry);
  }
  std::vector<FinishedSubmap> submaps = reader.Take();
  const std::map<SubmapId, std::uint32_t> points_crc(stored.points_crc.begin(),
                                                     stored.points_crc.end());
  std::map<std::int32_t, double> newest_yaw_rad;  // by dive
  for (const FinishedSubmap& submap : submaps)
    newest_yaw_rad[submap.dive.chain.number] = submap.submap.dvl_yaw_rad;
  for (FinishedSubmap& submap : submaps) {
    const SubmapId id = submap.submap.id;
    const auto dive = static_cast<std::size_t>(submap.dive.chain.number);
    double sheared_rad = stored.dives[dive].dvl_yaw_rad;
    if (stored.is_straight)
      sheared_rad += newest_yaw_rad[submap.dive.chain.number] - submap.submap.dvl_yaw_rad;
    if (const auto crc = points_crc.find(id); crc != points_crc.end())
      submap.points = {PointsFile(folder, id), crc->second, sheared_rad};
  }
  return submaps;
}

std::vector<FinishedDive> DivesOf(StoredMap* stored, const std::string& map_name) {
  std::vector<FinishedDive> dives;
  for (StoredDive& dive : stored->dives)
    dives.push_back({dive.name.empty() ? map_name : map_name + ": " + dive.name,
                     {{dive.counters.begin(), dive.counters.end()},
                      std::move(dive.conditions),
                      dive.sonar,
                      std::move(dive.stamp_offsets),
                      std::move(dive.other_navigation)}});
  return dives;
}

bool HasPointsFile(const FinishedSubmap& submap) {
  return submap.points && fs::exists(submap.points->file);
}

void ExpectInOrder(const std::vector<TrackState>& track, std::size_t num_dives) {
  for (std::size_t i = 0; i < track.size(); ++i) {
    Expect(track[i].chain >= 0 && track[i].chain < static_cast<std::int32_t>(num_dives));
    if (i > 0)
      Expect(std::pair(track[i - 1].chain, track[i - 1].time) <
             std::pair(track[i].chain, track[i].time));
  }
}

// T_new_old of two map frames, exact at a position and its north in the old one.
Pose2 Between(const Datum& old_datum, const Datum& new_datum, const Eigen::Vector2d& at_m) {
  const MapFrame from(old_datum), to(new_datum);
  const auto moved = [&](const Eigen::Vector2d& p_m) -> Eigen::Vector2d {
    return to.NorthEastOf(from.PointAt(p_m));
  };
  constexpr double kNorthM = 1000.0;
  const Eigen::Vector2d here = moved(at_m);
  const Eigen::Vector2d north = moved(at_m + Eigen::Vector2d(kNorthM, 0.0)) - here;
  const Pose2 turned{0.0, 0.0, std::atan2(north.y(), north.x())};
  const Eigen::Vector2d origin = here - turned.Rotation() * at_m;
  return {origin.x(), origin.y(), turned.yaw};
}

void Move(const Pose2& T_new_old, GraphEdge* edge) {
  edge->T_from_to = T_new_old * edge->T_from_to;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  turned.topLeftCorner<2, 2>() = T_new_old.Rotation();
  edge->information = turned * edge->information * turned.transpose();
}

}  // namespace

void MapRecorder::Add(const MapperEvent& event) {
  const auto* entry = std::get_if<JournalEntry>(&event);
  if (entry == nullptr || std::holds_alternative<SoundVelocityProfile>(*entry)) return;
  journal_.push_back(Encode(*entry));
}

void WriteFinishedMap(const fs::path& folder,
                      const MapRecorder& recorder,
                      const Survey& survey,
                      const ProductOptions& products,
                      Outcome outcome,
                      const ConfigTexts& configuration) {
  StoredMap stored;
  stored.program_version = ProgramVersion();
  if (products.datum) stored.datum = {products.datum->latitude_deg, products.datum->longitude_deg};
  for (std::size_t dive = 0; dive < std::max<std::size_t>(1, survey.dives.size()); ++dive)
    stored.dives.push_back(ToStored(survey, products, outcome, dive));
  stored.journal = recorder.journal();
  for (const SurveySubmap& submap : survey.submaps) {
    if (submap.points == 0) continue;
    const std::string bytes = BytesOf(PointsFile(folder, submap.id));
    stored.points_crc.emplace_back(submap.id, Crc32(AsBytes(bytes)));
  }
  stored.track = survey.track;
  stored.inputs = survey.inputs;
  stored.unread = products.unread;
  if (!products.partial.empty()) stored.unread.push_back({"", products.partial});
  stored.refused.assign(products.refused.begin(), products.refused.end());
  stored.configuration = configuration;

  ArchiveWriter archive;
  archive(stored);
  std::vector<std::optional<Pose2>> smoothed;
  for (const TrackState& state : stored.track) smoothed.push_back(state.smoothed);
  archive(smoothed, outcome == Outcome::kCorrected);
  const std::vector<std::uint8_t> content = archive.Release();
  ByteWriter file;
  file.Append(AsBytes(kMagic));
  file.Le(kFormat);
  file.Le(kJournalFormat);
  file.Le(Crc32(content));
  file.Append(content);
  const std::vector<std::uint8_t> bytes = file.Release();
  WriteAtomically(folder / kFinishedMapFile,
                  {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

bool IsFinishedMap(const fs::path& folder) {
  return fs::exists(folder / kFinishedMapFile) ||
         (fs::exists(folder / "report.json") && fs::exists(folder / "track.csv"));
}

FinishedMap ReadFinishedMap(const fs::path& folder, const std::string& name) {
  const fs::path file = folder / kFinishedMapFile;
  if (!fs::exists(file))
    throw DataError(folder.string() + ": this map has no " + kFinishedMapFile +
                    ": it is of an older version, without soundings, or of recorded results "
                    "(--as-recorded); map its dives again");
  try {
    StoredMap stored = Decode(BytesOf(file));
    if (!stored.datum)
      throw std::runtime_error("a map of imported submaps has no map origin, and cannot be joined");
    ExpectInOrder(stored.track, stored.dives.size());
    FinishedMap map;
    map.submaps = SubmapsOf(stored, folder);
    if (std::none_of(map.submaps.begin(), map.submaps.end(), HasPointsFile))
      throw std::runtime_error("none of the files in submaps/ that it names is there");
    map.program_version = stored.program_version;
    map.datum = {stored.datum->first, stored.datum->second};
    map.dives = DivesOf(&stored, name);
    map.track = std::move(stored.track);
    map.inputs = std::move(stored.inputs);
    map.refused = {stored.refused.begin(), stored.refused.end()};
    map.configuration = std::move(stored.configuration);
    for (const UnreadDive& dive : stored.unread)
      map.unread.push_back({dive.name.empty() ? name : name + ": " + dive.name, dive.reason});
    return map;
  } catch (const std::exception& e) {
    throw DataError(file.string() + ": " + e.what());
  }
}

PointCloud LoadPoints(const FinishedSubmap& submap) {
  if (!submap.points) return {};
  const FinishedPoints& points = *submap.points;
  const std::string bytes = BytesOf(points.file);
  if (Crc32(AsBytes(bytes)) != points.crc)
    throw std::runtime_error(points.file.string() + ": not as the replay wrote it");
  SurveySubmap sheared;
  sheared.T_map_submap = submap.submap.T_map_submap;
  sheared.cloud_file = points.file;
  sheared.points = 1;
  return LoadCloud(sheared, -points.dvl_yaw_rad);
}

void MoveTo(const Datum& datum, FinishedMap* map) {
  constexpr double kSameDeg = 1e-11;  // 1 um; an angle may have been in radians in between
  if (std::abs(datum.latitude_deg - map->datum.latitude_deg) < kSameDeg &&
      std::abs(datum.longitude_deg - map->datum.longitude_deg) < kSameDeg)
    return;
  const Eigen::Isometry3d& first = map->submaps.front().submap.T_map_submap;
  const Pose2 T_new_old = Between(map->datum, datum, first.translation().head<2>());
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.translation().head<2>() = T_new_old.Translation();
  moved.linear().topLeftCorner<2, 2>() = T_new_old.Rotation();
  map->datum = datum;
  for (FinishedSubmap& submap : map->submaps) {
    submap.submap.T_map_submap = moved * submap.submap.T_map_submap;
    for (GraphEdge& edge : submap.dive.position_edges) Move(T_new_old, &edge);
  }
  for (TrackState& state : map->track) {
    state.p_map = moved * state.p_map;
    state.rpy_rad.z() = WrapAngle(state.rpy_rad.z() + T_new_old.yaw);
    if (state.smoothed) state.smoothed = T_new_old * *state.smoothed;
  }
}

void Renumber(std::int32_t first_submap, std::int32_t first_dive, FinishedMap* map) {
  const auto add = [&](SubmapId* id) { id->value += first_submap; };
  for (FinishedSubmap& submap : map->submaps) {
    add(&submap.submap.id);
    add(&submap.dive.chain.map_begins_at);
    submap.dive.chain.number += first_dive;
    for (GraphEdge& edge : submap.dive.position_edges) {
      add(&edge.from);
      add(&edge.to);
    }
    for (RegistrationResultSet& job : submap.dive.replayed_jobs) {
      for (LoopPair& pair : job.job.pairs) {
        add(&pair.target);
        add(&pair.source);
      }
      for (GraphEdge& edge : job.edges) {
        add(&edge.from);
        add(&edge.to);
      }
      for (ClosureStatistics& closure : job.statistics) {
        add(&closure.target);
        add(&closure.source);
      }
    }
  }
}

}  // namespace seastitch
