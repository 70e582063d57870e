// Relative poses across a fault, many times over, each time with its own draw of every sensor
// error: what dead reckoning states of an edge from before the fault, or within it, has to hold.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/fault_cases.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"
#include "tests/mapper/navigation/fault_score.hpp"
#include "tests/mapper/navigation/monte_carlo.hpp"

namespace seastitch::test {
namespace {

constexpr int kRuns = 32;
constexpr double kDurationS = 150.0;  // with two pairs of turns: 40 to 54 s and 97 to 111 s
constexpr double kImuHz = 50.0;
constexpr std::size_t kApartS = 30;

struct Reset {
  FaultCase fault;
  std::string counted;  // without it the fault was not there; empty: an offset is suspected
};

class ResetMonteCarlo : public testing::TestWithParam<Reset> {};

bool IsSeen(const Reset& reset, const DeadReckoning& navigation) {
  if (reset.counted.empty()) return !navigation.suspected_offsets().empty();
  return navigation.counters().contains(reset.counted);
}

// Mean over the pairs of seconds kApartS apart of which one at least lies in the fault, or it
// between them.
double MeanNees(const FaultCase& fault, const Dive& dive, const DeadReckoning& navigation) {
  const double to_s = fault.to_s < 0.0 ? kDurationS : fault.to_s;
  double sum = 0.0;
  int pairs = 0;
  for (std::size_t from = 2; from + kApartS < dive.truth.size(); from += 6) {
    const auto from_s = static_cast<double>(from);
    if (from_s + static_cast<double>(kApartS) < fault.from_s || from_s > to_s) continue;
    sum += RelativeNees(dive.truth[from], dive.truth[from + kApartS], navigation).value();
    ++pairs;
  }
  return sum / pairs;
}

TEST_P(ResetMonteCarlo, EdgesAcrossItAreHonest) {
  double nees = 0.0;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    Dive dive = SimulatedDive(1000 + run, kDurationS, kImuHz);
    GetParam().fault.apply(&dive);
    DeadReckoning navigation(dive.params, dive.vehicle);
    FeedDive(dive, &navigation);
    EXPECT_TRUE(IsSeen(GetParam(), navigation)) << "run " << run;
    nees += MeanNees(GetParam().fault, dive, navigation);
  }
  // Pairs of one run share its constants: no more degrees of freedom than one pair.
  const double dof = 3.0 * kRuns;
  const Band band = Band999(dof);
  EXPECT_GT(nees / dof, band.low);
  EXPECT_LT(nees / dof, band.high);
}

INSTANTIATE_TEST_SUITE_P(
    Faults,
    ResetMonteCarlo,
    testing::Values(Reset{WrongVelocities(80.0, 30.0), "dvl_stepped"},
                    Reset{HeadingStep(20.0, 80.0, 110.0), "heading_step_back"},
                    Reset{LateDvl(0.1), ""},
                    Reset{LateDvl(1.0), ""},
                    Reset{LateDvl(-0.2), ""},
                    Reset{LateAttitude(0.45), ""},
                    Reset{Stuck(StuckSensor::kAttitude, 80.0, 30.0), "attitude_frozen"},
                    Reset{Stuck(StuckSensor::kGyro, 80.0, 30.0), "gyro_doubted"}),
    [](const auto& test) {
      std::string name = test.param.fault.name;
      std::replace_if(
          name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
      return name;
    });

}  // namespace
}  // namespace seastitch::test
