#include "tools/replay.hpp"

#include <sys/resource.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "bench/truth.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/conditions.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/vehicle_config.hpp"
#include "common/runtime/worker.hpp"
#include "common/storage/event_log.hpp"
#include "mapper/mapper_node.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"
#include "products/survey_collector.hpp"
#include "tools/dive_front.hpp"
#include "tools/dive_inputs.hpp"
#include "tools/interruption.hpp"
#include "tools/maker_soundings.hpp"
#include "tools/merged_logs.hpp"
#include "tools/message_types.hpp"
#include "tools/other_navigation.hpp"
#include "tools/output_folder.hpp"
#include "tools/ping_inputs.hpp"
#include "tools/ping_losses.hpp"
#include "tools/progress.hpp"
#include "tools/recorded_dive.hpp"
#include "tools/replay_config.hpp"
#include "tools/survey_config.hpp"
#include "tools/survey_files.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Hands what mapper and optimizer publish to the collector.
class CollectorNode {
 public:
  CollectorNode(Bus* bus, SurveyCollector* collector) : collector_(collector) {
    bus->Subscribe<nav_t>(channels::kNav, 0, [this](const nav_t& msg) {
      if (const auto state = FromLcm(msg)) collector_->Add(*state);
    });
    bus->Subscribe<nav_corrected_t>(channels::kNavCorrected, 0, [this](const nav_corrected_t& msg) {
      if (const auto corrected = FromLcm(msg)) collector_->Add(*corrected);
    });
    bus->Subscribe<submap_t>(channels::kSubmap, 0, [this](const submap_t& msg) {
      if (const auto submap = submaps_.Add(msg)) collector_->Add(*submap);
    });
    bus->Subscribe<submap_points_t>(channels::kSubmapPoints, 0, [this](const submap_points_t& msg) {
      if (const auto submap = submaps_.Add(msg)) collector_->Add(*submap);
    });
    bus->Subscribe<graph_update_t>(channels::kGraphUpdate, 0, [this](const graph_update_t& msg) {
      if (const auto update = FromLcm(msg)) collector_->Add(*update);
    });
    bus->Subscribe<pose_graph_t>(channels::kPoseGraph, 0, [this](const pose_graph_t& msg) {
      if (const auto graph = graphs_.Add(msg)) collector_->Add(*graph);
    });
  }

 private:
  SurveyCollector* collector_;
  SubmapAssembler submaps_;
  PoseGraphAssembler graphs_;
};

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

// Counters that are not zero.
std::map<std::string, std::int64_t> CountersOf(MapperNode* mapper) {
  std::map<std::string, std::int64_t> counters;
  for (const counter_t& counter : mapper->health().Snapshot(0, 1.0).counters)
    if (counter.value != 0) counters[counter.name] = counter.value;
  return counters;
}

// Sentences of the faults that are present. A dive of several has no optimizer of its own.
std::vector<std::string> ConditionsOf(MapperNode* mapper) {
  std::vector<std::string> sentences;
  for (const condition_t& condition : mapper->health().Snapshot(0, 1.0).conditions)
    if (condition.name != conditions::kNoOptimizer.name) sentences.push_back(condition.sentence);
  return sentences;
}

DiveReport ReportOf(MapperNode* mapper) {
  return {CountersOf(mapper),
          ConditionsOf(mapper),
          mapper->mapper().noise().timing,
          mapper->mapper().stamp_offsets(),
          std::nullopt};
}

// Mapper and optimizer on a private bus; messages are handled one after the other.
class Pipeline {
 public:
  Pipeline(const ReplayConfig& config,
           const MapperConfig& mapper,
           Bus* bus,
           std::function<bool()> stopped)
      : bus_(bus),
        stopped_(std::move(stopped)),
        mapper_(mapper, bus, &worker_),
        optimizer_(LoadOptimizerConfig(config.optimizer.string()), bus, &worker_) {
    bus_->HandleAll();
  }

  MapperNode& mapper() { return mapper_; }
  // Handles messages until all are answered and no pair is left for a retry.
  void Settle() {
    bus_->HandleAll();
    while (!stopped_() && mapper_.LookAgain()) bus_->HandleAll();
  }
  void Finish() {
    mapper_.Finish();
    Settle();
  }
  // The mapper's HEALTH sentence and all counters that are not zero.
  std::string Statement() {
    std::string statement = mapper_.health().text();
    for (const auto& [name, value] : CountersOf(&mapper_))
      statement += ", " + name + " " + std::to_string(value);
    return statement;
  }

 private:
  Bus* bus_;
  std::function<bool()> stopped_;
  InlineWorker worker_;
  MapperNode mapper_;
  OptimizerNode optimizer_;
};

bool IsOfRole(const LogEvent& event, ChannelRole role) {
  const Channel* channel = FindChannel(event.channel);
  return channel != nullptr && channel->role == role;
}

// Track of a navigation that the map does not use.
struct OtherTrack {
  std::int32_t chain;
  std::string source;
  std::vector<TrackState> states;
};

// Input of a replay, and counts of what is not used.
struct Feeding {
  Bus* bus;
  PingInputs* inputs;
  bool quiet;
  std::function<bool()> stopped;                  // asked before every event or record
  std::map<std::string, std::int64_t> refused{};  // by reason
  std::string partial{};                          // sentence about where it was stopped
  std::vector<OtherTrack> other_tracks{};         // one of each dive with a log
};

void NoteStop(int percent, Feeding* feeding) {
  feeding->partial =
      "Partial: the replay was interrupted after " + std::to_string(percent) + " % of the input.";
}

// Publishes the logs' events of one role. Events of another type than that of their channel are
// skipped and counted by reason.
void FeedLogs(const RecordedLogs& recorded,
              ChannelRole role,
              RawReplay* raw,  // null: raw bytes are not decoded
              Feeding* feeding) {
  MergedLogs logs(recorded, feeding->quiet);
  MessageTypes types;
  bool any = false;
  while (!feeding->stopped()) {
    const std::optional<LogEvent> event = logs.Next();
    if (!event) break;
    const bool is_raw = raw != nullptr && IsOfRole(*event, ChannelRole::kRaw);
    // HEALTH gives the mapper the time that passes while sensors are silent.
    const bool is_health = role == ChannelRole::kSensor && event->channel == channels::kHealth;
    if (!is_raw && !is_health && !IsOfRole(*event, role)) continue;
    any = any || !is_health;
    if ((raw != nullptr && raw->MakesAnew(event->channel)) || !types.Add(*event)) continue;
    feeding->inputs->Reading(logs.log());
    if (is_raw)
      raw->Add(*event);
    else
      feeding->bus->PublishBytes(event->channel, event->data.data(), event->data.size());
    feeding->bus->HandleAll();
  }
  if (raw != nullptr) {
    raw->Finish();
    feeding->bus->HandleAll();
  }
  if (feeding->stopped()) NoteStop(logs.percent_read(), feeding);
  if (!any)
    throw std::runtime_error(recorded.recorders[0][0].string() +
                             ": no event on a channel that a replay reads");
  feeding->refused = logs.refused();
  if (raw != nullptr) feeding->refused.merge(raw->counters());
  for (const auto& [channel, events] : types.Foreign())
    feeding->refused["of_another_type_" + channel] = events;
  for (const auto& [reason, count] : feeding->refused)
    std::fprintf(stderr, "skipped: %s %lld\n", reason.c_str(), static_cast<long long>(count));
}

// Publishes survey files as messages, as drivers would have.
void FeedSurvey(SurveyFiles* survey, Feeding* feeding) {
  const SurveyPlan& plan = survey->plan();
  std::fputs((feeding->quiet ? plan.warning : plan.Text()).c_str(), stderr);
  ProgressLine progress("reading", survey->bytes(), feeding->quiet);
  while (!feeding->stopped() && survey->PublishNext(feeding->bus)) {
    feeding->inputs->Reading(survey->file());
    feeding->bus->HandleAll();
    progress.Set(survey->bytes_read());
  }
  if (feeding->stopped()) {
    NoteStop(static_cast<int>(100 * survey->bytes_read() / survey->bytes()), feeding);
    return;
  }
  progress.Finish();
  for (const auto& [name, value] : survey->counters())
    if (value != 0) feeding->refused[name] = value;
  for (const auto& [name, value] : feeding->refused)
    if (!feeding->quiet)
      std::fprintf(stderr, "%s: %lld\n", name.c_str(), static_cast<long long>(value));
  if (const auto outcome = survey->Outcome()) throw DataError(*outcome);
}

void PrintPingLosses(const SurveyFiles& survey, const Counters& mapper, bool quiet) {
  const PingLosses losses(survey.counters()["survey_pings"], mapper);
  if (!quiet || losses.is_warning) std::fputs(losses.text.c_str(), stderr);
}

// The survey files if all inputs are survey files; nothing if none is.
std::unique_ptr<SurveyFiles> OpenSurvey(const std::vector<fs::path>& inputs,
                                        const ReplayOptions& options) {
  const auto files = std::count_if(inputs.begin(), inputs.end(), SurveyFiles::IsSurveyFile);
  if (files == 0) return nullptr;
  if (static_cast<std::size_t>(files) < inputs.size())
    throw UsageError("replay: survey files and LCM logs in one folder are not one dive");
  if (options.as_recorded) throw UsageError("replay: --as-recorded needs a log");
  SurveyPlan plan = PlanSurvey(inputs, !options.mapper_config.empty());
  if (const auto problem = plan.Problem()) throw DataError(*problem);
  return std::make_unique<SurveyFiles>(std::move(plan));
}

void FeedSubmaps(SubmapDirectory directory, Pipeline* pipeline, Feeding* feeding) {
  ProgressLine progress("registering submaps", directory.submaps.size(), feeding->quiet);
  std::size_t done = 0;
  for (Submap& submap : directory.submaps) {
    if (feeding->stopped())
      return NoteStop(static_cast<int>(100 * done / directory.submaps.size()), feeding);
    pipeline->mapper().AddSubmap(std::move(submap));
    pipeline->Settle();
    progress.Advance(1);
    ++done;
  }
  progress.Finish();
}

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

// Duration of all dives together [s].
double DurationSeconds(const Survey& survey) {
  double duration_s = 0.0;
  for (std::size_t i = 1; i < survey.track.size(); ++i)
    if (survey.track[i].chain == survey.track[i - 1].chain)
      duration_s += ToSeconds(survey.track[i].time - survey.track[i - 1].time);
  return duration_s;
}

// Refuses an output folder that contains an input, or that would replace one.
void ExpectApart(const std::vector<fs::path>& inputs, const fs::path& out) {
  const fs::path target = fs::weakly_canonical(out);
  for (const fs::path& input : inputs) {
    const fs::path source = fs::weakly_canonical(input);
    const fs::path folder = fs::is_directory(input) ? source : source.parent_path();
    const auto [unlike, rest] =
        std::mismatch(folder.begin(), folder.end(), target.begin(), target.end());
    const bool inside = fs::is_directory(input) && unlike == folder.end();
    const bool is_replaced = std::any_of(
        OutputFolder::kFolders.begin(), OutputFolder::kFolders.end(), [&](const char* name) {
          return fs::exists(target / name) && fs::equivalent(folder, target / name);
        });
    if (inside || is_replaced)
      throw UsageError("--out " + out.string() + ": the input " + input.string() +
                       " lies there; choose another folder");
  }
}

// Loads the mapper's configuration. An error in a recorded one of another version is reported as
// such.
MapperConfig LoadChosen(const ReplayConfig& chosen, bool recorded) {
  try {
    return LoadMapperConfig(chosen.mapper.string());
  } catch (const ConfigError& e) {
    if (!recorded) throw;
    throw ConfigError(std::string(e.what()) +
                      ": the recorded configuration is not for this version, --config names "
                      "another");
  }
}

void ExpectInputs(const ReplayOptions& options) {
  if (options.inputs.empty()) throw UsageError("replay: no input");
  for (const fs::path& input : options.inputs)
    if (!fs::exists(input))
      throw std::runtime_error(input.string() + ": no such file or directory");
  if (options.as_recorded && options.from_raw)
    throw UsageError("replay: either --as-recorded or --from-raw");
  if (options.datum) {
    ProductOptions with_datum;
    with_datum.datum = options.datum;
    if (const std::string wrong = with_datum.Validate(); !wrong.empty())
      throw UsageError("--datum: " + wrong);
  }
  std::vector<fs::path> read = options.inputs;
  for (const fs::path& file :
       {options.mapper_config, options.optimizer_config, options.water_level})
    if (!file.empty()) read.push_back(file);
  if (options.truth) read.push_back(*options.truth);
  ExpectApart(read, options.out);
}

void ExpectDives(const std::vector<DiveInput>& dives, const ReplayOptions& options) {
  const bool submaps = std::any_of(dives.begin(), dives.end(), [](const DiveInput& dive) {
    return dive.files.empty() && HoldsSubmaps(dive.folder);
  });
  if (submaps && dives.size() > 1)
    throw UsageError("replay: a directory of submaps is mapped by itself");
  if (options.from_raw && dives.size() > 1) throw UsageError("replay: --from-raw takes one dive");
  if (options.as_recorded && (submaps || dives.size() > 1))
    throw UsageError("replay: --as-recorded needs the logs of one dive");
  if (options.soundings && (options.as_recorded || submaps))
    throw UsageError("replay: --soundings needs pings to be placed: no submaps, no --as-recorded");
}

// Exactly one of the first three is set.
struct Input {
  std::optional<RecordedLogs> logs;
  std::unique_ptr<SurveyFiles> survey_files;
  std::optional<SubmapDirectory> submaps;
  std::vector<std::string> names;  // names of the files
};

// Error of a folder without an input: names what is in it.
std::runtime_error NothingIn(const fs::path& folder) {
  constexpr std::size_t kMostNames = 5;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  std::string found = names.empty() ? "it is empty" : "it holds";
  for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i)
    found += (i == 0 ? " " : ", ") + names[i];
  if (names.size() > kMostNames)
    found += " and " + std::to_string(names.size() - kMostNames) + " more";
  return std::runtime_error(folder.string() +
                            ": no logs, no survey files and no submaps (.pcd, .pdc): " + found);
}

Input Open(const DiveInput& dive, const ReplayOptions& options) {
  Input input;
  if (!dive.problem.empty()) throw std::runtime_error(dive.problem);
  if (dive.files.empty()) {
    if (!HoldsSubmaps(dive.folder)) throw NothingIn(dive.folder);
    input.submaps = ReadSubmapDirectory(dive.folder, options.drift);
  } else if ((input.survey_files = OpenSurvey(dive.files, options))) {
    for (const fs::path& file : dive.files) input.names.push_back(file.filename().string());
  } else {
    const ChannelRole role = options.as_recorded ? ChannelRole::kResult : ChannelRole::kSensor;
    input.logs = LookThrough(dive.files, options.quiet);
    if (!options.from_raw) ExpectReadable(input.logs->types, role);
    for (const auto& recorder : input.logs->recorders)
      for (const fs::path& log : recorder) input.names.push_back(log.filename().string());
  }
  return input;
}

std::unique_ptr<RawReplay> OpenRaw(const Input& input,
                                   const GivenConfig& given,
                                   const fs::path& out,
                                   Bus* bus) {
  if (!input.logs) throw UsageError("replay: --from-raw needs a log");
  const RawSources sources(input.logs->senders);
  if (!sources.imu && !sources.dvl && !sources.mbes && !sources.nav)
    throw DataError(input.logs->recorders[0][0].string() + ": no raw bytes (RAW_*)");
  return std::make_unique<RawReplay>(
      sources, ChooseDriverFiles(given, *input.logs, sources, out), bus);
}

GivenConfig GivenBy(const ReplayOptions& options) {
  return {
      options.mapper_config, options.optimizer_config, options.drivers, options.default_config_dir};
}

// An input and its configuration.
struct Dive {
  std::string name;
  Input input;
  ReplayConfig config;
  MapperConfig mapper;
};

void Prepare(const ReplayOptions& options, const fs::path& out, Dive* dive) {
  const GivenConfig given = GivenBy(options);
  const Input& input = dive->input;
  dive->config = input.logs ? ChooseConfig(given, *input.logs, out) : ChooseConfig(given);
  dive->mapper = LoadChosen(dive->config, options.mapper_config.empty());
  if (!options.water_level.empty()) LoadWaterLevel(options.water_level, &dive->mapper);
  const bool given_vehicle = !options.mapper_config.empty();
  if (input.survey_files) UseSurvey(input.survey_files->plan(), given_vehicle, &dive->mapper);
  if (input.submaps) dive->mapper.mounting = {};  // submaps may be of any vehicle
}

// Publishes the input's messages. raw: decodes recorded raw bytes, if these are replayed.
void Feed(Input* input, RawReplay* raw, Feeding* feeding) {
  if (input->survey_files)
    FeedSurvey(input->survey_files.get(), feeding);
  else
    FeedLogs(*input->logs, ChannelRole::kSensor, raw, feeding);
}

// The dives of a replay that were not read, or not to their end.
class Unread {
 public:
  // several: a dive that fails is left out and named, else its exception is passed on.
  explicit Unread(bool several) : several_(several) {}

  // False: it failed.
  bool Try(const std::string& dive, const std::function<void()>& step) {
    try {
      step();
      return true;
    } catch (const std::runtime_error& e) {
      if (!several_) throw;
      if (!first_) first_ = std::current_exception();
      std::fprintf(stderr, "%s: left out: %s\n", dive.c_str(), e.what());
      dives_.push_back({dive, e.what()});
      return false;
    }
  }
  [[noreturn]] void ThrowFirst() const { std::rethrow_exception(first_); }
  const std::vector<UnreadDive>& dives() const { return dives_; }

 private:
  const bool several_;
  std::exception_ptr first_;
  std::vector<UnreadDive> dives_;
};

// Takes what the mapper found about the noise.
void TakeNoise(const Mapper& mapper, const MapperConfig& config, ProductOptions* products) {
  products->noise = mapper.noise();
  if (!config.loop_closer.estimate_noise) products->noise_not_estimated = "estimate_noise is off";
}

void ExpectSubmaps(const SurveyCollector& collector,
                   bool survey_files,
                   const std::string& statement,
                   const Feeding& feeding) {
  if (collector.submaps() > 0) return;
  if (!feeding.partial.empty()) throw std::runtime_error("no submap: " + feeding.partial);
  if (survey_files) throw DataError("no submap: " + statement);
  throw std::runtime_error("no submap: " + statement);
}

// Makes the map from the input.
void Remake(Dive* dive,
            RawReplay* raw,
            const SurveyCollector& collector,
            ProductOptions* products,
            Feeding* feeding) {
  SoundingLog* const soundings = products->soundings;
  Pipeline pipeline(dive->config, dive->mapper, feeding->bus, feeding->stopped);
  std::optional<OtherNavigation> other;
  if (dive->input.logs) other.emplace(dive->mapper, feeding->bus);
  if (soundings != nullptr)
    pipeline.mapper().OnSoundings([&](const SubmapSoundings& submap) {
      soundings->Add(submap, feeding->inputs->Take(submap));
    });
  if (dive->input.submaps)
    FeedSubmaps(std::move(*dive->input.submaps), &pipeline, feeding);
  else
    Feed(&dive->input, raw, feeding);
  pipeline.Finish();
  if (feeding->stopped() && feeding->partial.empty()) NoteStop(100, feeding);
  if (other) feeding->other_tracks.push_back({0, other->source(), other->Finish()});
  products->dives = {ReportOf(&pipeline.mapper())};
  products->mapper_counters = products->dives.front().counters;
  if (const SurveyFiles* const survey = dive->input.survey_files.get())
    PrintPingLosses(*survey, products->mapper_counters, feeding->quiet);
  TakeNoise(pipeline.mapper().mapper(), dive->mapper, products);
  const bool track_alone =
      dive->input.logs && !feeding->inputs->HasPings() && collector.states() > 0;
  if (track_alone) return;
  ExpectSubmaps(collector, dive->input.survey_files != nullptr, pipeline.Statement(), *feeding);
}

// Sets one datum for all dives, and converts each dive's start position to it.
void UseDatum(const Datum& datum, std::vector<Dive>* dives) {
  const GeographicLib::LocalCartesian map(datum.latitude_deg, datum.longitude_deg, 0.0);
  for (Dive& dive : *dives) {
    VehicleGeometry& vehicle = dive.mapper.vehicle;
    const GeographicLib::LocalCartesian own(
        Rad2Deg(vehicle.datum_latitude_rad), Rad2Deg(vehicle.datum_longitude_rad), 0.0);
    NavigationParams& start = dive.mapper.navigation;
    double latitude_deg = 0.0, longitude_deg = 0.0, up_m = 0.0;
    own.Reverse(start.start_east_m, start.start_north_m, 0.0, latitude_deg, longitude_deg, up_m);
    map.Forward(latitude_deg, longitude_deg, 0.0, start.start_east_m, start.start_north_m, up_m);
    vehicle.datum_latitude_rad = Deg2Rad(datum.latitude_deg);
    vehicle.datum_longitude_rad = Deg2Rad(datum.longitude_deg);
  }
}

// Places the dives that have positions of a grid in that of the first one.
void ShareGrid(const std::vector<Dive>& dives) {
  std::optional<Eigen::Vector2d> origin_m;
  for (const Dive& dive : dives) {
    SurveyFiles* const survey = dive.input.survey_files.get();
    if (survey == nullptr || !survey->plan().grid_origin_m) continue;
    if (!origin_m) origin_m = survey->plan().grid_origin_m;
    survey->UseGridOrigin(*origin_m);
  }
}

// Publishes one of several dives.
void FeedOneOfSeveral(Dive* dive, Unread* unread, Feeding* feeding) {
  const std::map<std::string, std::int64_t> refused_before = std::exchange(feeding->refused, {});
  unread->Try(dive->name, [&] { Feed(&dive->input, nullptr, feeding); });
  for (const auto& [reason, count] : refused_before) feeding->refused[reason] += count;
}

// Maps several dives together. A front end per dive makes its submaps; one back end makes one graph
// of all. Files of the inputs are numbered consecutively. Returns the time spans of the inputs.
std::vector<SurveyInput> RemakeTogether(std::vector<Dive>* dives,
                                        const fs::path& store,
                                        SurveyCollector* collector,
                                        ProductOptions* products,
                                        Unread* unread,
                                        Feeding* feeding) {
  Bus* const bus = feeding->bus;
  SoundingLog* const soundings = products->soundings;
  MapperConfig all = dives->front().mapper;
  all.map_dir = store / "all";
  Pipeline pipeline(dives->front().config, all, bus, feeding->stopped);
  std::vector<SurveyInput> spans;
  std::int32_t next_id = 0;
  std::string statements;
  for (std::size_t k = 0; k < dives->size() && !feeding->stopped(); ++k) {
    Dive& dive = (*dives)[k];
    collector->BeginDive(dive.name);
    dive.mapper.map_dir = store / std::to_string(k);
    DiveFront front(
        dive.mapper,
        static_cast<std::int32_t>(k),
        next_id,
        [&](Submap submap, Mapper::OfDive of_dive) {
          pipeline.mapper().AddSubmap(std::move(submap), std::move(of_dive));
          pipeline.Settle();
        },
        [&](const NavState& nav) { collector->Add(nav); });
    PingInputs inputs(
        dive.input.names, soundings != nullptr, dive.mapper.sonar_time_offset_s, front.bus());
    const auto first_input = static_cast<std::uint16_t>(spans.size());
    if (soundings != nullptr)
      front.mapper().OnSoundings([&](SubmapSoundings submap) {
        std::vector<std::uint16_t> of_pings = inputs.Take(submap);
        for (std::uint16_t& input : of_pings)
          input = static_cast<std::uint16_t>(input + first_input);
        submap.id.value += next_id;
        soundings->Add(submap, of_pings);
      });
    std::optional<OtherNavigation> other;
    if (dive.input.logs) other.emplace(dive.mapper, front.bus());
    feeding->bus = front.bus();
    feeding->inputs = &inputs;
    if (!feeding->quiet) std::fprintf(stderr, "dive %s\n", dive.name.c_str());
    FeedOneOfSeveral(&dive, unread, feeding);
    front.Finish();
    if (other)
      feeding->other_tracks.push_back(
          {static_cast<std::int32_t>(k), other->source(), other->Finish()});
    products->dives.push_back(ReportOf(&front.mapper()));
    if (const SurveyFiles* const survey = dive.input.survey_files.get())
      PrintPingLosses(*survey, products->dives.back().counters, feeding->quiet);
    next_id = front.next_id();
    statements += dive.name + ": " + front.mapper().health().text() + "; ";
    spans.insert(spans.end(), inputs.spans().begin(), inputs.spans().end());
  }
  pipeline.Finish();
  feeding->bus = bus;
  products->mapper_counters = CountersOf(&pipeline.mapper());
  products->conditions = ConditionsOf(&pipeline.mapper());
  TakeNoise(pipeline.mapper().mapper(), dives->front().mapper, products);
  ExpectSubmaps(*collector, dives->front().input.survey_files != nullptr, statements, *feeding);
  return spans;
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
  const std::vector<DiveInput> dive_inputs = DivesAmong(options.inputs, options.from_raw);
  ExpectDives(dive_inputs, options);
  const bool several = dive_inputs.size() > 1;
  Unread unread(several);
  std::vector<Dive> opened;
  for (const DiveInput& dive : dive_inputs)
    unread.Try(dive.name, [&] { opened.push_back({dive.name, Open(dive, options), {}, {}}); });
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
  const Datum datum = options.datum.value_or(
      Datum{Rad2Deg(vehicle.datum_latitude_rad), Rad2Deg(vehicle.datum_longitude_rad)});
  if (several || options.datum) UseDatum(datum, &dives);

  ProductOptions products;
  products.title = options.inputs[0].filename().string();
  products.configuration = first.config.statement;
  if (!options.quiet) {
    products.progress = [](const std::string& step) { std::fprintf(stderr, "%s\n", step.c_str()); };
  }
  if (first.input.submaps) {
    products.axes = first.input.submaps->z_up ? MapAxes::kEastNorthUp : MapAxes::kNorthEastDown;
  } else {
    products.datum = datum;
    UseTruth(options, &products);
  }

  Bus bus("memq://");
  const std::unique_ptr<RawReplay> raw =
      options.from_raw ? OpenRaw(first.input, GivenBy(options), out.path(), &bus) : nullptr;
  SurveyCollector collector(out.path());
  CollectorNode collector_node(&bus, &collector);
  PingInputs inputs(
      first.input.names, options.soundings.has_value(), first.mapper.sonar_time_offset_s, &bus);
  std::optional<SoundingLog> soundings;
  if (options.soundings) {
    products.soundings = &soundings.emplace(out.path() / ".soundings");
    products.sounding_format = *options.soundings;
  }
  if (options.listen) options.listen(&bus);
  Feeding feeding{
      &bus, &inputs, options.quiet, [&] { return interruption && interruption->requested(); }};
  std::optional<std::vector<SurveyInput>> spans;
  if (options.as_recorded) {
    FeedLogs(*first.input.logs, ChannelRole::kResult, nullptr, &feeding);
    products.noise_not_estimated = "this replay uses the recorded results";
  } else {
    const ScratchDir store(out.path() / ".store");
    first.mapper.map_dir = store.path();
    if (several)
      spans = RemakeTogether(&dives, store.path(), &collector, &products, &unread, &feeding);
    else
      Remake(&first, raw.get(), collector, &products, &feeding);
  }
  if (inputs.unknown() > 0) feeding.refused["pings_of_an_unknown_input"] = inputs.unknown();
  products.refused = feeding.refused;
  products.partial = feeding.partial;
  products.unread = unread.dives();
  Survey survey = collector.Finish();
  CompareTracks(survey, feeding.other_tracks, &products.dives);
  survey.inputs = spans.value_or(inputs.spans());
  products.run_figures = [&] { return stopwatch.Read(DurationSeconds(survey)); };
  const bool track_alone = survey.submaps.empty() && !options.as_recorded && first.input.logs;
  ProductSummary summary = track_alone ? WriteTrackProducts(survey, products, out.path())
                                       : WriteProducts(survey, products, out.path());
  soundings.reset();
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
