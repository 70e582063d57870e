#include "survey/replay/several_dives.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/geo/map_frame.hpp"
#include "optimizer/optimizer_config.hpp"
#include "products/files/sounding_log.hpp"
#include "survey/errors.hpp"
#include "survey/progress.hpp"
#include "survey/session/dive_front.hpp"
#include "survey/session/other_navigation.hpp"
#include "survey/session/ping_inputs.hpp"
#include "survey/session/soundings_stage.hpp"

namespace seastitch {
namespace {

std::size_t NumChains(const std::vector<Dive>& dives) {
  std::size_t chains = 0;
  for (const Dive& dive : dives) chains += dive.input.map ? dive.input.map->dives.size() : 1;
  return chains;
}

// One back end for the submaps of all dives.
class CombinedSurvey {
 public:
  CombinedSurvey(const std::vector<Dive>& dives,
                 std::filesystem::path store,
                 Outputs outputs,
                 SkippedDives* unread,
                 ReplayInput* replay_input)
      : first_(dives.front()),
        has_names_(NumChains(dives) > 1),
        store_(std::move(store)),
        outputs_(std::move(outputs)),
        unread_(unread),
        replay_input_(replay_input),
        session_(BackEnd(),
                 LoadOptimizerConfig(first_.config.optimizer.string()),
                 outputs_.collector,
                 replay_input->stopped,
                 outputs_.on_event) {}

  void Add(Dive* dive) {
    if (!replay_input_->quiet) std::fprintf(stderr, "dive %s\n", dive->name.c_str());
    if (dive->input.map)
      AddMap(dive);
    else
      AddDive(dive);
  }

  void Finish() {
    session_.Finish();
    if (session_.mapper().mapper().has_withheld()) outputs_.rounds->Withhold();
    ProductOptions* const products = outputs_.products;
    products->mapper_counters = session_.mapper().counters();
    products->conditions = session_.mapper().Conditions(session_.optimizer_faults());
    for (const auto& [reason, count] : session_.refused()) replay_input_->refused[reason] += count;
    TakeNoise(session_.mapper().mapper(), first_.mapper, products);
    ExpectSubmaps(
        *outputs_.collector, first_.input.survey_files != nullptr, statements_, *replay_input_);
    if (!has_names_) products->noise.timing = products->dives.front().sonar;
  }

 private:
  MapperConfig BackEnd() const {
    MapperConfig config = first_.mapper;
    config.map_dir = store_ / "all";
    return config;
  }

  void AddDive(Dive* dive) {
    outputs_.collector->BeginDive(dive->name);
    dive->mapper.map_dir = store_ / std::to_string(next_chain_);
    DiveFront front(
        dive->mapper,
        next_chain_,
        next_id_,
        [&](Submap submap, Mapper::OfDive of_dive) {
          ExpectNew(submap, of_dive.chain, *dive);
          session_.AddSubmap(std::move(submap), std::move(of_dive));
        },
        [&](const NavState& nav) { outputs_.collector->Add(nav); });
    front.mapper().mapper().OnSmoothed(
        [this](const SmoothedPose& pose) { outputs_.collector->Add(pose); });
    SoundingLog* const soundings = outputs_.products->soundings;
    const bool exported = outputs_.products->sounding_format.has_value();
    PingInputs inputs(dive->input.names, exported, dive->mapper.sonar_time_offset_s);
    const auto first_input = static_cast<std::uint16_t>(replay_input_->spans.size());
    std::optional<SoundingsStage> placed;
    if (soundings != nullptr) {
      placed.emplace(soundings, outputs_.rounds->Begin(next_chain_, dive));
      front.mapper().mapper().OnSoundings([&](SubmapSoundings submap) {
        std::vector<std::uint16_t> of_pings = inputs.Take(submap);
        for (std::uint16_t& input : of_pings)
          input = static_cast<std::uint16_t>(input + first_input);
        submap.id.value += next_id_;
        placed->Add(std::move(submap), std::move(of_pings));
      });
    }
    std::optional<OtherNavigation> other;
    if (dive->input.logs) other.emplace(dive->mapper);
    const InputFaults faults = FeedDive(dive, [&](const Received& sample, std::size_t input) {
      inputs.Add(sample.sample, input);
      if (other) other->Add(sample);
      front.Add(sample);
    });
    front.Finish();
    if (placed) placed->Finish();
    if (!given_twice_.empty()) throw UsageError("replay: " + given_twice_);
    if (front.mapper().mapper().noise().timing.placed_by_source) outputs_.rounds->Drop(next_chain_);
    if (other)
      replay_input_->other_tracks.push_back({next_chain_, other->source(), other->Finish()});
    outputs_.products->dives.push_back(ReportOf(front.mapper(), faults));
    const std::string among = has_names_ ? dive->name : "";
    SayHowMapped(dive->input, front.mapper().mapper(), among, replay_input_);
    WarnOfDepths(front.mapper().mapper(), among, replay_input_);
    ++next_chain_;
    next_id_ = front.next_id();
    statements_ += dive->name + ": " + front.mapper().Statement(faults.conditions) + "; ";
    AddSpans(inputs.spans());
    if (inputs.unknown() > 0)
      replay_input_->refused["pings_of_an_unknown_input"] += inputs.unknown();
  }

  // The files of a dive and a map of it would count twice, and so would two maps of it. A dive is
  // known by its first submap: by the time of its first ping and its depth, which no map origin
  // changes. No exception, since the front is at work.
  void ExpectNew(const Submap& submap, const Chain& chain, const Dive& input) {
    if (!begun_.insert(chain.number).second) return;
    const auto [place, is_new] =
        input_of_.try_emplace({submap.start, submap.T_map_submap.translation().z()}, &input);
    const Dive& same = *place->second;
    if (is_new || (!same.input.map && !input.input.map)) return;
    given_twice_ = input.name + ": its dive is in " + same.name + ", too; leave one of them out";
  }

  InputFaults FeedDive(Dive* dive, const TakeSample& take) {
    InputFaults faults;
    const std::map<std::string, std::int64_t> refused_before =
        std::exchange(replay_input_->refused, {});
    unread_->Try(dive->name, [&] { faults = Feed(&dive->input, nullptr, take, replay_input_); });
    for (const auto& [reason, count] : refused_before) replay_input_->refused[reason] += count;
    return faults;
  }

  void AddSpans(const std::vector<SurveyInput>& spans) {
    replay_input_->spans.insert(replay_input_->spans.end(), spans.begin(), spans.end());
  }

  void AddMap(Dive* dive) {
    FinishedMap& map = *dive->input.map;
    const VehicleGeometry& vehicle = dive->mapper.vehicle;
    MoveTo(DatumOf(vehicle), &map);
    Renumber(next_id_, next_chain_, &map);
    for (const FinishedSubmap& submap : map.submaps)
      ExpectNew(submap.submap, submap.dive.chain, *dive);
    if (!given_twice_.empty()) throw UsageError("replay: " + given_twice_);
    for (std::size_t k = 0; k < map.dives.size(); ++k) {
      if (has_names_) outputs_.collector->BeginDive(map.dives[k].name);
      for (const TrackState& state : map.track)
        if (state.chain == static_cast<std::int32_t>(k)) outputs_.collector->Add(state);
      outputs_.products->dives.push_back(std::move(map.dives[k].report));
    }
    const SubmapId last = map.submaps.back().submap.id;
    AddSubmaps(&map);
    for (const UnreadDive& of_map : map.unread) unread_->Add(of_map);
    for (const auto& [reason, count] : map.refused) replay_input_->refused[reason] += count;
    next_chain_ += static_cast<std::int32_t>(map.dives.size());
    next_id_ = last.value + 1;
    AddSpans(map.inputs);
  }

  void AddSubmaps(FinishedMap* map) {
    ProgressLine progress("adding submaps", map->submaps.size(), replay_input_->quiet);
    for (std::size_t i = 0; i < map->submaps.size(); ++i) {
      if (replay_input_->stopped())
        return NoteStop(static_cast<int>(100 * i / map->submaps.size()), replay_input_);
      FinishedSubmap& submap = map->submaps[i];
      try {
        submap.submap.cloud = LoadPoints(submap);
      } catch (const std::runtime_error& e) {
        std::fprintf(stderr, "points left out: %s\n", e.what());
        ++replay_input_->refused["submaps_of_a_map_without_their_points"];
      }
      session_.AddSubmap(std::move(submap.submap), std::move(submap.dive));
      progress.Advance(1);
    }
    progress.Finish();
  }

  const Dive& first_;
  const bool has_names_;  // of dives; not for a map of one dive alone
  const std::filesystem::path store_;
  const Outputs outputs_;
  SkippedDives* const unread_;
  ReplayInput* const replay_input_;
  MappingSession session_;
  std::int32_t next_id_ = 0;
  std::int32_t next_chain_ = 0;
  std::string statements_;
  std::set<std::int32_t> begun_;                             // chains with a submap
  std::map<std::pair<Time, double>, const Dive*> input_of_;  // by time and depth of the first
  std::string given_twice_;                                  // sentence; empty: none was
};

}  // namespace

void SkippedDives::Add(const UnreadDive& dive) {
  // A replay may read its inputs again.
  if (Has(dive.name)) return;
  std::fprintf(stderr, "%s: %s\n", dive.name.c_str(), dive.reason.c_str());
  dives_.push_back(dive);
}

bool SkippedDives::Has(const std::string& name) const {
  return std::any_of(
      dives_.begin(), dives_.end(), [&](const UnreadDive& dive) { return dive.name == name; });
}

bool SkippedDives::Try(const std::string& dive, const std::function<void()>& step) {
  try {
    step();
    return true;
  } catch (const std::runtime_error& e) {
    if (!several_) throw;
    if (!first_) first_ = std::current_exception();
    if (Has(dive)) return false;
    std::fprintf(stderr, "%s: left out: %s\n", dive.c_str(), e.what());
    dives_.push_back({dive, e.what()});
    return false;
  }
}

void TakeNoise(const Mapper& mapper, const MapperConfig& config, ProductOptions* products) {
  products->noise = mapper.noise();
  if (!config.loop_closer.estimate_noise) products->noise_not_estimated = "estimate_noise is off";
}

void ExpectSubmaps(const SurveyCollector& collector,
                   bool survey_files,
                   const std::string& statement,
                   const ReplayInput& replay_input) {
  if (collector.submaps() > 0) return;
  if (!replay_input.partial.empty()) throw std::runtime_error("no submap: " + replay_input.partial);
  if (survey_files) throw DataError("no submap: " + statement);
  throw std::runtime_error("no submap: " + statement);
}

void UseDatum(const Datum& datum, std::vector<Dive>* dives) {
  const MapFrame map(datum);
  for (Dive& dive : *dives) {
    VehicleGeometry& vehicle = dive.mapper.vehicle;
    const MapFrame own(DatumOf(vehicle));
    NavigationParams& start = dive.mapper.navigation;
    const Eigen::Vector2d north_east_m =
        map.NorthEastOf(own.PointAt({start.start_north_m, start.start_east_m}));
    start.start_north_m = north_east_m.x();
    start.start_east_m = north_east_m.y();
    vehicle.datum.latitude_rad = Deg2Rad(datum.latitude_deg);
    vehicle.datum.longitude_rad = Deg2Rad(datum.longitude_deg);
  }
}

void ShareGrid(const std::vector<Dive>& dives) {
  std::optional<Eigen::Vector2d> origin_m;
  for (const Dive& dive : dives) {
    SurveyFiles* const survey = dive.input.survey_files.get();
    if (survey == nullptr || !survey->plan().grid_origin_m) continue;
    if (!origin_m) origin_m = survey->plan().grid_origin_m;
    survey->UseGridOrigin(*origin_m);
  }
}

void RemakeTogether(std::vector<Dive>* dives,
                    const std::filesystem::path& store,
                    const Outputs& outputs,
                    SkippedDives* unread,
                    ReplayInput* replay_input) {
  CombinedSurvey together(*dives, store, outputs, unread, replay_input);
  for (Dive& dive : *dives)
    if (!replay_input->stopped()) together.Add(&dive);
  together.Finish();
}

}  // namespace seastitch
