// A few runs of what build/bin/seastitch-bench-navigation does with many, within the 99.9 % band.

#include "tests/mapper/navigation/monte_carlo.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace seastitch::test {
namespace {

struct Dive {
  std::string sensors;
  bench::PlanParams plan;
  double max_drift_percent;  // what the class promises: bench/sensor_errors.hpp
};

class NavigationMonteCarlo : public testing::TestWithParam<Dive> {};

void ExpectHonest(double nees, int runs, const std::string& what) {
  const double dof = 3.0 * runs;
  const Band band = Band999(dof);
  EXPECT_GT(nees / dof, band.low) << what;
  EXPECT_LT(nees / dof, band.high) << what;
}

TEST_P(NavigationMonteCarlo, ErrorsHaveTheCovarianceThatTheFilterStates) {
  constexpr int kRuns = 4;
  MonteCarloCase c;
  c.errors = bench::SensorErrors::OfClass(GetParam().sensors);
  c.params = ParamsOf(c.errors);
  c.plan = GetParam().plan;
  c.pairs = {{0.20, 0.26}, {0.40, 0.65}, {0.10, 0.60}};
  const MonteCarloResult result = RunMonteCarlo(c, kRuns, 1);
  ExpectHonest(result.position_nees, kRuns, "position");
  ExpectHonest(result.attitude_nees, kRuns, "attitude");
  for (std::size_t i = 0; i < c.pairs.size(); ++i)
    ExpectHonest(result.relative_nees[i], kRuns, "pair " + std::to_string(i));
  // Some 4000 ensembles of three components each run, but each run has its own few constants.
  EXPECT_NEAR(result.dvl_nis, 1.0, 0.05);
  EXPECT_LT(result.drift_percent, GetParam().max_drift_percent);
}

INSTANTIATE_TEST_SUITE_P(Bench,
                         NavigationMonteCarlo,
                         testing::Values(Dive{"ins_tactical", LawnMowerPlan(1000.0, 4), 0.5},
                                         Dive{"ins_tactical", StraightPlan(1000.0), 0.5},
                                         Dive{"mems", LawnMowerPlan(1000.0, 4), 3.0},
                                         Dive{"mems", StraightPlan(1000.0), 3.0}),
                         [](const auto& test) {
                           return test.param.sensors +
                                  (test.param.plan.lines > 1 ? "_lawn_mower" : "_straight");
                         });

// The edge that a map would have across it, and one after it.
struct Silent {
  double length_s;
  bool restart;
};
class SilenceMonteCarlo : public testing::TestWithParam<Silent> {};

TEST_P(SilenceMonteCarlo, EdgesAcrossItAreHonest) {
  constexpr int kRuns = 25;
  MonteCarloCase c;
  c.errors = bench::SensorErrors::OfClass("mems");
  c.params = ParamsOf(c.errors);
  c.plan = StraightPlan(400.0);
  c.pairs = {{0.15, 0.85}, {0.7, 0.95}};
  c.silence = MonteCarloCase::Silence{0.3, GetParam().length_s, GetParam().restart};
  const MonteCarloResult result = RunMonteCarlo(c, kRuns, 1);
  std::printf("NEES over its degrees of freedom: across %.2f, after %.2f\n",
              result.relative_nees[0] / (3.0 * kRuns),
              result.relative_nees[1] / (3.0 * kRuns));
  ExpectHonest(result.relative_nees[0], kRuns, "across");
  ExpectHonest(result.relative_nees[1], kRuns, "after");
}
INSTANTIATE_TEST_SUITE_P(Lengths,
                         SilenceMonteCarlo,
                         testing::Values(Silent{0.1, true},
                                         Silent{1.0, false},
                                         Silent{1.0, true},
                                         Silent{10.0, false},
                                         Silent{10.0, true},
                                         Silent{60.0, false},
                                         Silent{60.0, true},
                                         Silent{90.0, true}),
                         [](const auto& test) {
                           return std::to_string(static_cast<int>(10.0 * test.param.length_s)) +
                                  "_tenths_s" + (test.param.restart ? "_restart" : "");
                         });

}  // namespace
}  // namespace seastitch::test
