#include "tests/perf/flat_table.hpp"

#include <cstdio>

namespace seastitch {
namespace {

// At its extremes: a seabed without relief has to be refused under each.
struct LearnedNoise {
  const char* name;
  VarianceComponents components;
};
const std::vector<LearnedNoise> kLearnedNoise = {
    {"as configured", {}},
    {"no shared error, no walk", {1.0, 1e-6, 0.00025, 2.5e-5}},
    {"the same, soundings half as noisy", {0.5, 1e-6, 0.00025, 2.5e-5}},
    {"shared error 0.3 %", {1.0, 0.003, 0.002, 2e-4}},
    {"shared error 0.3 %, walks as large as they come", {1.0, 0.003, 0.016, 1.6e-3}}};

}  // namespace

void PrintFlatTable(const std::vector<SeabedClass>& classes, int pairs, std::uint64_t first_seed) {
  std::printf(
      "\n## False acceptance where nothing can be known\n\nPairs from 8 m and 2 deg off, 2,500 "
      "points each, under noise that a survey may have learned. seeds %llu to %llu\n\n"
      "| seabed | noise | pairs | accepted | confidently wrong |\n|---|---|---|---|---|\n",
      static_cast<unsigned long long>(first_seed),
      static_cast<unsigned long long>(first_seed) + static_cast<unsigned long long>(pairs) - 1);
  Trial trial;
  trial.pair.points = 2500;
  trial.offset_m = 8.0;
  trial.yaw_rad = Deg2Rad(2.0);
  for (const SeabedClass& seabed : classes) {
    for (const LearnedNoise& noise : kLearnedNoise) {
      RegistrationParams params;
      params.noise = noise.components;
      int accepted = 0;
      int wrong = 0;
      for (int i = 0; i < pairs; ++i) {
        const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
        const SyntheticPair pair = MakeTrialPair(seabed.site(seed), trial, seed);
        const Pose2 prior = MakeTrialPrior(pair, trial, seed);
        const TrialOutcome outcome = RunTrial(pair, prior, PriorCovariance(trial), params);
        accepted += outcome.Accepted();
        wrong += outcome.ConfidentlyWrong();
      }
      std::printf(
          "| %s | %s | %d | %d | %d |\n", seabed.name.c_str(), noise.name, pairs, accepted, wrong);
      std::fflush(stdout);
    }
  }
}

}  // namespace seastitch
