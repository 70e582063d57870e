// seastitch-kill: a simulated survey live at speed 1 through the six processes of a vehicle, each
// killed with -9 at moments drawn from a seed and started again 2 s later, as systemd does. Ends
// with 1 where a restart lost what it must keep, or a process was not back at work in time.

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/live.hpp"
#include "bench/log.hpp"
#include "bench/random.hpp"
#include "bench/survey_config.hpp"
#include "bench/truth.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/health.hpp"
#include "logger/logger_config.hpp"
#include "survey/replay/replay.hpp"
#include "tests/kill/recorded_kills.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"
#include "tools/live/child_process.hpp"
#include "tools/live/live_system.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// RestartSec of the units.
constexpr double kRestartS = 2.0;
// No kill sooner after the survey's begin, later before its end, nor after another of the same
// process.
constexpr double kFirstS = 10.0;
constexpr double kLastS = 15.0;
constexpr double kApartS = 15.0;

struct Options {
  std::uint64_t seed = 1;
  int kills = 5;
  double within_s = 10.0;
  fs::path survey;
  fs::path out = "kill";
};

struct Planned {
  double at_s = 0.0;  // of the survey
  std::string process;
};

// When kills are drawn, in seconds of the survey.
struct Span {
  double begin_s = 0.0;
  double end_s = 0.0;
};

// The sonar pings between dive and ascent only: at the surface its driver has no output to come
// back with.
Span SpanOf(const std::string& process, double survey_s, const bench::PlanParams& plan) {
  const double without_input_s = process == "mbes-driver" ? plan.DiveS() : 0.0;
  return {without_input_s + kFirstS, survey_s - without_input_s - kLastS};
}

// options.kills moments for each process, in order of time.
std::vector<Planned> Plan(const Options& options,
                          const std::vector<std::string>& processes,
                          double survey_s,
                          const bench::PlanParams& path) {
  std::vector<Planned> plan;
  for (const std::string& process : processes) {
    const Span span = SpanOf(process, survey_s, path);
    const double free_s = span.end_s - span.begin_s - kApartS * (options.kills - 1);
    if (free_s <= 0.0) throw std::runtime_error("the survey is too short for so many kills");
    bench::Random random(options.seed, process);
    std::vector<double> moments;
    for (int i = 0; i < options.kills; ++i) moments.push_back(random.Uniform() * free_s);
    std::sort(moments.begin(), moments.end());
    for (int i = 0; i < options.kills; ++i)
      plan.push_back({span.begin_s + moments[static_cast<std::size_t>(i)] + kApartS * i, process});
  }
  std::sort(
      plan.begin(), plan.end(), [](const Planned& a, const Planned& b) { return a.at_s < b.at_s; });
  return plan;
}

std::string UtcNow() {
  const std::time_t now = std::time(nullptr);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  return text;
}

// A second logger on the same bus, which nobody kills.
class Witness {
 public:
  Witness(const fs::path& out, const LiveSystem& live) : dives_(fs::absolute(out / "witness")) {
    LoggerConfig config = LoadLoggerConfig((live.config_dir() / "logger.yaml").string());
    config.dive.dives_dir = dives_;
    const fs::path file = live.config_dir() / "witness.yaml";
    std::ofstream(file) << PrintConfig(config);
    process_.emplace("logger",
                     std::vector<std::string>{(BinDir() / "seastitch-logger").string(),
                                              "--config",
                                              file.string(),
                                              "--lcm-url",
                                              live.targets().lcm_url},
                     out / "log" / "witness.txt");
  }
  void Stop() {
    if (process_->Stop(std::chrono::seconds(60)) != 0)
      throw std::runtime_error("the witness did not stop in order");
  }
  fs::path dive() const { return NewestDive(dives_).value(); }

 private:
  fs::path dives_;
  std::optional<ChildProcess> process_;
};

// Kills and restarts by the plan until the survey is sent.
std::vector<Kill> KillBy(const std::vector<Planned>& plan,
                         const std::atomic<bool>& sent,
                         LiveSystem* live) {
  const Clock::time_point start = Clock::now();
  const auto now_s = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  std::vector<Kill> kills;
  std::multimap<double, std::size_t> to_start;  // by time, of kills
  for (std::size_t next = 0; !sent || !to_start.empty(); usleep(5'000)) {
    live->Poll();
    for (; next < plan.size() && plan[next].at_s <= now_s(); ++next) {
      live->Kill(plan[next].process);
      to_start.emplace(now_s() + kRestartS, kills.size());
      kills.push_back({plan[next].process, FromUtime(NowUtime()), {}, {}});
      std::fprintf(stderr, "%7.1f s  kill -9 %s\n", now_s(), plan[next].process.c_str());
    }
    while (!to_start.empty() && to_start.begin()->first <= now_s()) {
      Kill& kill = kills[to_start.begin()->second];
      to_start.erase(to_start.begin());
      kill.restarted = FromUtime(NowUtime());
      live->Start(kill.process);
    }
  }
  return kills;
}

ProductSummary Map(const fs::path& input,
                   const fs::path& truth,
                   const fs::path& config_dir,
                   const fs::path& out,
                   bool as_recorded) {
  ReplayOptions options;
  options.inputs = {input};
  options.truth = truth;
  options.mapper_config = config_dir / "mapper.yaml";
  options.optimizer_config = config_dir / "optimizer.yaml";
  options.as_recorded = as_recorded;
  options.out = out;
  options.quiet = true;
  return RunReplay(options);
}

// Gives how many were not back in time.
int PrintKills(const std::vector<Kill>& kills, double within_s) {
  int late = 0;
  std::printf("\n  %-12s back at work after, s\n", "killed");
  std::map<std::string, std::string> rows;
  for (const Kill& kill : kills) {
    const double back_s = kill.back ? ToSeconds(*kill.back - kill.at) : HUGE_VAL;
    char text[40];
    std::snprintf(text, sizeof text, " %6.2f", back_s);
    rows[kill.process] += text;
    late += back_s > within_s ? 1 : 0;
  }
  for (const auto& [process, row] : rows) std::printf("  %-12s%s\n", process.c_str(), row.c_str());
  return late;
}

void PrintMap(const char* what, const ProductSummary& map) {
  std::printf("  %-34s %8.3f %8.3f %9zu %9llu %10llu\n",
              what,
              map.truth ? map.truth->before_aligned.position_rms_m : HUGE_VAL,
              map.truth ? map.truth->after_aligned.position_rms_m : HUGE_VAL,
              map.submaps,
              static_cast<unsigned long long>(map.loops_accepted),
              static_cast<unsigned long long>(map.soundings_used));
}

int KillAndCompare(const Options& options) {
  if (fs::exists(options.out) && !fs::is_empty(options.out) && !fs::exists(options.out / "witness"))
    throw std::runtime_error(options.out.string() + " holds something else");
  fs::remove_all(options.out);
  fs::create_directories(options.out);
  const bench::SurveyConfig survey = bench::LoadSurvey(options.survey.string());
  LiveSystem live(options.out, survey);
  Witness witness(options.out, live);
  live.WaitUntilUp();

  BenchOptions bench_options;
  bench_options.survey = options.survey;
  bench_options.config_dir = live.config_dir();
  bench_options.epoch = UtcNow();
  bench::SurveySimulator simulator = MakeSimulator(bench_options);
  const std::vector<Planned> plan =
      Plan(options, live.names(), ToSeconds(simulator.total()), survey.plan);
  std::atomic<bool> sent = false;
  bench::LiveResult result;
  std::thread sender([&] {
    result = bench::SendLive(&simulator, live.targets(), 1.0, {}, {0.0, true});
    sent = true;
  });
  std::vector<Kill> kills;
  try {
    kills = KillBy(plan, sent, &live);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-kill: %s\n", e.what());
    std::_Exit(EXIT_FAILURE);
  }
  sender.join();
  live.Stop();
  witness.Stop();

  // The same survey as if nothing had been killed.
  const fs::path whole = options.out / "whole.lcmlog";
  const fs::path cut = options.out / "cut.lcmlog";
  bench_options.log = whole;
  if (RunBench(bench_options) != EXIT_SUCCESS) return EXIT_FAILURE;
  const RecordedKills recorded(kills, witness.dive() / "log", live.dive());
  recorded.Cut(whole, cut);
  const auto map = [&](const fs::path& input, const char* name, bool as_recorded) {
    return Map(
        input, bench::TruthPathFor(whole), live.config_dir(), options.out / name, as_recorded);
  };
  const ProductSummary lived = map(witness.dive(), "live", true);
  const ProductSummary reference = map(cut, "reference", false);
  const ProductSummary uncut = map(whole, "whole", false);
  const ProductSummary logged = map(live.dive(), "logged", false);

  std::printf("\nseed %llu, %s: %d kills a process, the machine at most %.2f s behind\n",
              static_cast<unsigned long long>(options.seed),
              options.survey.filename().c_str(),
              options.kills,
              result.max_lag_s);
  const int late = PrintKills(recorded.kills(), options.within_s);
  std::printf("\n  %-34s %17s\n", "", "shape error, m");
  std::printf(
      "  %-34s %8s %8s %9s %9s %10s\n", "", "before", "after", "submaps", "closures", "soundings");
  PrintMap("live, with the kills", lived);
  PrintMap("replay without what they cost", reference);
  PrintMap("replay of the killed logger's dive", logged);
  PrintMap("replay of all", uncut);
  if (lived.truth && reference.truth)
    std::printf(
        "  shape live over that of the replay: %.2f (goal: 1.2 in the mean of the seeds)\n",
        lived.truth->after_aligned.position_rms_m / reference.truth->after_aligned.position_rms_m);
  if (late > 0) std::printf("  %d not back at work within %.0f s\n", late, options.within_s);
  const std::vector<std::string> losses = recorded.Losses();
  for (const std::string& loss : losses) std::printf("  LOST: %s\n", loss.c_str());
  if (losses.empty())
    std::printf("  every one of %zu closed submaps is in the one graph\n", recorded.submaps());
  return late > 0 || !losses.empty() ? EXIT_FAILURE : EXIT_SUCCESS;
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  spdlog::set_level(spdlog::level::warn);
  seastitch::Options options;
  options.survey = seastitch::ConfigDir() / "bench" / "demo.yaml";
  CLI::App app("A live survey whose processes are killed with -9");
  app.add_option("seed", options.seed, "of the moments")->capture_default_str();
  app.add_option("--survey", options.survey, "survey description")->capture_default_str();
  app.add_option("--kills", options.kills, "of each process")->capture_default_str();
  app.add_option("--within", options.within_s, "seconds after which a process is back at work")
      ->capture_default_str();
  app.add_option("--out", options.out, "folder, emptied before")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return seastitch::KillAndCompare(options);
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-kill: %s\n", e.what());
  return EXIT_FAILURE;
}
