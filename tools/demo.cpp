#include "tools/demo.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "bench/live.hpp"
#include "bench/simulator.hpp"
#include "bench/survey_config.hpp"
#include "bench/truth.hpp"
#include "common/storage/submap_file.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "survey/progress.hpp"
#include "survey/replay/replay.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"
#include "tools/live/live_system.hpp"
#include "tools/live/run_comparison.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Beside the results: what processes reported as lost or late.
constexpr char kLostFile[] = "lost.txt";

void PrintRow(const char* what,
              const char* unit,
              double live_before,
              double live_after,
              double replay_before,
              double replay_after) {
  std::printf("  %-22s %8.3f %8.3f   %8.3f %8.3f  %s\n",
              what,
              live_before,
              live_after,
              replay_before,
              replay_after,
              unit);
}

void PrintTable(const ProductSummary& live, const ProductSummary& replay) {
  std::printf("\n  %-22s %-17s   %-17s\n", "", "live", "replayed");
  std::printf("  %-22s %8s %8s   %8s %8s\n", "", "as nav.", "map", "as nav.", "map");
  PrintRow("swath mismatch RMS",
           "m",
           live.before.surface.rms_m,
           live.after().surface.rms_m,
           replay.before.surface.rms_m,
           replay.after().surface.rms_m);
  if (live.truth && replay.truth) {
    const TruthComparison& a = *live.truth;
    const TruthComparison& b = *replay.truth;
    PrintRow("position error RMS",
             "m",
             a.before.position_rms_m,
             a.after.position_rms_m,
             b.before.position_rms_m,
             b.after.position_rms_m);
    PrintRow("position error max",
             "m",
             a.before.position_max_m,
             a.after.position_max_m,
             b.before.position_max_m,
             b.after.position_max_m);
    PrintRow("shape of the track RMS",
             "m",
             a.before_aligned.position_rms_m,
             a.after_aligned.position_rms_m,
             b.before_aligned.position_rms_m,
             b.after_aligned.position_rms_m);
    PrintRow("yaw error RMS",
             "deg",
             a.before.yaw_rms_deg,
             a.after.yaw_rms_deg,
             b.before.yaw_rms_deg,
             b.after.yaw_rms_deg);
  }
  if (live.published && replay.published) {
    const TruthComparison& a = *live.published;
    const TruthComparison& b = *replay.published;
    std::printf("  as published live: NAV, NAV_CORRECTED\n");
    PrintRow("position error RMS",
             "m",
             a.before.position_rms_m,
             a.after.position_rms_m,
             b.before.position_rms_m,
             b.after.position_rms_m);
    PrintRow("shape of the track RMS",
             "m",
             a.before_aligned.position_rms_m,
             a.after_aligned.position_rms_m,
             b.before_aligned.position_rms_m,
             b.after_aligned.position_rms_m);
  }
  std::printf("  %-22s %17zu   %17zu\n", "submaps", live.submaps, replay.submaps);
  std::printf("  %-22s %8llu of %5llu   %8llu of %5llu\n",
              "loop closures",
              static_cast<unsigned long long>(live.loops_accepted),
              static_cast<unsigned long long>(live.loops_accepted + live.loops_rejected),
              static_cast<unsigned long long>(replay.loops_accepted),
              static_cast<unsigned long long>(replay.loops_accepted + replay.loops_rejected));
  std::printf("  %-22s %17llu   %17llu\n\n",
              "soundings used",
              static_cast<unsigned long long>(live.soundings_used),
              static_cast<unsigned long long>(replay.soundings_used));
}

ProductSummary Replay(const fs::path& dive,
                      const fs::path& truth,
                      const fs::path& config_dir,
                      const fs::path& out,
                      bool as_recorded,
                      std::function<void(const MapperEvent&)> on_event = {}) {
  ReplayOptions options;
  options.on_event = std::move(on_event);
  options.inputs = {dive};
  options.truth = truth;
  options.mapper_config = config_dir / "mapper.yaml";
  options.optimizer_config = config_dir / "optimizer.yaml";
  options.as_recorded = as_recorded;
  options.out = out;
  return RunReplay(options);
}

// Folder of the submaps that the live mapper stored; its map is the only one of the dive.
fs::path StoredSubmaps(const fs::path& dive) {
  for (const auto& entry : fs::directory_iterator(dive / "map"))
    if (entry.is_directory()) return entry.path();
  throw std::runtime_error((dive / "map").string() + ": no submap");
}

// Writes each submap that closes as SurveyStore does.
std::function<void(const MapperEvent&)> StoreIn(const fs::path& folder) {
  fs::create_directories(folder);
  return [folder](const MapperEvent& event) {
    const auto* const submap = std::get_if<std::shared_ptr<const Submap>>(&event);
    if (submap == nullptr || (*submap)->cloud.empty()) return;
    WriteSubmapPcd(
        folder / SubmapFileName((*submap)->id), (*submap)->cloud, (*submap)->T_map_submap);
  };
}

}  // namespace

int RunDemo(const DemoOptions& options) {
  const fs::path mark = options.out / ".seastitch-demo";
  if (fs::exists(options.out) && !fs::is_empty(options.out) && !fs::exists(mark)) {
    throw std::runtime_error("demo: " + options.out.string() +
                             " holds something else; choose another folder with --out");
  }
  for (const char* old : {"config",
                          "log",
                          "run",
                          "dives",
                          "live",
                          "replay",
                          "closed",
                          "survey.truth.csv",
                          kLostFile}) {
    fs::remove_all(options.out / old);
  }
  fs::create_directories(options.out);
  std::ofstream(mark) << "made by seastitch demo; it empties this folder when it runs again\n";

  LiveSystem live(options.out, bench::LoadSurvey(options.survey.string()));
  BenchOptions bench_options;
  bench_options.survey = options.survey;
  bench_options.terrain = options.terrain;
  bench_options.config_dir = live.config_dir();
  bench::SurveySimulator simulator = MakeSimulator(bench_options);
  const fs::path truth = options.out / "survey.truth.csv";
  bench::WriteTruth(simulator, truth);

  std::fprintf(stderr, "starting logger, drivers, mapper and optimizer\n");
  live.WaitUntilUp();
  std::fprintf(stderr,
               "to watch it: %s, or %s status --lcm-url '%s'\n",
               live.page().c_str(),
               (BinDir() / "seastitch").c_str(),
               live.targets().lcm_url.c_str());
  ProgressLine progress("surveying", 1000, false);
  const bench::LiveResult sent =
      bench::SendLive(&simulator, live.targets(), options.speed, [&](double part) {
        live.Poll();
        progress.Set(static_cast<std::uint64_t>(1000.0 * part));
        return true;
      });
  progress.Finish();
  if (sent.max_lag_s > 1.0) {
    std::fprintf(
        stderr, "this machine fell %.1f s behind at speed %.0f\n", sent.max_lag_s, options.speed);
  }
  live.Poll();
  const std::string faults = live.Faults();
  std::fprintf(stderr, "stopping the processes\n");
  live.Stop();

  std::fprintf(stderr, "products of the live run\n");
  const ProductSummary at_sea =
      Replay(live.dive(), truth, live.config_dir(), options.out / "live", true);
  std::fprintf(stderr, "replaying the recorded log in one process\n");
  const auto began = std::chrono::steady_clock::now();
  const ProductSummary ashore = Replay(live.dive(),
                                       truth,
                                       live.config_dir(),
                                       options.out / "replay",
                                       false,
                                       StoreIn(options.out / "closed"));

  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;

  PrintTable(at_sea, ashore);
  std::printf("  the replay took %.1f s: %.2f million soundings a second\n",
              took.count(),
              1e-6 * static_cast<double>(ashore.soundings_read) / took.count());
  for (const std::string& finding : ashore.noise_findings) std::printf("  %s\n", finding.c_str());
  const std::string lost = live.Lost();
  if (!lost.empty()) std::ofstream(options.out / kLostFile) << lost;
  std::printf("  live beside the replay (%s):\n%s",
              lost.empty() ? "nothing was lost on the way"
                           : ("this machine lost or delayed samples: " + std::string(kLostFile) +
                              " lists them")
                                 .c_str(),
              Text(CompareRuns({options.out / "live", StoredSubmaps(live.dive())},
                               {options.out / "replay", options.out / "closed"}),
                   "live",
                   "replay")
                  .c_str());
  fs::remove_all(options.out / "closed");
  std::printf("  faults at the end of the survey:%s\n", faults.empty() ? " none" : faults.c_str());
  std::printf("  map and report: %s\n", (options.out / "replay" / "report.html").c_str());
  return EXIT_SUCCESS;
}

}  // namespace seastitch
