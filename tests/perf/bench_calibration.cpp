// seastitch-bench-calibration: simulated surveys whose sonar has errors that nobody configured.
// What the overlaps of the survey find, and what the map is worth without and with it, against the
// same survey without errors. Every line follows from the seeds that it prints.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "bench/log.hpp"
#include "bench/random.hpp"
#include "bench/survey_config.hpp"
#include "common/core/calibration.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "survey/replay/replay.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Case {
  std::string name;
  int lines;
  int crosslines;
  bench::MbesErrors errors;
  double profile_mps;  // error of the sound-speed profile
};

constexpr char kNothing[] = "nothing";
constexpr char kRandom[] = "random";

std::vector<Case> Cases() {
  const auto with = [](double roll_deg, double steering_mps, double stamp_s) {
    bench::MbesErrors errors;
    errors.roll_deg = roll_deg;
    errors.steering_mps = steering_mps;
    errors.stamp_s = stamp_s;
    return errors;
  };
  bench::MbesErrors bias;
  bias.beam_bias_percent = 0.03;
  return {{kNothing, 5, 1, {}, 0.0},
          {"combined", 5, 1, with(0.3, 0.0, 0.02), -3.0},
          {"combined, steering", 5, 1, with(0.3, 3.0, 0.02), 0.0},
          {"profile", 5, 1, {}, -2.0},
          {"beam bias", 5, 1, bias, 0.0},
          {"two lines", 2, 0, {}, 0.0},
          {"two lines, combined", 2, 0, with(0.3, 0.0, 0.02), -3.0},
          {kRandom, 5, 1, {}, 0.0}};
}

// Errors of the case kRandom.
bench::MbesErrors Drawn(std::uint64_t seed) {
  bench::Random random(seed, "calibration");
  bench::MbesErrors errors;
  errors.roll_deg = 0.3 * random.Normal();
  errors.steering_mps = 3.0 * random.Normal();
  errors.stamp_s = 0.02 * random.Normal();
  errors.roll_percent = 2.0 * random.Normal();
  errors.heave_percent = 6.0 * random.Normal();
  return errors;
}

// Errors as the calibration should find them, in the units of the file.
std::map<std::string, double> TruthOf(const Case& of) {
  const bench::MbesErrors& e = of.errors;
  const auto name = [](CalibrationKey key) {
    return kCalibrationNames[static_cast<std::size_t>(key)].name;
  };
  return {{name(CalibrationKey::kRoll), e.roll_deg},
          {name(CalibrationKey::kSmile), e.steering_mps - of.profile_mps},
          {name(CalibrationKey::kSmileByWater), -of.profile_mps},
          {name(CalibrationKey::kAttitudeLatency), 1e3 * e.stamp_s},
          {name(CalibrationKey::kDepthLatency), 1e3 * e.stamp_s},
          {name(CalibrationKey::kRollScale), e.roll_percent},
          {name(CalibrationKey::kHeaveScale), e.heave_percent}};
}

struct Result {
  double surface_m = 0.0;
  double shape_m = 0.0;
  double chi2 = 0.0;  // of closures, per degree of freedom
  double cpu_s = 0.0;
  Json rounds;
};

Result Replayed(const fs::path& log, const ReplayOptions& base, bool calibrates) {
  ReplayOptions replay = base;
  replay.inputs = {log};
  replay.no_calibration = !calibrates;
  const std::clock_t start = std::clock();
  RunReplay(replay);
  Result result;
  result.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const Json report = Json::parse(std::ifstream(replay.out / "report.json"));
  result.surface_m = report["surface_rms_m"]["after"];
  result.shape_m = report["truth"]["aligned_position_rms_m"]["after"];
  if (report["truth"].contains("loop_closures")) {
    const Json& closures = report["truth"]["loop_closures"];
    result.chi2 = closures["chi2"].get<double>() / closures["degrees_of_freedom"].get<double>();
  }
  result.rounds = report["calibration"];
  return result;
}

struct Options {
  std::string survey;
  std::string errors = "mems";
  std::vector<std::string> cases;
  std::uint64_t first_seed = 100;
  int runs = 1;
};

// One survey: without and with calibration.
struct Compared {
  Result without;
  Result with;
};

Compared RunCase(const Case& of, std::uint64_t seed, const Options& options) {
  const TemporaryDir scratch;
  bench::SurveyConfig config = bench::LoadSurvey(options.survey);
  config.seed = seed;
  config.error_class = options.errors;
  config.errors = bench::SensorErrors::OfClass(options.errors);
  config.plan.lines = of.lines;
  config.plan.crosslines = of.crosslines;
  config.mbes.errors = of.errors;
  config.profile_speed_error_mps = of.profile_mps;
  const bench::DriverConfigs drivers = bench::LoadDriverConfigs(ConfigDir());
  bench::SurveySimulator simulator(
      config, LoadVehicle((ConfigDir() / "vehicle.yaml").string()), drivers.signals());
  const fs::path log = scratch.path() / "survey.lcmlog";
  bench::WriteLog(&simulator, drivers, {}, log, [](double) { return true; });
  ReplayOptions replay;
  replay.mapper_config = WriteMapperConfigFor(config, ConfigDir(), scratch.path());
  replay.optimizer_config = ConfigDir() / "optimizer.yaml";
  replay.quiet = true;
  replay.out = scratch.path() / "without";
  Compared compared;
  compared.without = Replayed(log, replay, false);
  replay.out = scratch.path() / "with";
  compared.with = Replayed(log, replay, true);
  return compared;
}

// Sums over the surveys of one case.
struct Tally {
  int surveys = 0, applied = 0;
  double without_surface = 0.0, with_surface = 0.0, without_shape = 0.0, with_shape = 0.0;
  double without_chi2 = 0.0, with_chi2 = 0.0, without_cpu = 0.0, with_cpu = 0.0;
  std::map<std::string, std::vector<double>> t;
  std::map<std::string, int> applied_by_key;
};

// What is applied: of the first round. What is found: what the last round used and adds.
void AddValues(const Case& of, const Json& rounds, Tally* tally) {
  const std::map<std::string, double> truth = TruthOf(of);
  for (const auto& [key, value] : rounds.back()["values"].items()) {
    const double found = rounds.back()["used"][key].get<double>() + value["add"].get<double>();
    tally->t[key].push_back((found - truth.at(key)) / value["sigma"].get<double>());
    if (rounds.front()["values"][key]["is_clear"].get<bool>()) ++tally->applied_by_key[key];
  }
}

void Add(const Case& of, const Compared& c, Tally* tally) {
  ++tally->surveys;
  tally->applied += c.with.rounds.size() > 1 ? 1 : 0;
  tally->without_surface += c.without.surface_m;
  tally->with_surface += c.with.surface_m;
  tally->without_shape += c.without.shape_m;
  tally->with_shape += c.with.shape_m;
  tally->without_chi2 += c.without.chi2;
  tally->with_chi2 += c.with.chi2;
  tally->without_cpu += c.without.cpu_s;
  tally->with_cpu += c.with.cpu_s;
  AddValues(of, c.with.rounds, tally);
}

void Print(const std::string& name, const Tally& tally) {
  const auto n = static_cast<double>(tally.surveys);
  std::printf(
      "%-20s %d of %d applied; surface %.4f -> %.4f m, shape %.3f -> %.3f m, chi2 %.2f -> %.2f, "
      "CPU "
      "%.2f -> %.2f s\n",
      name.c_str(),
      tally.applied,
      tally.surveys,
      tally.without_surface / n,
      tally.with_surface / n,
      tally.without_shape / n,
      tally.with_shape / n,
      tally.without_chi2 / n,
      tally.with_chi2 / n,
      tally.without_cpu / n,
      tally.with_cpu / n);
  for (const auto& [key, values] : tally.t) {
    double squares = 0.0;
    int within = 0;
    for (const double t : values) {
      squares += t * t;
      within += std::abs(t) < 2.0 ? 1 : 0;
    }
    const auto applied = tally.applied_by_key.find(key);
    std::printf("  %-22s applied %3d; t RMS %.2f, %.0f %% below 2\n",
                key.c_str(),
                applied == tally.applied_by_key.end() ? 0 : applied->second,
                std::sqrt(squares / static_cast<double>(values.size())),
                100.0 * within / static_cast<double>(values.size()));
  }
  std::fflush(stdout);
}

void RunAll(const Options& options) {
  for (Case of : Cases()) {
    const auto wanted = [&] {
      for (const std::string& name : options.cases)
        if (name == of.name) return true;
      return options.cases.empty();
    };
    if (!wanted()) continue;
    Tally tally;
    for (int i = 0; i < options.runs; ++i) {
      const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
      if (of.name == kRandom) of.errors = Drawn(seed);
      const Compared compared = RunCase(of, seed, options);
      Add(of, compared, &tally);
      std::printf("seed %llu, %s: surface %.4f -> %.4f m, shape %.3f -> %.3f m, rounds %zu\n",
                  static_cast<unsigned long long>(seed),
                  of.name.c_str(),
                  compared.without.surface_m,
                  compared.with.surface_m,
                  compared.without.shape_m,
                  compared.with.shape_m,
                  compared.with.rounds.size());
      std::fflush(stdout);
    }
    Print(of.name, tally);
  }
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  using namespace seastitch;
  Options options;
  options.survey = (ConfigDir() / "bench" / "demo.yaml").string();
  CLI::App app{"Self-calibration of simulated surveys"};
  app.add_option("--survey", options.survey, "what all surveys have in common");
  app.add_option("--errors", options.errors, "class of the navigation sensors");
  app.add_option("--case", options.cases, "only these cases");
  app.add_option("--first-seed", options.first_seed, "seed of the first survey");
  app.add_option("--runs", options.runs, "surveys a case");
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::err);
  try {
    RunAll(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-calibration: %s\n", e.what());
    return 1;
  }
  return 0;
}
