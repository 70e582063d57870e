// Soundings of a survey whose sonar has an error, made by a geometry of their own: what the
// overlaps say of it.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/calibration/calibration_cells.hpp"
#include "mapper/calibration/calibration_limits.hpp"
#include "mapper/calibration/calibration_solver.hpp"
#include "mapper/calibration/overlap_rows.hpp"
#include "tests/mapper/calibration/simulated_survey.hpp"

namespace seastitch {
namespace {

using test::kSonar;
using test::kStart;
using test::kThreeAndACross;
using test::Line;
using test::Mapped;
using test::Simulated;

CalibrationEstimate EstimateOf(const Mapped& mapped, const SonarHeads& heads = {kSonar}) {
  std::vector<CalibrationCells> cells;
  std::vector<CellsPlace> places;
  SoundingNoise noise;
  for (std::size_t i = 0; i < mapped.soundings.size(); ++i) {
    cells.push_back(CellsOf(mapped.soundings[i], heads));
    places.push_back({mapped.T_map_level[i], mapped.z_m[i], 0.0});
    noise.Add(cells.back());
  }
  noise.Finish();
  return EstimateCalibration(
      mapped.times, [&](const std::function<void(const OverlapOfPair&)>& take) {
        for (std::size_t source = 1; source < cells.size(); ++source)
          for (std::size_t target = 0; target < source; ++target) {
            OverlapOfPair pair{target, source, {}};
            pair.rows = RowsOf(cells[target], places[target], cells[source], places[source], noise);
            if (!pair.rows.empty()) take(pair);
          }
      });
}

const std::vector<Line> kTwo{{{0.0, 0.0}, 0.0}, {{test::kLineM, 14.0}, kPi}};

TEST(Calibration, FindsEachErrorAndOnlyThat) {
  const SonarCalibration injected[] = {
      {},
      {.roll_rad = Deg2Rad(0.3)},
      {.smile_mps = -4.0},
      {.attitude_latency_ms = 20.0},
      {.depth_latency_ms = -40.0},
      {.roll_scale_percent = 3.0},
      {.heave_scale_percent = -10.0},
      {.roll_rad = Deg2Rad(-0.2), .smile_mps = 3.0, .attitude_latency_ms = -15.0},
  };
  for (std::size_t i = 0; i < std::size(injected); ++i) {
    const CalibrationEstimate found =
        EstimateOf(Simulated(kThreeAndACross, injected[i], static_cast<std::uint32_t>(i + 1)));
    EXPECT_GE(found.pairs, 10) << i;
    for (const CalibrationName& of : kCalibrationNames) {
      if (of.key == CalibrationKey::kSmileByWater) continue;  // goes with the smile
      if (of.key == CalibrationKey::kSecondHeadRoll) {
        EXPECT_EQ(found.Of(of.key).sigma, 0.0);
        continue;
      }
      const double truth = injected[i].*of.value;
      const CalibratedValue& value = found.Of(of.key);
      // One part in 30 of an error is left by the first linearisation.
      EXPECT_NEAR(value.add, truth, 3.0 * value.sigma + std::abs(truth) / 30.0) << i << of.name;
      EXPECT_EQ(value.is_clear, truth != 0.0) << i << of.name << value.add / value.sigma;
    }
    if (found.HasClear()) {
      EXPECT_LT(found.after_m, found.before_m) << i;
    }
  }
}

// Heads that look 30 degrees to both sides.
TEST(Calibration, FindsTheRollOfEachOfTwoHeads) {
  SonarHeads heads;
  for (const double to_port_deg : {30.0, -30.0})
    heads.push_back(MakePose({0.3, to_port_deg > 0.0 ? -0.2 : 0.2, 0.1},
                             RotationFromRpy(Deg2Rad(to_port_deg), 0.0, 0.0)));
  const SonarCalibration injected{.roll_rad = Deg2Rad(0.3), .second_head_roll_rad = Deg2Rad(-0.2)};
  const CalibrationEstimate found =
      EstimateOf(Simulated(kThreeAndACross, injected, 7, heads), heads);
  for (const CalibrationName& of : kCalibrationNames) {
    const CalibratedValue& value = found.Of(of.key);
    const double truth = injected.*of.value;
    EXPECT_NEAR(value.add, truth, 3.0 * value.sigma + std::abs(truth) / 30.0) << of.name;
    EXPECT_EQ(value.is_clear, truth != 0.0) << of.name;
  }
}

// A tide is told of, and no value takes it.
TEST(Calibration, StatesADepthThatChangesOverTheSurvey) {
  Mapped mapped = Simulated(kThreeAndACross, {}, 6);
  const CalibrationEstimate without = EstimateOf(mapped);
  EXPECT_FALSE(without.depth_m.IsClear()) << without.depth_m.rms << " " << without.depth_m.sigma;
  std::vector<double> tide_m;
  double mean_m = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < mapped.times.size(); ++i) {
    tide_m.push_back(0.1 * std::sin(ToSeconds(mapped.times[i] - kStart) / 900.0));
    mapped.z_m[i] += tide_m.back();
    mean_m += tide_m.back() / static_cast<double>(mapped.times.size());
  }
  for (const double m : tide_m)
    squares += std::pow(m - mean_m, 2) / static_cast<double>(tide_m.size());
  const CalibrationEstimate found = EstimateOf(mapped);
  EXPECT_TRUE(found.depth_m.IsClear()) << found.depth_m.rms << " " << found.depth_m.sigma;
  EXPECT_NEAR(found.depth_m.rms, std::sqrt(squares), 0.25 * std::sqrt(squares));
  EXPECT_FALSE(found.roll_rad.IsClear());
  EXPECT_FALSE(found.HasClear());
}

// As of files of two dives that are taken for one. The other values are of no use then, either.
TEST(Calibration, AppliesNothingWhereAValueIsLargerThanAnySonarHas) {
  const SonarCalibration injected{.roll_rad = Deg2Rad(0.5), .roll_scale_percent = -37.0};
  const CalibrationEstimate found = EstimateOf(Simulated(kThreeAndACross, injected, 9));
  EXPECT_LT(found.Of(CalibrationKey::kRollScale).add, -20.0);
  EXPECT_FALSE(IsPossible(found));
  EXPECT_FALSE(found.HasClear());
  EXPECT_TRUE(found.Corrected().IsZero());
}

// What a second round has to find: nothing that is worth a change.
TEST(Calibration, LeavesNothingToTheNextRound) {
  const SonarCalibration injected{.roll_rad = Deg2Rad(0.5), .smile_mps = 6.0};
  CalibrationEstimate found = EstimateOf(Simulated(kThreeAndACross, injected, 3));
  const SonarCalibration corrected = found.Corrected();
  const CalibrationEstimate again =
      EstimateOf(Simulated(kThreeAndACross,
                           {.roll_rad = injected.roll_rad - corrected.roll_rad,
                            .smile_mps = injected.smile_mps - corrected.smile_mps},
                           3));
  EXPECT_FALSE(again.HasClear());
  EXPECT_LT(again.before_m, 0.5 * found.before_m);
}

// Roll and smile of two opposite lines have the same shape.
TEST(Calibration, RefusesOnTwoLinesWhatTheyCannotTellApart) {
  for (const SonarCalibration& injected :
       {SonarCalibration{}, SonarCalibration{.roll_rad = Deg2Rad(0.3)}}) {
    const CalibrationEstimate found = EstimateOf(Simulated(kTwo, injected, 5));
    for (const CalibrationKey key :
         {CalibrationKey::kRoll, CalibrationKey::kSmile, CalibrationKey::kRollScale})
      EXPECT_FALSE(found.Of(key).is_clear) << int(key);
  }
}

TEST(Calibration, IsNotMadeFromNothing) {
  EXPECT_FALSE(EstimateOf({}).HasClear());
  const CalibrationEstimate one = EstimateOf(Simulated({{{0.0, 0.0}, 0.0}}, {}, 1));
  EXPECT_EQ(one.pairs, 0);
  EXPECT_FALSE(one.HasClear());
  EXPECT_TRUE(CellsOf({}, {kSonar}).cells.empty());
}

TEST(CalibrationCells, AreNotMadeOfUnknownHeadsOrWithoutMotions) {
  SubmapSoundings submap;
  for (const int head : {0, 1})
    submap.pings.push_back({kStart, 0, static_cast<std::uint8_t>(head)});
  submap.motions.resize(2);
  for (int i = 0; i < 2000; ++i)
    submap.soundings.push_back(
        {Eigen::Vector3f(
             0.03f * static_cast<float>(i % 100), 0.15f * static_cast<float>(i / 100), 10.0f),
         static_cast<std::uint32_t>(i % 2),
         0,
         true});
  EXPECT_TRUE(CellsOf(submap, {kSonar}).cells.empty());
  EXPECT_FALSE(CellsOf(submap, {kSonar, kSonar}).cells.empty());
  submap.pings[1].head = 0;
  EXPECT_FALSE(CellsOf(submap, {kSonar}).cells.empty());
  submap.pings[1].head = 2;
  EXPECT_TRUE(CellsOf(submap, {kSonar, kSonar, kSonar}).cells.empty());
  submap.pings[1].head = 0;
  submap.motions.clear();
  EXPECT_TRUE(CellsOf(submap, {kSonar}).cells.empty());
}

}  // namespace
}  // namespace seastitch
