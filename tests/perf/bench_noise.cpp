// seastitch-bench-noise: what learning the noise from the overlaps does, with the truth known: the
// same surveys with the noise as configured and as learned. Every line follows from the seeds that
// it prints.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/log.hpp"
#include "bench/survey_config.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/storage/submap_file.hpp"
#include "mapper/mapper_config.hpp"
#include "survey/replay/replay.hpp"
#include "tests/perf/flat_table.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct Options {
  int seeds = 3;
  int flat_pairs = 1000;
  std::string harbour;
  std::vector<std::string> flat_rasters;
  std::string submaps;
  std::vector<std::string> starts;
  std::string truth;
};

fs::path WriteConfig(const TemporaryDir& scratch, MapperConfig config, bool learn) {
  config.loop_closer.estimate_noise = learn;
  const fs::path file = scratch.path() / (learn ? "learn.yaml" : "told.yaml");
  std::ofstream(file) << PrintConfig(config);
  return file;
}

struct Run {
  ProductSummary summary;
  double cpu_s = 0.0;
};

Run Replay(const fs::path& input, const fs::path& mapper_config, const ImportedDrift& drift = {}) {
  const TemporaryDir out;
  ReplayOptions replay;
  replay.inputs = {input};
  replay.mapper_config = mapper_config;
  replay.optimizer_config = ConfigDir() / "optimizer.yaml";
  replay.default_config_dir = ConfigDir();
  replay.out = out.path() / "map";
  replay.drift = drift;
  replay.quiet = true;
  Run run;
  const std::clock_t start = std::clock();
  run.summary = RunReplay(replay);
  run.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return run;
}

// ---- simulated surveys

struct Survey {
  std::string name;
  std::string file;  // in config/bench
  std::string error_class;
  double profile_speed_error_mps = 0.0;
  std::string raster{};
  std::vector<std::uint64_t> seeds{};
};

std::vector<Survey> Surveys(const Options& options) {
  const std::vector<std::uint64_t> demo{7, 11, 12};
  const std::vector<std::uint64_t> waves{5, 11, 12};
  std::vector<Survey> surveys{
      {"sand waves", "sand_waves.yaml", "mems", 0.0, {}, waves},
      {"demo", "demo.yaml", "mems", 0.0, {}, demo},
      {"demo, class ins", "demo.yaml", "ins_tactical", 0.0, {}, demo},
      {"sand waves, class ins", "sand_waves.yaml", "ins_tactical", 0.0, {}, waves},
      {"demo, told 2 m/s off", "demo.yaml", "mems", 2.0, {}, demo},
      {"flat", "flat.yaml", "mems", 0.0, {}, {3}},
      {"close above", "close_above.yaml", "mems", 0.0, {}, {9, 11, 12}}};
  if (!options.harbour.empty())
    surveys.push_back({"harbour", "demo.yaml", "mems", 0.0, options.harbour, demo});
  for (Survey& survey : surveys)
    survey.seeds.resize(
        std::min(survey.seeds.size(), static_cast<std::size_t>(std::max(1, options.seeds))));
  return surveys;
}

// What the issue asks for, of one replay.
std::string Honesty(const ProductSummary& s) {
  if (!s.closures_against_truth || s.closures_against_truth->degrees_of_freedom == 0) return "-";
  const ClosureErrors& e = *s.closures_against_truth;
  char text[64];
  std::snprintf(text,
                sizeof text,
                "%.2f, %.0f",
                e.chi2 / static_cast<double>(e.degrees_of_freedom),
                e.worst_chi2);
  return text;
}

void PrintRow(const Survey& survey,
              std::uint64_t seed,
              const Run& told,
              const Run& learned,
              const SurveyNoise& noise) {
  const auto u = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  const NoiseEstimate& n = noise.components;
  const auto times = [](double log_sigma) { return std::exp(log_sigma); };
  std::printf(
      "| %s | %llu | %llu, %llu -> %llu, %llu | %s -> %s | %.2f -> %.2f | %.3f -> %.3f | "
      "%.2f x %.2f, %.2g x %.2f, %.2g x %.2f, %.2g x %.2f | %.1f -> %.1f |\n",
      survey.name.c_str(),
      u(seed),
      u(told.summary.loops_accepted),
      u(told.summary.loops_refused),
      u(learned.summary.loops_accepted),
      u(learned.summary.loops_refused),
      Honesty(told.summary).c_str(),
      Honesty(learned.summary).c_str(),
      told.summary.truth->after.position_rms_m,
      learned.summary.truth->after.position_rms_m,
      told.summary.truth->after_aligned.position_rms_m,
      learned.summary.truth->after_aligned.position_rms_m,
      n.sounding_variance_ratio.value,
      times(n.sounding_variance_ratio.log_sigma),
      n.correlated_error_ratio.value,
      times(n.correlated_error_ratio.log_sigma),
      n.position_walk.value,
      times(n.position_walk.log_sigma),
      n.heading_walk.value,
      times(n.heading_walk.log_sigma),
      told.cpu_s,
      learned.cpu_s);
  std::fflush(stdout);
}

void RunSurvey(const Survey& survey, std::uint64_t seed) {
  bench::SurveyConfig config = bench::LoadSurvey((ConfigDir() / "bench" / survey.file).string());
  config.seed = seed;
  config.error_class = survey.error_class;
  config.errors = bench::SensorErrors::OfClass(survey.error_class);
  config.profile_speed_error_mps = survey.profile_speed_error_mps;
  if (!survey.raster.empty()) config.raster.file = survey.raster;
  const TemporaryDir scratch;
  const fs::path log = scratch.path() / "survey.lcmlog";
  const bench::DriverConfigs drivers = bench::LoadDriverConfigs(ConfigDir());
  bench::SurveySimulator simulator(
      config, LoadVehicle((ConfigDir() / "vehicle.yaml").string()), drivers.signals());
  bench::WriteLog(&simulator, drivers, {}, log, [](double) { return true; });
  const MapperConfig mapper = LoadMapperConfigFor(config, ConfigDir());
  const Run told = Replay(log, WriteConfig(scratch, mapper, false));
  const Run learned = Replay(log, WriteConfig(scratch, mapper, true));
  PrintRow(survey, seed, told, learned, learned.summary.noise);
}

void SurveyTable(const Options& options) {
  std::printf(
      "\n## Closures against the truth\n\n"
      "Noise as configured -> as learned. closures: accepted, refused by the graph; chi2: squared "
      "errors of those\nbelieved over what they state, a degree of freedom, and the worst single "
      "one; position and shape RMS; learned, each\nwith 1 sigma as a factor: variance of a "
      "sounding "
      "over its scatter, shared error over the altitude, position walk\nm/sqrt(m), heading walk "
      "rad/sqrt(m); CPU s of the replay.\n\n"
      "| survey | seed | closures | chi2 | position m | shape m | learned | CPU s |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const Survey& survey : Surveys(options))
    for (const std::uint64_t seed : survey.seeds) RunSurvey(survey, seed);
}

// ---- submaps from elsewhere, from corrupted frames

using Frames = std::map<int, Eigen::Isometry3d>;

// A line a submap: id x y z qx qy qz qw.
Frames ReadFrames(const fs::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  Frames frames;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    int id = 0;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
    fields >> id >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w();
    if (!fields) throw std::runtime_error(path.string() + ": '" + line + "' is no frame");
    frames[id] = MakePose(p, q.normalized().toRotationMatrix());
  }
  return frames;
}

using Clouds = std::map<int, PointCloud>;

Clouds ReadClouds(const fs::path& dir, const Frames& truth) {
  Clouds clouds;
  for (const fs::directory_entry& entry : fs::directory_iterator(dir)) {
    const std::string name = entry.path().filename().string();
    const std::size_t at = name.find_first_of("0123456789");
    if (at == std::string::npos) continue;
    const int id = std::stoi(name.substr(at));
    if (truth.contains(id)) clouds[id] = ReadSubmapPcd(entry.path()).cloud;
  }
  return clouds;
}

// RMS over the frames, none of them aligned: the first is exact.
double FrameError(const Clouds& clouds,
                  const Frames& start,
                  const Frames& truth,
                  const ImportedDrift& drift,
                  bool learn) {
  const TemporaryDir scratch;
  const fs::path dir = scratch.path() / "submaps";
  fs::create_directory(dir);
  for (const auto& [id, cloud] : clouds)
    WriteSubmapPcd(dir / ("submap_" + std::to_string(id) + ".pcd"), cloud, start.at(id));
  ReplayOptions replay;
  replay.inputs = {dir};
  replay.mapper_config =
      WriteConfig(scratch, LoadMapperConfig((ConfigDir() / "mapper.yaml").string()), learn);
  replay.optimizer_config = ConfigDir() / "optimizer.yaml";
  replay.out = scratch.path() / "map";
  replay.drift = drift;
  replay.quiet = true;
  RunReplay(replay);
  double squares = 0.0;
  const Frames found = ReadFrames(replay.out / "poses.txt");
  for (const auto& [id, cloud] : clouds)
    squares += (found.at(id).translation() - truth.at(id).translation()).head<2>().squaredNorm();
  return std::sqrt(squares / static_cast<double>(clouds.size()));
}

void PrintStarts(const std::string& name,
                 const Clouds& clouds,
                 const std::vector<Frames>& starts,
                 const Frames& truth,
                 const ImportedDrift& drift) {
  double mean[2] = {0.0, 0.0};
  for (const bool learn : {false, true})
    for (const Frames& start : starts)
      mean[learn] +=
          FrameError(clouds, start, truth, drift, learn) / static_cast<double>(starts.size());
  std::printf("| %s | %zu | %zu | %.3f | %.3f |\n",
              name.c_str(),
              clouds.size(),
              starts.size(),
              mean[0],
              mean[1]);
  std::fflush(stdout);
}

// Three lines of ten submaps without noise, side by side.
void NoiseFree(Clouds* clouds, Frames* truth) {
  const SyntheticSeabed seabed = SyntheticSeabed::Fractal(1, 0.5);
  SyntheticPairParams shape;
  shape.sounding_sigma_m = 0.0;
  shape.length_m = 30.0;
  std::mt19937_64 random(1);
  for (int id = 0; id < 30; ++id) {
    const int line = id / 10;
    const int along = line % 2 == 0 ? id % 10 : 9 - id % 10;
    const double yaw = line % 2 == 0 ? 0.0 : kPi;
    const Pose2 middle{28.0 * along, 26.0 * line, yaw};
    const Eigen::Isometry3d frame =
        MakePose({middle.x, middle.y, -15.0}, RotationFromRpy(0.0, 0.0, yaw));
    (*truth)[id] = frame;
    (*clouds)[id] = SampleSubmap(seabed, frame, middle, shape, &random).cloud;
  }
}

Frames Corrupted(const Frames& truth, double edge_m, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> unit(0.0, 1.0);
  Frames frames{{truth.begin()->first, truth.begin()->second}};
  for (auto at = truth.begin(), next = std::next(at); next != truth.end(); at = next++) {
    const Eigen::Isometry3d step = at->second.inverse() * next->second;
    const Eigen::Isometry3d error = MakePose({edge_m * unit(random), edge_m * unit(random), 0.0},
                                             RotationFromRpy(0.0, 0.0, 0.005 * unit(random)));
    frames[next->first] = frames.at(at->first) * step * error;
    frames[next->first].translation().z() = next->second.translation().z();
  }
  return frames;
}

void SubmapTable(const Options& options) {
  std::printf(
      "\n## Submaps from elsewhere\n\nRMS error of the frames in x, y, mean over the starts "
      "[m].\n\n"
      "| survey | submaps | starts | as configured | as learned |\n|---|---|---|---|---|\n");
  Clouds clouds;
  Frames truth;
  NoiseFree(&clouds, &truth);
  for (const double edge_m : {2.0, 0.6}) {
    std::vector<Frames> starts;
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      starts.push_back(Corrupted(truth, edge_m, seed));
    char name[64];
    std::snprintf(name, sizeof name, "without noise, %.1f m an edge", edge_m);
    PrintStarts(name, clouds, starts, truth, {edge_m, 0.3});
  }
  if (options.submaps.empty()) return;
  const Frames given = ReadFrames(options.truth);
  std::vector<Frames> starts;
  for (const std::string& file : options.starts) starts.push_back(ReadFrames(file));
  if (starts.empty()) throw std::runtime_error("--submaps needs --start");
  PrintStarts(fs::path(options.submaps).filename().string(),
              ReadClouds(options.submaps, given),
              starts,
              given,
              {});
}

void RunAll(const Options& options) {
  std::printf("# Noise learned from the overlaps\n");
  SubmapTable(options);
  SurveyTable(options);
  std::vector<SeabedClass> flat{ProceduralClasses()[0]};
  for (const std::string& file : options.flat_rasters) flat.push_back(RasterClass(file));
  if (options.flat_pairs > 0) PrintFlatTable(flat, options.flat_pairs, 1);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  seastitch::Options options;
  CLI::App app("The same surveys with the noise as configured and as learned, against the truth");
  app.add_option("--seeds", options.seeds, "of every simulated survey, 1 to 3")
      ->check(CLI::Range(1, 3))
      ->capture_default_str();
  app.add_option("--flat-pairs", options.flat_pairs, "0: none")->capture_default_str();
  app.add_option("--raster", options.harbour, "a seabed with relief: any raster in metres")
      ->check(CLI::ExistingFile);
  app.add_option("--flat-raster", options.flat_rasters, "a seabed without")
      ->check(CLI::ExistingFile);
  CLI::Option* const submaps = app.add_option("--submaps", options.submaps, "folder of PCD files")
                                   ->check(CLI::ExistingDirectory);
  app.add_option("--start", options.starts, "their frames at the start; several")->needs(submaps);
  CLI::Option* const truth = app.add_option("--truth", options.truth, "and their true frames");
  submaps->needs(truth);
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::err);
  try {
    seastitch::RunAll(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-noise: %s\n", e.what());
    return 1;
  }
  return 0;
}
