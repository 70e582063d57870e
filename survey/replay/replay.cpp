#include "survey/replay/replay.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "bench/truth.hpp"
#include "common/geo/map_frame.hpp"
#include "common/runtime/config/config.hpp"
#include "common/runtime/process/freed_memory.hpp"
#include "mapper/mapper_config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "products/files/sounding_log.hpp"
#include "products/product_files.hpp"
#include "products/survey_collector.hpp"
#include "survey/errors.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/survey_groups.hpp"
#include "survey/replay/calibration_rounds.hpp"
#include "survey/replay/interruption.hpp"
#include "survey/replay/output_folder.hpp"
#include "survey/replay/replay_feed.hpp"
#include "survey/replay/replay_input.hpp"
#include "survey/replay/several_dives.hpp"
#include "survey/session/mapping_session.hpp"
#include "survey/session/other_navigation.hpp"
#include "survey/session/ping_inputs.hpp"
#include "survey/session/soundings_stage.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Folder of a survey store, deleted at the end of the replay.
class ScratchDir {
 public:
  explicit ScratchDir(fs::path dir) : dir_(std::move(dir)) { fs::remove_all(dir_); }
  ~ScratchDir() {
    std::error_code ignored;
    fs::remove_all(dir_, ignored);
  }
  ScratchDir(const ScratchDir&) = delete;
  ScratchDir& operator=(const ScratchDir&) = delete;
  const fs::path& path() const { return dir_; }

 private:
  fs::path dir_;
};

void UseTruth(const ReplayOptions& options, ProductOptions* products) {
  const fs::path file = options.truth.value_or(bench::TruthPathFor(options.inputs[0]));
  if (options.truth || fs::exists(file)) products->truth = ReadTruth(file);
}

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double PeakRssMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// Time and memory used from here on. Peak memory is that of the whole process.
class Stopwatch {
 public:
  RunFigures Read(double survey_s) const {
    RunFigures run;
    run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    run.cpu_s = CpuSeconds() - cpu_start_s_;
    run.peak_rss_mb = PeakRssMb();
    run.realtime_factor = survey_s / run.wall_s;
    return run;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_start_s_ = CpuSeconds();
};

// Code of the vertical system in which the map's elevations count; 0: not known.
int VerticalEpsg(const MapperConfig& config) {
  constexpr int kInstantaneousWaterLevelHeight = 5829;
  if (config.vertical_datum_epsg != 0) return static_cast<int>(config.vertical_datum_epsg);
  const bool from_water_line = config.water_level_file.empty() && !config.vertical.by_heights;
  return from_water_line ? kInstantaneousWaterLevelHeight : 0;
}

// A wrong reference system ends the command before the mapping.
void ExpectReferenceSystem(const std::string& crs, const Datum& datum, int vertical_epsg) {
  if (vertical_epsg != 0 && !IsHeightSystem(vertical_epsg))
    throw ConfigError("mapper.yaml: vertical_datum: " + std::to_string(vertical_epsg) +
                      ", expected the EPSG code of a vertical system of heights (positive up), "
                      "such as 5714");
  if (crs.empty()) return;
  try {
    MapProjection(datum, Eigen::Vector2d::Zero(), crs, vertical_epsg);
  } catch (const std::exception& e) {
    throw UsageError(std::string("replay: --crs: ") + e.what());
  }
}

// Duration of all dives together [s].
double DurationSeconds(const Survey& survey) {
  double duration_s = 0.0;
  for (std::size_t i = 1; i < survey.track.size(); ++i)
    if (survey.track[i].chain == survey.track[i - 1].chain)
      duration_s += ToSeconds(survey.track[i].time - survey.track[i - 1].time);
  return duration_s;
}

// Makes the map from the input.
void Remake(Dive* dive,
            std::unique_ptr<RawReplay> raw,
            Outputs outputs,
            ReplayInput* replay_input) {
  const SurveyCollector& collector = *outputs.collector;
  ProductOptions* const products = outputs.products;
  SoundingLog* const soundings = products->soundings;
  MappingSession session(dive->mapper,
                         LoadOptimizerConfig(dive->config.optimizer.string()),
                         outputs.collector,
                         replay_input->stopped,
                         outputs.on_event);
  Mapper& mapper = session.mapper().mapper();
  const bool exported = products->sounding_format.has_value();
  PingInputs inputs(dive->input.names, exported, dive->mapper.sonar_time_offset_s);
  std::optional<SoundingsStage> placed;
  if (soundings != nullptr) {
    placed.emplace(soundings, outputs.rounds->Begin(0, dive));
    mapper.OnSoundings([&](SubmapSoundings submap) {
      std::vector<std::uint16_t> of_pings = inputs.Take(submap);
      placed->Add(std::move(submap), std::move(of_pings));
    });
  }
  mapper.OnSmoothed([&](const SmoothedPose& pose) { outputs.collector->Add(pose); });
  std::optional<OtherNavigation> other;
  if (dive->input.logs) other.emplace(dive->mapper);
  InputFaults faults;
  if (dive->input.submaps)
    FeedSubmaps(std::move(*dive->input.submaps), &session, replay_input);
  else
    faults = Feed(
        &dive->input,
        std::move(raw),
        [&](const Received& sample, std::size_t input) {
          inputs.Add(sample.sample, input);
          if (other) other->Add(sample);
          session.Add(sample);
        },
        replay_input);
  session.Finish();
  if (placed) placed->Finish();
  if (mapper.noise().timing.placed_by_source) outputs.rounds->Drop(0);
  if (mapper.has_withheld()) outputs.rounds->Withhold();
  if (replay_input->stopped() && replay_input->partial.empty()) NoteStop(100, replay_input);
  if (other) replay_input->other_tracks.push_back({0, other->source(), other->Finish()});
  if (inputs.unknown() > 0) replay_input->refused["pings_of_an_unknown_input"] += inputs.unknown();
  for (Condition& fault : session.optimizer_faults()) faults.conditions.push_back(std::move(fault));
  for (const auto& [reason, count] : session.refused()) replay_input->refused[reason] += count;
  products->dives = {ReportOf(session.mapper(), faults)};
  products->mapper_counters = products->dives.front().counters;
  SayHowMapped(dive->input, session.mapper().mapper(), "", replay_input);
  TakeNoise(mapper, dive->mapper, products);
  replay_input->spans = inputs.spans();
  const bool track_alone = dive->input.logs && !inputs.HasPings() && collector.states() > 0;
  if (track_alone) return;
  ExpectSubmaps(collector,
                dive->input.survey_files != nullptr,
                session.mapper().Statement(faults.conditions),
                *replay_input);
  WarnOfDepths(session.mapper().mapper(), "", replay_input);
}

// What one run over the inputs fills.
struct MapRun {
  // base: products of any run. of_pings: soundings are placed here.
  MapRun(const fs::path& out, ProductOptions base, bool of_pings, ReplayInput input)
      : collector(out), products(std::move(base)), replay_input(std::move(input)) {
    if (of_pings) products.soundings = &soundings.emplace(out / ".soundings");
  }
  MapRun(const MapRun&) = delete;
  MapRun& operator=(const MapRun&) = delete;

  SurveyCollector collector;
  MapRecorder recorder;
  std::optional<SoundingLog> soundings;
  ProductOptions products;
  ReplayInput replay_input;
};

// What all runs share.
struct DivesOfRun {
  std::vector<Dive>* dives;
  SkippedDives* unread;
  CalibrationRounds* rounds;
};

// Maps the inputs, or takes the recorded results.
void MapInputs(const ReplayOptions& options,
               const fs::path& out,
               const DivesOfRun& of,
               MapRun* run) {
  const auto& [dives, unread, rounds] = of;
  Dive& first = dives->front();
  std::unique_ptr<RawReplay> raw = options.from_raw ? OpenRaw(options, first.input, out) : nullptr;
  if (options.as_recorded) {
    FeedResults(*first.input.logs, &run->collector, &run->replay_input);
    run->products.noise_not_estimated = "this replay uses the recorded results";
    for (const std::string& name : first.input.names)
      run->replay_input.spans.push_back({name, {}, {}});
    return;
  }
  const ScratchDir store(out / ".store");
  first.mapper.map_dir = store.path();
  const Outputs outputs{&run->collector,
                        &run->products,
                        [&](const MapperEvent& event) {
                          run->recorder.Add(event);
                          if (options.on_event) options.on_event(event);
                        },
                        rounds};
  if (dives->size() > 1 || first.input.map)
    return RemakeTogether(dives, store.path(), outputs, unread, &run->replay_input);
  Remake(&first, std::move(raw), outputs, &run->replay_input);
}

// Compares the map's track with that of the other navigation.
void CompareTracks(const Survey& survey,
                   const std::vector<OtherTrack>& others,
                   std::vector<DiveReport>* reports) {
  for (const OtherTrack& other : others) {
    std::vector<TrackState> own;
    std::copy_if(
        survey.track.begin(), survey.track.end(), std::back_inserter(own), [&](const auto& state) {
          return state.chain == other.chain;
        });
    (*reports)[static_cast<std::size_t>(other.chain)].other_navigation =
        CompareNavigations(own, other.states, other.source);
  }
}

}  // namespace

ProductSummary RunReplay(const ReplayOptions& options) {
  const Stopwatch stopwatch;
  ExpectInputs(options);
  const std::vector<DiveInput> dive_inputs =
      DivesAmong(options.inputs, options.from_raw, options.one_dive);
  ExpectDives(dive_inputs, options);
  const bool several = dive_inputs.size() > 1;
  SkippedDives unread(several);
  std::vector<Dive> opened;
  for (const DiveInput& dive : dive_inputs) {
    if (several && !dive.note.empty() && !options.quiet)
      std::fprintf(stderr,
                   "%s: %s of %s\n",
                   dive.name.c_str(),
                   NumberOfFiles(dive.files.size()).c_str(),
                   dive.note.c_str());
    unread.Try(dive.name, [&] { opened.push_back({dive.name, Open(dive, options), {}, {}}); });
  }
  ExpectOneSurvey(opened);
  if (options.datum) ExpectNear(*options.datum, opened);
  ShareGrid(opened);
  OutputFolder out(options.out);
  std::optional<Interruption> interruption;
  if (options.interruptible) interruption.emplace([&out] { out.Discard(); });

  std::vector<Dive> dives;
  for (Dive& dive : opened) {
    const fs::path of_dive = several ? out.path() / "config" / dive.name : out.path();
    if (unread.Try(dive.name, [&] { Prepare(options, of_dive, &dive); }))
      dives.push_back(std::move(dive));
  }
  if (dives.empty()) unread.ThrowFirst();
  for (const Dive& dive : dives)
    if (!options.quiet)
      std::fprintf(stderr,
                   "%sconfiguration: %s\n",
                   several ? (dive.name + ": ").c_str() : "",
                   dive.config.statement.c_str());
  Dive& first = dives[0];
  const VehicleGeometry& vehicle = first.mapper.vehicle;
  const Datum datum = options.datum.value_or(DatumOf(vehicle));
  if (several || options.datum) UseDatum(datum, &dives);

  ProductOptions products;
  products.title = options.inputs[0].filename().string();
  products.configuration = first.config.statement;
  products.configuration_crc = CrcOfConfiguration(dives);
  for (const Dive& dive : dives) products.vehicles.push_back(dive.mapper.vehicle);
  if (!options.quiet) {
    products.progress = [](const std::string& step) { std::fprintf(stderr, "%s\n", step.c_str()); };
  }
  if (first.input.submaps) {
    products.axes = first.input.submaps->z_up ? MapAxes::kEastNorthUp : MapAxes::kNorthEastDown;
  } else {
    products.datum = datum;
    products.crs = options.crs;
    products.depth_bias_m = first.mapper.navigation.depth_bias_m.sigma;
    products.vertical_epsg = VerticalEpsg(first.mapper);
    ExpectReferenceSystem(options.crs, datum, products.vertical_epsg);
    UseTruth(options, &products);
  }
  products.cell_m = options.cell_m;
  products.sounding_format = options.soundings;
  const bool of_pings = !options.as_recorded && !first.input.submaps &&
                        std::none_of(dives.begin(), dives.end(), [](const Dive& dive) {
                          return dive.input.map.has_value();
                        });

  const auto stopped = [&] { return interruption && interruption->requested(); };
  CalibrationRounds rounds(out.path(),
                           !options.no_calibration && !options.on_event,
                           of_pings);  // a finished map cannot be read twice
  std::set<std::string> said;
  std::unique_ptr<MapRun> run;
  Survey survey;
  for (;;) {
    run.reset();  // removes its files
    run = std::make_unique<MapRun>(
        out.path(), products, of_pings, ReplayInput{options.quiet, stopped});
    run->replay_input.said = std::exchange(said, {});
    MapInputs(options, out.path(), {&dives, &unread, &rounds}, run.get());
    survey = run->collector.Finish();
    if (!rounds.EndRun(survey, stopped())) break;
    said = run->replay_input.said;
    fs::remove_all(out.path() / product_files::kSubmapFolder);
    if (!options.quiet) CalibrationRounds::SayThatItMapsAgain();
  }
  ReturnFreedMemory();
  rounds.Warn(survey, &run->replay_input);
  ReplayInput& replay_input = run->replay_input;
  products = run->products;
  rounds.Report(&products.dives);
  products.refused = replay_input.refused;
  products.partial = replay_input.partial;
  products.warnings = replay_input.warnings;
  products.unread = unread.dives();
  CompareTracks(survey, replay_input.other_tracks, &products.dives);
  survey.inputs = replay_input.spans;
  products.run_figures = [&] { return stopwatch.Read(DurationSeconds(survey)); };
  const bool track_alone = survey.submaps.empty() && !options.as_recorded && first.input.logs;
  ProductSummary summary = track_alone ? WriteTrackProducts(survey, products, out.path())
                                       : WriteProducts(survey, products, out.path());
  summary.warnings = replay_input.warnings.size();
  if (!survey.submaps.empty() && !options.as_recorded)
    WriteFinishedMap(
        out.path(), run->recorder, survey, products, summary.outcome, first.configuration);
  run.reset();
  interruption.reset();  // publishing is not interrupted
  out.Publish();
  return summary;
}

void PrintReplayConfig(const ReplayOptions& options) {
  MapperConfig config;
  if (!options.mapper_config.empty()) config = LoadMapperConfig(options.mapper_config.string());
  std::fputs(PrintConfig(config).c_str(), stdout);
}

}  // namespace seastitch
