// Tables of dead reckoning: honesty and drift by Monte Carlo on the bench's truth, or (--faults)
// what it makes of sensors and clocks that are wrong.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/mapper/navigation/monte_carlo.hpp"
#include "tests/perf/navigation_faults.hpp"

namespace seastitch::test {
namespace {

// An asterisk marks what lies outside the 95 % band: one in twenty does by chance.
void PrintNees(double sum, int runs) {
  const double dof = 3.0 * runs;
  const Band band = Band95(dof);
  const double ratio = sum / dof;
  std::printf("  %5.2f%c", ratio, ratio < band.low || ratio > band.high ? '*' : ' ');
}

void Print(const std::string& pattern,
           const std::string& name,
           const MonteCarloCase& c,
           int runs,
           std::uint64_t seed) {
  const MonteCarloResult result = RunMonteCarlo(c, runs, seed);
  std::printf("%-12s  %-12s  %6.0f", pattern.c_str(), name.c_str(), result.distance_m);
  PrintNees(result.position_nees, runs);
  PrintNees(result.attitude_nees, runs);
  for (const double sum : result.relative_nees) PrintNees(sum, runs);
  std::printf(
      "  %7.3f  %7.3f  %5.2f\n", result.drift_percent, result.stated_drift_percent, result.dvl_nis);
  const Eigen::Vector3d& mean = result.mean_by_sigma;
  const Eigen::Vector3d& square = result.mean_square_by_sigma;
  std::printf(
      "%-12s  by sigma along, across, down: mean %.2f %.2f %.2f, of squares %.2f %.2f %.2f\n",
      "",
      mean.x(),
      mean.y(),
      mean.z(),
      square.x(),
      square.y(),
      square.z());
  std::fflush(stdout);
}

bench::PlanParams PlanOf(const std::string& pattern) {
  if (pattern == "lawn-mower") return LawnMowerPlan(1000.0, 4);
  if (pattern == "straight") return StraightPlan(2000.0);
  throw std::invalid_argument("PATTERN must be lawn-mower or straight");
}

void PrintMonteCarlo(int runs,
                     std::uint64_t seed,
                     const std::vector<std::string>& sensors,
                     const std::vector<std::string>& patterns) {
  const Band band = Band95(3.0 * runs);
  std::printf(
      "%d runs each, seeds %llu to %llu; NEES by degree of freedom, 95 %% band %.2f to %.2f\n",
      runs,
      static_cast<unsigned long long>(seed),
      static_cast<unsigned long long>(seed) + static_cast<unsigned long long>(runs) - 1,
      band.low,
      band.high);
  std::printf("%-12s  %-12s  %6s  %6s  %6s  %-30s  %7s  %7s  %5s\n",
              "pattern",
              "sensors",
              "m",
              "posit.",
              "attit.",
              "relative pose by pair",
              "drift %",
              "stated",
              "NIS");
  for (const std::string& name : sensors) {
    MonteCarloCase c;
    c.errors = bench::SensorErrors::OfClass(name);
    c.params = ParamsOf(c.errors);
    // Neighbours, a quarter, a half and nearly all of the dive apart.
    c.pairs = {{0.20, 0.26}, {0.40, 0.65}, {0.10, 0.60}, {0.02, 0.98}};
    for (const std::string& pattern : patterns) {
      c.plan = PlanOf(pattern);
      Print(pattern, name, c, runs, seed);
    }
  }
}

}  // namespace
}  // namespace seastitch::test

int main(int argc, char** argv) {
  CLI::App app("Tables of dead reckoning");
  int runs = 50;
  std::uint64_t seed = 1;
  std::vector<std::string> sensors{"ins_tactical", "mems"};
  std::vector<std::string> patterns{"lawn-mower", "straight"};
  app.add_option("runs,--runs", runs, "dives of each row")->check(CLI::PositiveNumber);
  app.add_option("seed,--seed", seed, "of the first dive");
  app.add_option("sensors,--sensors", sensors, "classes of sensors");
  app.add_option("pattern,--pattern", patterns, "of the survey")
      ->check(CLI::IsMember({"lawn-mower", "straight"}));
  seastitch::test::FaultOptions faults;
  bool print_faults = false;
  app.add_flag("--faults", print_faults, "wrong sensors and clocks instead of Monte Carlo");
  app.add_option("--case", faults.only, "with --faults: only cases whose name contains this");
  app.add_option("--dives", faults.simulated, "with --faults: simulated dives, seeds 1, 2, ...");
  app.add_option("--akit", faults.akit, "with --faults: folder of the real runs T4, T6 and T11");
  app.add_flag("--counters", faults.counters, "with --faults: what the filter counted, too");
  CLI11_PARSE(app, argc, argv);
  try {
    if (print_faults)
      seastitch::test::PrintFaults(faults);
    else
      seastitch::test::PrintMonteCarlo(runs, seed, sensors, patterns);
    return EXIT_SUCCESS;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-navigation: %s\n", e.what());
    return EXIT_FAILURE;
  }
}
