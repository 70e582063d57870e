// seastitch-bench-registration: tables of how well, how honestly and how fast one registration does
// beside the Cramer-Rao bound and PCL's GICP. Every line follows from the seeds that it prints.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "common/core/median.hpp"
#include "common/runtime/process/freed_memory.hpp"
#include "tests/perf/flat_table.hpp"
#include "tests/perf/pcl_gicp.hpp"
#include "tests/perf/registration_trial.hpp"

namespace seastitch {
namespace {

struct Options {
  std::vector<std::string> rasters;
  std::vector<std::string> flat_rasters;
  std::vector<std::string> tables;
  bool full = false;
  std::uint64_t first_seed = 1;
};

constexpr Tolerance kLoose{0.25, Deg2Rad(0.5)};
constexpr Tolerance kTight{0.1, Deg2Rad(0.2)};

double Percent(double part, int whole) { return whole == 0 ? 0.0 : 100.0 * part / whole; }

// Counts over trials that differ by their seed alone.
struct Tally {
  int trials = 0;
  int accepted = 0;
  int wrong = 0;
  int loose = 0;
  int tight = 0;
  double relief_m = 0.0;
  double nees = 0.0;
  double degrees = 0.0;
  int within_ellipse = 0;
  std::vector<double> cpu_ms;

  void Add(const TrialOutcome& outcome) {
    ++trials;
    accepted += outcome.Accepted();
    wrong += outcome.ConfidentlyWrong();
    loose += kLoose.Holds(outcome.error);
    tight += kTight.Holds(outcome.error);
    cpu_ms.push_back(1e3 * outcome.cpu_s);
    if (!outcome.Accepted()) return;
    constexpr double kChi2Of95Percent[4] = {0.0, 3.841, 5.991, 7.815};
    nees += outcome.Nees();
    degrees += outcome.result.known_directions;
    within_ellipse += outcome.Nees() <= kChi2Of95Percent[outcome.result.known_directions];
  }
};

Tally RunTrials(const SeabedClass& seabed,
                const Trial& trial,
                int count,
                std::uint64_t first_seed,
                const RegistrationParams& params = {}) {
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const Site site = seabed.site(seed);
    const SyntheticPair pair = MakeTrialPair(site, trial, seed);
    const Pose2 prior = MakeTrialPrior(pair, trial, seed);
    tally.Add(RunTrial(pair, prior, PriorCovariance(trial), params));
    tally.relief_m += ReliefOf(site, pair, trial.pair) / count;
  }
  return tally;
}

// Expected counts of the Cramer-Rao bound; it knows no start.
struct Bound {
  double loose = 0.0;
  double tight = 0.0;
};

Bound BoundOf(const SeabedClass& seabed, const Trial& trial, int count, std::uint64_t first_seed) {
  std::vector<Site> sites;
  std::vector<SyntheticPair> pairs;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    sites.push_back(seabed.site(seed));
    pairs.push_back(MakeTrialPair(sites.back(), trial, seed));
  }
  Bound bound;
  for (const Eigen::Matrix3d& information : FisherInformation(sites, pairs, trial.pair)) {
    bound.loose += CramerRaoRate(information, kLoose);
    bound.tight += CramerRaoRate(information, kTight);
  }
  return bound;
}

Trial Standard(double offset_m, double yaw_deg) {
  Trial trial;
  trial.pair.points = 10'000;
  trial.offset_m = offset_m;
  trial.yaw_rad = Deg2Rad(yaw_deg);
  return trial;
}

void PrintSeeds(const Options& options, int count) {
  std::printf("seeds %llu to %llu\n",
              static_cast<unsigned long long>(options.first_seed),
              static_cast<unsigned long long>(options.first_seed) + count - 1);
}

void SuccessTable(const std::vector<SeabedClass>& classes, const Options& options) {
  struct Start {
    double offset_m;
    double yaw_deg;
  };
  std::vector<Start> starts = {{0.5, 0.0}, {4.0, 2.0}, {16.0, 5.0}};
  if (options.full) {
    starts.clear();
    for (const double yaw : {0.0, 2.0, 5.0})
      for (const double offset : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) starts.push_back({offset, yaw});
  }
  const int count = options.full ? 50 : 10;
  std::printf(
      "\n## Success against the start\n\n"
      "60 x 40 m, 10,000 points each, 40 %% overlap, sounding noise 0.05 m. Per cent of all pairs "
      "that\nend within 0.25 m and 0.5 deg (0.1 m and 0.2 deg) of the truth, beside the "
      "Cramer-Rao bound\nof two surveys of a seabed that neither knows.\n%d pairs a line, ",
      count);
  PrintSeeds(options, count);
  std::printf(
      "\n| seabed | relief m | offset m | yaw deg | within 0.25 m | bound | within 0.1 m | bound |"
      " accepted | confidently wrong |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const SeabedClass& seabed : classes) {
    const Bound bound = BoundOf(seabed, Standard(0.0, 0.0), count, options.first_seed);
    for (const Start& start : starts) {
      const Tally t =
          RunTrials(seabed, Standard(start.offset_m, start.yaw_deg), count, options.first_seed);
      std::printf("| %s | %.2f | %.1f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f | %d |\n",
                  seabed.name.c_str(),
                  t.relief_m,
                  start.offset_m,
                  start.yaw_deg,
                  Percent(t.loose, count),
                  Percent(bound.loose, count),
                  Percent(t.tight, count),
                  Percent(bound.tight, count),
                  Percent(t.accepted, count),
                  t.wrong);
      std::fflush(stdout);
    }
  }
}

void CovarianceTable(const std::vector<SeabedClass>& classes, const Options& options) {
  // Nothing that soundings share is simulated, so none of it is allowed for.
  RegistrationParams params;
  params.noise = {1.0, 0.0, 0.0, 0.0};
  params.min_position_sigma_m = 0.0;
  const int count = options.full ? 100 : 20;
  std::printf(
      "\n## Honesty of the covariance\n\nAccepted pairs from 1.5 m and 1 deg off: squared error "
      "over its covariance, a degree of freedom\n(1 is honest), and how often the 95 %% ellipse "
      "holds the truth. %d pairs a line, ",
      count);
  PrintSeeds(options, count);
  std::printf(
      "\n| seabed | noise m | accepted %% | NEES / dof | in the ellipse %% | confidently wrong |\n"
      "|---|---|---|---|---|---|\n");
  for (const SeabedClass& seabed : classes) {
    for (const double sigma : {0.02, 0.05, 0.1, 0.2}) {
      Trial trial = Standard(1.5, 1.0);
      trial.pair.sounding_sigma_m = sigma;
      const Tally t = RunTrials(seabed, trial, count, options.first_seed, params);
      if (t.accepted == 0) {
        std::printf("| %s | %.2f | 0 | - | - | 0 |\n", seabed.name.c_str(), sigma);
        continue;
      }
      std::printf("| %s | %.2f | %.0f | %.2f | %.0f | %d |\n",
                  seabed.name.c_str(),
                  sigma,
                  Percent(t.accepted, count),
                  t.nees / t.degrees,
                  Percent(t.within_ellipse, t.accepted),
                  t.wrong);
      std::fflush(stdout);
    }
  }
}

void HeightBiasTable(const std::vector<SeabedClass>& classes, const Options& options) {
  const int count = options.full ? 100 : 20;
  std::printf(
      "\n## A height bias between the submaps (tide, draft, sound speed)\n\nFrom 4 m and 2 deg "
      "off; per cent within 0.25 m and 0.5 deg. %d pairs a cell, ",
      count);
  PrintSeeds(options, count);
  std::printf("\n| seabed | none | 0.1 m | 0.3 m |\n|---|---|---|---|\n");
  for (const SeabedClass& seabed : classes) {
    std::printf("| %s |", seabed.name.c_str());
    for (const double bias : {0.0, 0.1, 0.3}) {
      Trial trial = Standard(4.0, 2.0);
      trial.pair.z_bias_m = bias;
      const Tally t = RunTrials(seabed, trial, count, options.first_seed);
      std::printf(" %.0f |", Percent(t.loose, count));
      std::fflush(stdout);
    }
    std::printf("\n");
  }
}

PointCloud Leveled(const SyntheticSubmap& submap) {
  const Eigen::Matrix3f R = LevelFromBody(submap.T_map_submap).cast<float>();
  PointCloud out;
  for (const Eigen::Vector3f& p : submap.cloud.points) out.Add(R * p);
  return out;
}

Tally RunPclTrials(const SeabedClass& seabed,
                   const Trial& trial,
                   int count,
                   std::uint64_t first_seed,
                   double gate_m) {
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const SyntheticPair pair = MakeTrialPair(seabed.site(seed), trial, seed);
    const Pose2 prior = MakeTrialPrior(pair, trial, seed);
    const PclGicp gicp(Leveled(pair.target), Leveled(pair.source), gate_m);
    const std::clock_t start = std::clock();
    const Eigen::Isometry3d T = gicp.Align(
        MakePose({prior.x, prior.y, pair.z_prior_m}, RotationFromRpy(0.0, 0.0, prior.yaw)));
    TrialOutcome outcome;
    outcome.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    outcome.error = PoseError(LevelPose(T), pair.T_target_source);
    tally.Add(outcome);
  }
  return tally;
}

void TimeTable(const SeabedClass& seabed, const Options& options) {
  const int count = options.full ? 20 : 5;
  const int pcl_count = options.full ? 5 : 2;
  std::printf(
      "\n## Time of a pair\n\nSeabed: %s. CPU time on one core, preparation of both submaps "
      "included, median. %d pairs (PCL: %d),\n",
      seabed.name.c_str(),
      count,
      pcl_count);
  PrintSeeds(options, count);
  std::printf(
      "\n| points each | offset m | method | ms | within 0.25 m %% |\n|---|---|---|---|---|\n");
  const auto print = [](int points, double offset_m, const char* method, const Tally& t) {
    std::printf("| %d | %.0f | %s | %.1f | %.0f |\n",
                points,
                offset_m,
                method,
                t.cpu_ms.empty() ? 0.0 : Median(t.cpu_ms),
                Percent(t.loose, t.trials));
    std::fflush(stdout);
  };
  for (const int points : {10'000, 50'000}) {
    for (const double offset : {1.0, 16.0}) {
      Trial trial = Standard(offset, 2.0);
      trial.pair.points = points;
      print(points, offset, "Seastitch", RunTrials(seabed, trial, count, options.first_seed));
    }
    const Trial near = [&] {
      Trial trial = Standard(1.0, 2.0);
      trial.pair.points = points;
      return trial;
    }();
    print(points,
          1.0,
          "PCL GICP, gate 2 m",
          RunPclTrials(seabed, near, pcl_count, options.first_seed, 2.0));
    print(points,
          1.0,
          "PCL GICP, gate 20 m",
          RunPclTrials(seabed, near, pcl_count, options.first_seed, 20.0));
  }
}

void Run(const Options& options) {
  std::vector<SeabedClass> classes = ProceduralClasses();
  const SeabedClass medium = classes[2];
  std::vector<SeabedClass> flat = {classes[0]};
  for (const std::string& file : options.rasters) classes.push_back(RasterClass(file));
  for (const std::string& file : options.flat_rasters) flat.push_back(RasterClass(file));
  std::printf("# Registration, %s run\n", options.full ? "full" : "quick");
  const auto wanted = [&](const std::string& table) {
    return options.tables.empty() ||
           std::count(options.tables.begin(), options.tables.end(), table);
  };
  if (wanted("success")) SuccessTable(classes, options);
  if (wanted("covariance")) CovarianceTable(classes, options);
  if (wanted("flat")) PrintFlatTable(flat, options.full ? 1000 : 200, options.first_seed);
  if (wanted("bias")) HeightBiasTable(classes, options);
  if (wanted("time")) TimeTable(medium, options);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  seastitch::KeepFreedMemory();  // as the mapper
  seastitch::Options options;
  CLI::App app(
      "Tables of the registration's success, honesty and time, over seabeds that are "
      "formulas and rasters that are given");
  app.add_option("--raster", options.rasters, "a seabed with relief: any raster in metres")
      ->check(CLI::ExistingFile);
  app.add_option("--flat-raster", options.flat_rasters, "a seabed without: nothing may be closed")
      ->check(CLI::ExistingFile);
  app.add_option("--table", options.tables, "only these")
      ->check(CLI::IsMember({"success", "covariance", "flat", "bias", "time"}));
  app.add_flag("--full", options.full, "many pairs and every start, not a quick look");
  app.add_option("--seed", options.first_seed, "of the first pair of every table");
  CLI11_PARSE(app, argc, argv);
  try {
    seastitch::Run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-registration: %s\n", e.what());
    return 1;
  }
  return 0;
}
