#include "tools/replay.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "bench/truth.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/vehicle_config.hpp"
#include "common/runtime/worker.hpp"
#include "common/storage/event_log.hpp"
#include "mapper/mapper_node.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"
#include "products/survey_collector.hpp"
#include "tools/message_types.hpp"
#include "tools/progress.hpp"
#include "tools/recorded_dive.hpp"
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

// A survey store that lives as long as the replay.
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

// Mapper and optimizer on a bus of their own, one message after the other.
class Pipeline {
 public:
  Pipeline(const ReplayOptions& options, const MapperConfig& mapper, Bus* bus)
      : bus_(bus),
        mapper_(mapper, bus, &worker_),
        optimizer_(LoadOptimizerConfig(options.optimizer_config.string()), bus, &worker_) {
    bus_->HandleAll();
  }

  MapperNode& mapper() { return mapper_; }
  // Until every message is answered and no pair is left to be looked at again.
  void Settle() {
    bus_->HandleAll();
    while (mapper_.LookAgain()) bus_->HandleAll();
  }
  void Finish() {
    mapper_.Finish();
    Settle();
  }
  // What the mapper says of itself, with every counter that is not zero.
  std::string Statement() {
    const health_t health = mapper_.health().Snapshot(0, 1.0);
    std::string statement = health.text;
    for (const counter_t& counter : health.counters) {
      if (counter.value != 0)
        statement += ", " + counter.name + " " + std::to_string(counter.value);
    }
    return statement;
  }

 private:
  Bus* bus_;
  InlineWorker worker_;
  MapperNode mapper_;
  OptimizerNode optimizer_;
};

bool IsOfRole(const LogEvent& event, ChannelRole role) {
  const Channel* channel = FindChannel(event.channel);
  return channel != nullptr && channel->role == role;
}

void FeedLog(const fs::path& log, ChannelRole role, MessageTypes* types, Bus* bus, bool quiet) {
  EventLogReader reader(log);
  ProgressLine progress("reading " + log.filename().string(), fs::file_size(log), quiet);
  std::int64_t of_role = 0;
  while (const std::optional<LogEvent> event = reader.Next()) {
    progress.Advance(event->data.size() + event->channel.size() + 28);
    if (!IsOfRole(*event, role)) continue;
    ++of_role;
    if (!types->Add(*event)) continue;
    bus->PublishBytes(event->channel, event->data.data(), event->data.size());
    bus->HandleAll();
  }
  progress.Finish();
  if (reader.damaged_bytes() > 0) {
    std::fprintf(stderr,
                 "%s: %lld damaged bytes were skipped\n",
                 log.c_str(),
                 static_cast<long long>(reader.damaged_bytes()));
  }
  if (of_role == 0)
    throw std::runtime_error(log.string() + ": no event on a channel that a replay reads");
}

void ExpectReadable(const MessageTypes& types) {
  if (const auto unreadable = types.UnreadableChannels(); !unreadable.empty())
    throw DataError(ToString(unreadable[0]));
}

// Before the work begins: reads on beyond the first events only where a channel has shown none that
// can be read.
void ExpectReadableStart(const std::vector<fs::path>& logs, ChannelRole role) {
  constexpr int kFirstEvents = 10'000;
  MessageTypes types;
  for (const fs::path& log : logs) {
    EventLogReader reader(log);
    for (int events = 0; events < kFirstEvents || !types.UnreadableChannels().empty(); ++events) {
      const std::optional<LogEvent> event = reader.Next();
      if (!event) break;
      if (IsOfRole(*event, role)) types.Add(*event);
    }
  }
  ExpectReadable(types);
}

// Puts the logs' events of one role on the bus. Events of another type than their channel has are
// skipped and named.
void FeedLogs(const std::vector<fs::path>& logs, ChannelRole role, Bus* bus, bool quiet) {
  ExpectReadableStart(logs, role);
  MessageTypes types;
  for (const fs::path& log : logs) FeedLog(log, role, &types, bus, quiet);
  ExpectReadable(types);
  for (const auto& [channel, events] : types.Foreign())
    std::fprintf(stderr,
                 "%lld events on %s have another type and were skipped\n",
                 static_cast<long long>(events),
                 channel.c_str());
}

// Survey files as what drivers would have published of them.
void FeedSurvey(SurveyFiles* survey, Bus* bus, bool quiet) {
  if (!quiet) std::fputs(survey->plan().Text().c_str(), stderr);
  ProgressLine progress("reading", survey->bytes(), quiet);
  while (survey->PublishNext(bus)) {
    bus->HandleAll();
    progress.Set(survey->bytes_read());
  }
  progress.Finish();
  for (const auto& [name, value] : survey->counters())
    if (value != 0 && !quiet)
      std::fprintf(stderr, "%s: %lld\n", name.c_str(), static_cast<long long>(value));
  if (const auto outcome = survey->Outcome()) throw DataError(*outcome);
}

// The files, where all inputs are survey files; nothing: none is.
std::unique_ptr<SurveyFiles> OpenSurvey(const ReplayOptions& options) {
  const auto& inputs = options.inputs;
  const auto files = std::count_if(inputs.begin(), inputs.end(), SurveyFiles::IsSurveyFile);
  if (files == 0) return nullptr;
  if (static_cast<std::size_t>(files) < inputs.size())
    throw std::runtime_error("replay: survey files and LCM logs are not mapped together");
  if (options.as_recorded) throw std::runtime_error("replay: --as-recorded needs a log");
  auto survey = std::make_unique<SurveyFiles>(inputs);
  if (const auto problem = survey->Problem()) throw DataError(*problem);
  return survey;
}

void FeedSubmaps(SubmapDirectory directory, Pipeline* pipeline, bool quiet) {
  ProgressLine progress("registering submaps", directory.submaps.size(), quiet);
  for (Submap& submap : directory.submaps) {
    pipeline->mapper().AddSubmap(std::move(submap));
    pipeline->Settle();
    progress.Advance(1);
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

// What the run costs from here on. Peak memory is that of the whole process.
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

double DurationSeconds(const Survey& survey) {
  return survey.track.empty() ? 0.0
                              : ToSeconds(survey.track.back().time - survey.track.front().time);
}

// Products never go where an input lies.
void ExpectApart(const std::vector<fs::path>& inputs, const fs::path& out) {
  const fs::path target = fs::weakly_canonical(out);
  for (const fs::path& input : inputs) {
    const fs::path source = fs::weakly_canonical(input);
    const fs::path folder = fs::is_directory(input) ? source : source.parent_path();
    const auto [unlike, rest] =
        std::mismatch(folder.begin(), folder.end(), target.begin(), target.end());
    const bool inside = fs::is_directory(input) && unlike == folder.end();
    const bool input_inside =
        fs::exists(target / "submaps") && fs::equivalent(folder, target / "submaps");
    if (inside || input_inside)
      throw UsageError("--out " + out.string() + ": the input " + input.string() +
                       " lies there; choose another folder");
  }
}

// The files that the replay is done with: what was given, else what was recorded, which is left in
// OUT/config, else the shipped ones.
void ChooseConfig(ReplayOptions* options, bool from_logs) {
  std::map<std::string, std::string> recorded;
  if (from_logs && options->mapper_config.empty()) recorded = RecordedConfig(options->inputs);
  if (recorded.contains("mapper.yaml") && recorded.contains("vehicle.yaml")) {
    const fs::path folder = options->out / "config";
    fs::create_directories(folder);
    for (const char* name : {"mapper.yaml", "vehicle.yaml", "optimizer.yaml"})
      if (recorded.contains(name)) std::ofstream(folder / name) << recorded[name];
    options->mapper_config = folder / "mapper.yaml";
    if (options->optimizer_config.empty() && recorded.contains("optimizer.yaml"))
      options->optimizer_config = folder / "optimizer.yaml";
    if (!options->quiet) std::fprintf(stderr, "configuration: as recorded\n");
  }
  if (options->optimizer_config.empty()) {
    const fs::path beside = options->mapper_config.parent_path() / "optimizer.yaml";
    const bool there = !options->mapper_config.empty() && fs::exists(beside);
    options->optimizer_config = there ? beside : options->default_config_dir / "optimizer.yaml";
  }
  if (!options->mapper_config.empty()) return;
  options->mapper_config = options->default_config_dir / "mapper.yaml";
  if (!options->quiet && from_logs)
    std::fprintf(stderr,
                 "no configuration was recorded: using %s (--config names another)\n",
                 options->mapper_config.c_str());
}

}  // namespace

ProductSummary RunReplay(const ReplayOptions& given) {
  ReplayOptions options = given;
  const Stopwatch stopwatch;
  if (options.inputs.empty()) throw std::runtime_error("replay: no input");
  for (const fs::path& input : options.inputs) {
    if (!fs::exists(input))
      throw std::runtime_error(input.string() + ": no such file or directory");
  }
  ExpectApart(options.inputs, options.out);
  const std::string title = options.inputs[0].filename().string();
  if (IsDive(options.inputs[0])) {
    if (options.inputs.size() > 1) throw std::runtime_error("replay: one dive at a time");
    options.inputs = LogsOfDive(options.inputs[0]);
  }
  const bool from_directory = fs::is_directory(options.inputs[0]);
  if (from_directory && options.inputs.size() > 1) {
    throw std::runtime_error("replay: one directory of submaps at a time");
  }
  if (from_directory && options.as_recorded) {
    throw std::runtime_error("replay: --as-recorded needs a log");
  }

  const std::unique_ptr<SurveyFiles> survey_files = from_directory ? nullptr : OpenSurvey(options);
  const bool from_logs = !from_directory && !survey_files;
  if (from_logs) options.inputs = InOrderOfRecording(std::move(options.inputs));
  ChooseConfig(&options, from_logs);
  MapperConfig mapper_config = LoadMapperConfig(options.mapper_config.string());
  if (survey_files) UseSurvey(survey_files->plan(), &mapper_config);
  if (from_directory) mapper_config.mounting = {};  // frames stand anywhere on whatever vehicle

  ProductOptions products;
  products.title = title;
  if (!options.quiet) {
    products.progress = [](const std::string& step) { std::fprintf(stderr, "%s\n", step.c_str()); };
  }

  Bus bus("memq://");
  SurveyCollector collector(options.out);
  CollectorNode collector_node(&bus, &collector);
  if (options.listen) options.listen(&bus);
  if (options.as_recorded) {
    FeedLogs(options.inputs, ChannelRole::kResult, &bus, options.quiet);
  } else {
    const ScratchDir store(options.out / ".store");
    mapper_config.map_dir = store.path();
    Pipeline pipeline(options, mapper_config, &bus);
    if (from_directory) {
      SubmapDirectory directory = ReadSubmapDirectory(options.inputs[0], options.drift);
      products.axes = directory.z_up ? MapAxes::kEastNorthUp : MapAxes::kNorthEastDown;
      FeedSubmaps(std::move(directory), &pipeline, options.quiet);
    } else if (survey_files) {
      FeedSurvey(survey_files.get(), &bus, options.quiet);
    } else {
      FeedLogs(options.inputs, ChannelRole::kSensor, &bus, options.quiet);
    }
    pipeline.Finish();
    if (collector.submaps() == 0 && survey_files)
      throw DataError(options.inputs[0].string() + ": no submap: " + pipeline.Statement());
    if (collector.submaps() == 0) throw std::runtime_error("no submap: " + pipeline.Statement());
  }
  if (!from_directory) {
    const VehicleGeometry& vehicle = mapper_config.vehicle;
    products.datum =
        Datum{Rad2Deg(vehicle.datum_latitude_rad), Rad2Deg(vehicle.datum_longitude_rad)};
    UseTruth(options, &products);
  }

  const Survey survey = collector.Finish();
  products.run_figures = [&] { return stopwatch.Read(DurationSeconds(survey)); };
  return WriteProducts(survey, products, options.out);
}

void PrintReplayConfig(const ReplayOptions& options) {
  MapperConfig config;
  if (!options.mapper_config.empty()) config = LoadMapperConfig(options.mapper_config.string());
  std::fputs(PrintConfig(config).c_str(), stdout);
}

}  // namespace seastitch
