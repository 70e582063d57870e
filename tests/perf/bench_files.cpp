// seastitch-bench-files: the same simulated surveys through sensors and dead reckoning, and through
// a .kmall of an INS that navigates by itself and is fixed now and then. Shape error of the
// delivered map of each, against the truth.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "bench/log.hpp"
#include "bench/survey_config.hpp"
#include "bench/truth.hpp"
#include "common/core/pose.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "mapper/mapper_config.hpp"
#include "survey/replay/replay.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/kmall_pieces.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"
#include "tools/survey_writer.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kFixSigmaM = 2.0;
constexpr double kFixEveryS = 240.0;

struct Folder {
  fs::path p;
  const fs::path& path() const { return p; }
};

ProductSummary Map(const std::vector<fs::path>& inputs,
                   const fs::path& mapper,
                   const fs::path& truth,
                   const fs::path& out) {
  ReplayOptions options;
  options.inputs = inputs;
  options.mapper_config = mapper;
  options.optimizer_config = ConfigDir() / "optimizer.yaml";
  options.truth = truth;
  options.out = out;
  options.quiet = true;
  return RunReplay(options);
}

// mapper.yaml with the data sheet of the INS: of what is wrong with its sensors.
void WriteGivenConfig(const fs::path& base,
                      const bench::SensorErrors& e,
                      bool follow_velocity,
                      const fs::path& path) {
  MapperConfig config = LoadMapperConfig(base.string());
  InsNavigationParams& ins = config.given_navigation;
  ins.heading_rad = Deg2Rad(e.heading_bias_deg);
  // What comes and goes with the heading is another on every line.
  ins.heading_wander_rad = {Deg2Rad(std::hypot(e.heading_wander_deg, e.heading_deviation_deg)),
                            e.heading_wander_tau_s};
  ins.distance_ratio = e.dvl_scale;
  ins.random_walk_m_per_rtm = 0.01;
  ins.position_sigma_m = kFixSigmaM;
  ins.follow_velocity = follow_velocity;
  std::ofstream(path) << PrintConfig(config);
}

void CompareFiles(const std::string& survey_file,
                  const std::string& errors,
                  std::uint64_t first_seed,
                  int runs,
                  int dives,
                  const std::string& format,
                  bool velocities,
                  bool follow_velocity,
                  const std::string& keep) {
  std::printf(
      "survey %s, errors %s, as .%s%s, a fix of %.0f m every %.0f s; shape error RMS [m], before "
      "and "
      "after\n",
      survey_file.c_str(),
      errors.c_str(),
      format.c_str(),
      velocities ? "" : ", positions without velocities",
      kFixSigmaM,
      kFixEveryS);
  std::printf("%5s %10s %10s | %10s %10s | %6s %6s",
              "seed",
              "sensors",
              "map",
              "INS file",
              "map",
              "jumps",
              "ratio");
  std::printf("%s\n",
              dives > 1 ? " | cut into dives: map, ratio to one, joined | map of all but the "
                          "last, with the last: map, ratio to all at once"
                        : "");
  double sensors2 = 0.0;
  double files2 = 0.0;
  double dives2 = 0.0;
  for (int run = 0; run < runs; ++run) {
    const TemporaryDir temporary;
    const Folder dir{keep.empty()
                         ? temporary.path()
                         : fs::path(keep) /
                               std::to_string(first_seed + static_cast<std::uint64_t>(run))};
    fs::create_directories(dir.path());
    bench::SurveyConfig survey = bench::LoadSurvey(survey_file);
    survey.seed = first_seed + static_cast<std::uint64_t>(run);
    survey.error_class = errors;
    survey.errors = bench::SensorErrors::OfClass(errors);
    survey.fixes.gps = false;  // all the time, not at the surface alone
    survey.fixes.interval_s = kFixEveryS;
    survey.fixes.sigma_m = kFixSigmaM;
    const bench::DriverConfigs drivers = bench::LoadDriverConfigs(ConfigDir());
    bench::SurveySimulator simulator(
        survey, LoadVehicle((ConfigDir() / "vehicle.yaml").string()), drivers.signals());
    const fs::path log = dir.path() / "survey.lcmlog";
    bench::WriteLog(&simulator, drivers, {}, log, {});
    const fs::path mapper = WriteMapperConfigFor(survey, ConfigDir(), dir.path());
    const fs::path given_file = dir.path() / ("survey." + format);
    SurveyWriterOptions writer{log, LoadMapperConfig(mapper.string()), given_file};
    writer.velocity_with_position = velocities;
    const SurveyWriterResult file = WriteSurveyFile(writer);
    const fs::path truth = bench::TruthPathFor(log);
    const ProductSummary a = Map({log}, mapper, truth, dir.path() / "a");
    const fs::path given = dir.path() / "given.yaml";
    WriteGivenConfig(mapper, survey.errors, follow_velocity, given);
    const ProductSummary b = Map({given_file}, given, truth, dir.path() / "b");
    const double sensors = a.truth->after_aligned.position_rms_m;
    const double files = b.truth->after_aligned.position_rms_m;
    sensors2 += sensors * sensors;
    files2 += files * files;
    std::printf("%5llu %10.3f %10.3f | %10.3f %10.3f | %6lld %6.2f",
                static_cast<unsigned long long>(survey.seed),
                a.truth->before_aligned.position_rms_m,
                sensors,
                b.truth->before_aligned.position_rms_m,
                files,
                static_cast<long long>(file.fixes),
                files / sensors);
    if (dives > 1) {
      auto folders = testing::CutKmall(given_file, dives, dir.path(), "dive");
      const ProductSummary c = Map(folders, given, truth, dir.path() / "c");
      const double cut = c.truth->after_aligned.position_rms_m;
      dives2 += cut * cut;
      const auto joined = std::count_if(
          c.dives.begin(), c.dives.end(), [](const DiveInMap& dive) { return dive.group == 0; });
      std::printf(
          " | %.3f %.2f %lld of %d", cut, cut / files, static_cast<long long>(joined), dives);
      const fs::path last = folders.back();
      folders.pop_back();
      Map(folders, given, truth, dir.path() / "earlier");
      const ProductSummary d = Map({dir.path() / "earlier", last}, given, truth, dir.path() / "d");
      const double later = d.truth->after_aligned.position_rms_m;
      std::printf(" | %.3f %.3f", later, later / cut);
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("all: %.3f m through sensors, %.3f m from files, ratio %.3f\n",
              std::sqrt(sensors2 / runs),
              std::sqrt(files2 / runs),
              std::sqrt(files2 / sensors2));
  if (dives > 1)
    std::printf("all: %.3f m in %d dives, %.3f times that in one\n",
                std::sqrt(dives2 / runs),
                dives,
                std::sqrt(dives2 / files2));
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  spdlog::set_level(spdlog::level::warn);
  std::string survey = (seastitch::ConfigDir() / "bench" / "demo.yaml").string();
  std::uint64_t first_seed = 1;
  std::string errors = "ins_tactical";
  int runs = 5;
  int dives = 1;
  std::string format = "kmall";
  CLI::App app("Maps of the same surveys through sensors and from files alone");
  app.add_option("--survey", survey, "survey description")->capture_default_str();
  app.add_option("--errors", errors, "class of sensors: ins_tactical, mems")->capture_default_str();
  app.add_option("--first-seed", first_seed, "of the surveys")->capture_default_str();
  app.add_option("--runs", runs, "surveys")->capture_default_str();
  app.add_option(
         "--dives",
         dives,
         "also cuts the file into so many dives, and maps the last with a map of the others")
      ->capture_default_str();
  app.add_option("--format", format, "of the files; dives are cut from kmall")
      ->check(CLI::IsMember({"kmall", "all", "s7k"}))
      ->capture_default_str();
  bool velocities = true;
  app.add_flag("!--no-velocities", velocities, "positions of the INS without velocities");
  bool follow_velocity = false;
  app.add_flag("--follow-velocity", follow_velocity, "given_navigation.follow_velocity");
  std::string keep;
  app.add_option("--keep", keep, "leaves logs, files and maps in this folder, by seed");
  CLI11_PARSE(app, argc, argv);
  seastitch::CompareFiles(
      survey, errors, first_seed, runs, dives, format, velocities, follow_velocity, keep);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-files: %s\n", e.what());
  return 1;
}
