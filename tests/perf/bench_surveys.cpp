// seastitch-bench-surveys: whole simulated surveys, from the devices' bytes to the delivered map,
// against the truth; then the same graphs with wrong loop closures among the right ones. Every line
// follows from the seeds that it prints.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bench/log.hpp"
#include "bench/random.hpp"
#include "bench/survey_config.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "survey/replay/replay.hpp"
#include "tests/perf/graph_file.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> rasters;
  std::string survey;  // what all surveys have in common
  std::string graphs;  // folder to save every graph in; empty: none
  std::string errors;
  std::vector<std::string> seabeds;  // empty: all but the survey's own
  std::vector<int> crosslines{0, 2};
  int lines = 8;
  int runs = 1;
  int injections = 10;  // of wrong closures, a graph and share
  std::uint64_t first_seed = 1;
};

// ---- surveys

struct Seabed {
  std::string name;
  bench::ProceduralParams terrain;
  std::string raster;
};

const char* const kOwnSeabed = "own";  // that of the survey's file

std::vector<Seabed> Seabeds(const Options& options) {
  bench::ProceduralParams flat;
  flat.relief.rms_m = 0.01;
  bench::ProceduralParams gentle;
  gentle.relief = {0.3, 120.0, 1.0, 0.9};
  bench::ProceduralParams waves;
  waves.relief = {0.1, 120.0, 1.0, 0.9};
  waves.sand_waves = {0.5, 14.0, 35.0};
  bench::ProceduralParams rough;
  rough.relief = {1.0, 120.0, 1.0, 0.8};
  std::vector<Seabed> seabeds{
      {"flat", flat, {}}, {"gentle", gentle, {}}, {"sand waves", waves, {}}, {"rough", rough, {}}};
  for (const std::string& file : options.rasters)
    seabeds.push_back({fs::path(file).stem().string(), {}, file});
  const bench::SurveyConfig survey = bench::LoadSurvey(options.survey);
  if (!options.seabeds.empty()) seabeds.push_back({kOwnSeabed, survey.terrain, survey.raster.file});
  std::erase_if(seabeds, [&](const Seabed& seabed) {
    const std::vector<std::string>& wanted = options.seabeds;
    return !wanted.empty() && std::find(wanted.begin(), wanted.end(), seabed.name) == wanted.end();
  });
  return seabeds;
}

struct Plan {
  const Seabed* seabed;
  int crosslines;
  std::uint64_t seed;
};

bench::SurveyConfig ConfigFor(const Plan& plan, const Options& options) {
  bench::SurveyConfig config = bench::LoadSurvey(options.survey);
  config.seed = plan.seed;
  config.terrain = plan.seabed->terrain;
  config.raster.file = plan.seabed->raster;
  if (!options.errors.empty()) {
    config.error_class = options.errors;
    config.errors = bench::SensorErrors::OfClass(options.errors);
  }
  config.plan.lines = options.lines;
  config.plan.crosslines = plan.crosslines;
  return config;
}

// One survey, simulated and replayed, and what is needed to judge other solutions of its graph.
struct Run {
  ProductSummary summary;
  std::vector<GraphUpdate> updates;
  std::vector<TruthState> truth;  // at the submap frames
  double cpu_s = 0.0;
};

Run RunSurvey(const Plan& plan, const Options& options) {
  const TemporaryDir scratch;
  const fs::path log = scratch.path() / "survey.lcmlog";
  const bench::DriverConfigs drivers = bench::LoadDriverConfigs(ConfigDir());
  const bench::SurveyConfig config = ConfigFor(plan, options);
  bench::SurveySimulator simulator(
      config, LoadVehicle((ConfigDir() / "vehicle.yaml").string()), drivers.signals());
  bench::WriteLog(&simulator, drivers, {}, log, [](double) { return true; });

  Run run;
  ReplayOptions replay;
  replay.inputs = {log};
  replay.mapper_config = WriteMapperConfigFor(config, ConfigDir(), scratch.path());
  replay.optimizer_config = ConfigDir() / "optimizer.yaml";
  replay.out = scratch.path() / "out";
  replay.quiet = true;
  replay.on_event = [&](const MapperEvent& event) {
    if (const auto* step = std::get_if<GraphStep>(&event)) run.updates.push_back(step->update);
  };
  const std::clock_t start = std::clock();
  run.summary = RunReplay(replay);
  run.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  for (const GraphUpdate& update : run.updates) {
    for (const GraphVertex& v : update.vertices)
      run.truth.push_back({v.time, LevelPose(simulator.TruthAt(v.time).T_map_vehicle)});
  }
  return run;
}

void SaveGraphOf(const Plan& plan, const Run& run, const Options& options) {
  if (options.graphs.empty()) return;
  std::string name = plan.seabed->name;
  std::replace(name.begin(), name.end(), ' ', '_');
  RecordedGraph graph{run.updates, {}};
  for (const TruthState& state : run.truth) graph.truth.push_back(state.T_map_level);
  SaveGraph(graph,
            fs::path(options.graphs) / (name + "_" + std::to_string(plan.crosslines) + "_" +
                                        std::to_string(plan.seed) + ".graph"));
}

// ---- what a solution is worth

std::vector<CorrectedState> Frames(const Run& run, const PoseGraph& solution) {
  std::vector<CorrectedState> frames;
  for (const GraphUpdate& update : run.updates) {
    for (const GraphVertex& v : update.vertices) {
      const Pose2& d = v.dead_reckoned;
      const Pose2 solved = VehiclePose(solution.vertices.at(frames.size()).T_map_level,
                                       solution.MountingOf(v.chain));
      frames.push_back({v.time, {d.x, d.y, 0.0}, {0.0, 0.0, d.yaw}, solved, {}});
    }
  }
  return frames;
}

// Every two submaps that were tried as a loop closure and do not follow each other, once.
std::set<std::pair<SubmapId, SubmapId>> PairsOfLines(const Run& run) {
  std::set<std::pair<SubmapId, SubmapId>> pairs;
  for (const GraphUpdate& update : run.updates) {
    for (const GraphEdge& e : update.edges)
      if (e.kind == EdgeKind::kLoopClosure && e.to.value - e.from.value >= 2)
        pairs.insert({e.from, e.to});
  }
  return pairs;
}

// By how much two passes put the same piece of seabed, half-way between their frames, at different
// places: RMS over the pairs of lines, before and after.
struct LineOffset {
  double before_m = 0.0;
  double after_m = 0.0;
};

LineOffset LineToLine(const Run& run, const std::vector<CorrectedState>& frames) {
  const auto dead_reckoned = [&](std::size_t i) {
    const CorrectedState& s = frames[i];
    return Pose2{s.p_dead_reckoned.x(), s.p_dead_reckoned.y(), s.rpy_dead_reckoned_rad.z()};
  };
  LineOffset squares;
  const std::set<std::pair<SubmapId, SubmapId>> pairs = PairsOfLines(run);
  for (const auto& [from_id, to_id] : pairs) {
    const auto from = static_cast<std::size_t>(from_id.value);
    const auto to = static_cast<std::size_t>(to_id.value);
    const Pose2& true_from = run.truth.at(from).T_map_level;
    const Pose2& true_to = run.truth.at(to).T_map_level;
    const Eigen::Vector2d p = 0.5 * (true_from.Translation() + true_to.Translation());
    const Eigen::Vector2d p_from = Inverse(true_from) * p;
    const Eigen::Vector2d p_to = Inverse(true_to) * p;
    squares.before_m += (dead_reckoned(from) * p_from - dead_reckoned(to) * p_to).squaredNorm();
    squares.after_m +=
        (frames[from].corrected * p_from - frames[to].corrected * p_to).squaredNorm();
  }
  const double n = std::max<double>(1.0, static_cast<double>(pairs.size()));
  return {std::sqrt(squares.before_m / n), std::sqrt(squares.after_m / n)};
}

PoseGraph Solve(const std::vector<GraphUpdate>& updates) {
  PoseGraphOptimizer optimizer{LoadOptimizerConfig((ConfigDir() / "optimizer.yaml").string())};
  for (const GraphUpdate& update : updates) optimizer.Add(update);
  return optimizer.Solve().value();
}

// ---- wrong loop closures

// Each pair once: as it was registered last.
std::vector<GraphEdge*> AcceptedClosures(std::vector<GraphUpdate>* updates) {
  std::map<std::pair<SubmapId, SubmapId>, GraphEdge*> last;
  for (GraphUpdate& update : *updates) {
    for (GraphEdge& e : update.edges)
      if (e.kind == EdgeKind::kLoopClosure) last[{e.to, e.from}] = &e;
  }
  std::vector<GraphEdge*> closures;
  for (const auto& [pair, edge] : last)
    if (edge->verdict == LoopVerdict::kAccepted) closures.push_back(edge);
  return closures;
}

// What no registration can be better than: every accepted closure says the truth.
std::vector<GraphUpdate> WithExactClosures(const Run& run) {
  std::vector<GraphUpdate> updates = run.updates;
  for (GraphUpdate& update : updates) update.mounting = {};  // exact closures are not sheared
  for (GraphEdge* e : AcceptedClosures(&updates)) {
    const auto true_pose = [&](SubmapId id) {
      return run.truth.at(static_cast<std::size_t>(id.value)).T_map_level;
    };
    e->T_from_to = Inverse(true_pose(e->from)) * true_pose(e->to);
  }
  return updates;
}

// What becomes of some of the accepted closures.
enum class Fate {
  kWrong,  // 2 to 16 m off
  kGone,   // refused: what is lost without them, whoever refuses them
};

// That share of the accepted closures, drawn by the seed. `alike` of them in a row are wrong by the
// same vector of the map, as where the seabed repeats itself, and so agree.
std::vector<GraphUpdate> WithFate(Fate fate,
                                  std::vector<GraphUpdate> updates,
                                  double share,
                                  std::size_t alike,
                                  std::uint64_t seed) {
  bench::Random random(seed, "wrong closures");
  const std::vector<GraphEdge*> closures = AcceptedClosures(&updates);
  std::vector<std::size_t> groups((closures.size() + alike - 1) / alike);
  for (std::size_t i = 0; i < groups.size(); ++i) groups[i] = i;
  for (std::size_t i = groups.size(); i > 1; --i)
    std::swap(groups[i - 1], groups[random.Bits() % i]);
  groups.resize(static_cast<std::size_t>(std::lround(share * static_cast<double>(groups.size()))));
  std::map<SubmapId, Pose2> dead_reckoned;
  for (const GraphUpdate& update : updates)
    for (const GraphVertex& v : update.vertices) dead_reckoned[v.id] = v.dead_reckoned;
  for (const std::size_t group : groups) {
    const double direction = 2.0 * kPi * random.Uniform();
    const double length_m = 2.0 + 14.0 * random.Uniform();
    const Eigen::Vector2d offset =
        length_m * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    for (std::size_t i = group * alike; i < std::min(closures.size(), (group + 1) * alike); ++i) {
      GraphEdge& e = *closures[i];
      if (fate == Fate::kGone) {
        e.verdict = LoopVerdict::kAmbiguous;
        continue;
      }
      const Eigen::Vector2d in_from = dead_reckoned.at(e.from).Rotation().transpose() * offset;
      e.T_from_to.x += in_from.x();
      e.T_from_to.y += in_from.y();
    }
  }
  return updates;
}

// ---- tables

struct Judged {
  Plan plan;
  Run run;
};

void PrintSurvey(const Judged& judged) {
  const std::vector<CorrectedState> frames = Frames(judged.run, Solve(judged.run.updates));
  const LineOffset offset = LineToLine(judged.run, frames);
  const std::vector<CorrectedState> exact =
      Frames(judged.run, Solve(WithExactClosures(judged.run)));
  const TruthComparison at_frames = *CompareWithTruth(frames, judged.run.truth);
  const TruthComparison bound = *CompareWithTruth(exact, judged.run.truth);
  const ProductSummary& s = judged.run.summary;
  const TruthComparison& t = *s.truth;
  std::printf(
      "| %s | %d | %llu | %.1f | %zu | %llu | %.2f -> %.2f | %.1f | %.2f -> %.2f | %.1f | %.2f, "
      "%.2f | %.2f -> %.2f | %.3f -> %.3f | %s | %.0f |\n",
      judged.plan.seabed->name.c_str(),
      judged.plan.crosslines,
      static_cast<unsigned long long>(judged.plan.seed),
      s.distance_m / 1000.0,
      s.submaps,
      static_cast<unsigned long long>(s.loops_accepted),
      t.before.position_rms_m,
      t.after.position_rms_m,
      t.before.position_rms_m / t.after.position_rms_m,
      t.before_aligned.position_rms_m,
      t.after_aligned.position_rms_m,
      t.before_aligned.position_rms_m / t.after_aligned.position_rms_m,
      at_frames.after_aligned.position_rms_m,
      bound.after_aligned.position_rms_m,
      offset.before_m,
      offset.after_m,
      s.before.surface.rms_m,
      s.after().surface.rms_m,
      ToString(s.outcome),
      judged.run.cpu_s);
  std::fflush(stdout);
}

std::vector<Judged> SurveyTable(const std::vector<Seabed>& seabeds, const Options& options) {
  std::printf(
      "\n## Surveys against the truth\n\n"
      "Position: RMS along the track as delivered, and how many times less it is; shape: what is "
      "left of it after the\nrigid motion that fits best; frames: shape of the submap frames "
      "alone, "
      "and what it would be if every accepted\nclosure were exact; lines: RMS offset between two "
      "passes over the same seabed; surface: RMS of the surface error.\n\n"
      "| seabed | cross | seed | km | submaps | closures | position m | cut | shape m | cut | "
      "frames, exact m | lines m | surface m | outcome | CPU s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  std::vector<Judged> all;
  for (const Seabed& seabed : seabeds) {
    for (const int crosslines : options.crosslines) {
      for (int i = 0; i < options.runs; ++i) {
        const Plan plan{&seabed, crosslines, options.first_seed + static_cast<std::uint64_t>(i)};
        all.push_back({plan, RunSurvey(plan, options)});
        SaveGraphOf(plan, all.back().run, options);
        PrintSurvey(all.back());
      }
    }
  }
  return all;
}

struct FrameError {
  double position_m;
  double shape_m;
};

FrameError FrameErrorOf(const Run& run, const std::vector<GraphUpdate>& updates) {
  const TruthComparison t = *CompareWithTruth(Frames(run, Solve(updates)), run.truth);
  return {t.after.position_rms_m, t.after_aligned.position_rms_m};
}

void WrongClosureTable(std::vector<Judged>& surveys) {
  std::printf(
      "\n## The same graphs with wrong loop closures\n\n"
      "Share of the accepted closures replaced by others 2 to 16 m off; alone, or five in a row "
      "off by the same vector.\nRMS error of the submap frames over that of the graph as it is: "
      "position as delivered / shape; and the shape where\nthe same closures are not wrong but "
      "gone.\n\n"
      "| seabed | cross | seed | closures | as it is m | 10 %% | 30 %% | 50 %% | five alike: 10 %% "
      "| 30 %% | 50 %% |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (Judged& judged : surveys) {
    const std::size_t closures = AcceptedClosures(&judged.run.updates).size();
    if (closures < 10) continue;
    const FrameError clean = FrameErrorOf(judged.run, judged.run.updates);
    std::printf("| %s | %d | %llu | %zu | %.2f / %.2f |",
                judged.plan.seabed->name.c_str(),
                judged.plan.crosslines,
                static_cast<unsigned long long>(judged.plan.seed),
                closures,
                clean.position_m,
                clean.shape_m);
    for (const std::size_t alike : {1, 5}) {
      for (const double share : {0.1, 0.3, 0.5}) {
        const auto error = [&](Fate fate) {
          return FrameErrorOf(judged.run,
                              WithFate(fate, judged.run.updates, share, alike, judged.plan.seed));
        };
        const FrameError wrong = error(Fate::kWrong);
        std::printf(" %.2f / %.2f, %.2f |",
                    wrong.position_m / clean.position_m,
                    wrong.shape_m / clean.shape_m,
                    error(Fate::kGone).shape_m / clean.shape_m);
      }
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

// Many draws of the same, for one a graph tells little of what is rare.
void MisledTable(std::vector<Judged>& surveys, int injections) {
  constexpr double kMisled = 1.5;
  std::printf(
      "\n## The same with %d draws a graph\n\n"
      "Misled: a shape error above %.1f times that of the graph as it is and of that without the "
      "wrong closures.\n\n"
      "| wrong | share %% | graphs drawn | misled | worst | mean error, gone |\n"
      "|---|---|---|---|---|---|\n",
      injections,
      kMisled);
  for (const std::size_t alike : {1, 5}) {
    for (const double share : {0.1, 0.3, 0.5}) {
      int drawn = 0, misled = 0;
      double worst = 0.0, log_wrong = 0.0, log_gone = 0.0;
      for (Judged& judged : surveys) {
        if (AcceptedClosures(&judged.run.updates).size() < 10) continue;
        const double clean_m = FrameErrorOf(judged.run, judged.run.updates).shape_m;
        for (int seed = 1; seed <= injections; ++seed, ++drawn) {
          const auto error_m = [&](Fate fate) {
            const auto drawn_by = static_cast<std::uint64_t>(seed);
            return FrameErrorOf(judged.run,
                                WithFate(fate, judged.run.updates, share, alike, drawn_by))
                .shape_m;
          };
          const double wrong_m = error_m(Fate::kWrong);
          const double gone_m = error_m(Fate::kGone);
          const double ratio = wrong_m / std::max(gone_m, clean_m);
          misled += ratio > kMisled ? 1 : 0;
          worst = std::max(worst, ratio);
          log_wrong += std::log(wrong_m / clean_m);
          log_gone += std::log(gone_m / clean_m);
        }
      }
      if (drawn == 0) return;
      std::printf("| %s | %.0f | %d | %d | %.1f | %.2f, %.2f |\n",
                  alike == 1 ? "alone" : "five alike",
                  100.0 * share,
                  drawn,
                  misled,
                  worst,
                  std::exp(log_wrong / drawn),
                  std::exp(log_gone / drawn));
    }
  }
}

void RunAll(const Options& options) {
  const std::vector<Seabed> seabeds = Seabeds(options);
  std::printf("# Whole surveys, seeds %llu to %llu\n",
              static_cast<unsigned long long>(options.first_seed),
              static_cast<unsigned long long>(options.first_seed + options.runs - 1));
  std::vector<Judged> surveys = SurveyTable(seabeds, options);
  WrongClosureTable(surveys);
  MisledTable(surveys, options.injections);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  seastitch::Options options;
  CLI::App app(
      "Whole surveys from simulated device bytes to the delivered map, against the truth: with and "
      "without crosslines, over seabeds that are formulas and rasters that are given; then with "
      "wrong loop closures among the right ones");
  app.add_option("--raster", options.rasters, "a seabed: any raster in metres")
      ->check(CLI::ExistingFile);
  app.add_option("--seabed",
                 options.seabeds,
                 "only these, by the names in the tables; own: that of the survey's file");
  app.add_option("--crosslines", options.crosslines, "how many")->capture_default_str();
  app.add_option("--survey",
                 options.survey,
                 "plan, sensors and water (default: the shipped "
                 "ten_km.yaml); seabed, lines and seed are set here");
  app.add_option(
      "--errors", options.errors, "class of sensors in place of the survey's: mems, ins_tactical");
  app.add_option("--save-graphs",
                 options.graphs,
                 "folder for the graph of every survey, for seastitch-bench-graphs")
      ->check(CLI::ExistingDirectory);
  app.add_option("--lines", options.lines, "survey lines; 20 make 10 km")->capture_default_str();
  app.add_option("--runs", options.runs, "seeds a seabed")->capture_default_str();
  app.add_option("--injections", options.injections, "draws of wrong closures a graph and share")
      ->capture_default_str();
  app.add_option("--seed", options.first_seed, "the first of them")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::warn);
  try {
    if (options.survey.empty())
      options.survey = (seastitch::ConfigDir() / "bench" / "ten_km.yaml").string();
    seastitch::RunAll(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-surveys: %s\n", e.what());
    return 1;
  }
  return 0;
}
