#include "products/truth.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

constexpr const char* kHead = "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg\n";

std::string ErrorOf(const std::string& text) {
  const TemporaryDir folder;
  std::ofstream(folder / "truth.csv") << text;
  try {
    ReadTruth(folder / "truth.csv");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "no error";
}

TEST(Truth, IsReadInMetresAndRadians) {
  const TemporaryDir folder;
  std::ofstream(folder / "truth.csv") << kHead << "100,1.5,-2,30,1,2,90\n200,2,3,30,1,2,-90\r\n";
  const std::vector<TruthState> truth = ReadTruth(folder / "truth.csv");
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(ToUtime(truth[0].time), 100);
  EXPECT_EQ(truth[0].T_map_level.y, -2.0);
  EXPECT_DOUBLE_EQ(truth[1].T_map_level.yaw, -0.5 * kPi);
}

TEST(Truth, NamesTheFirstWrongLine) {
  EXPECT_THAT(ErrorOf("t,x\n"), HasSubstr("truth.csv:1: expected the header line"));
  EXPECT_THAT(ErrorOf(std::string(kHead) + "1,2,3,4,5,6\n"), HasSubstr("truth.csv:2: expected"));
  EXPECT_THAT(ErrorOf(std::string(kHead) + "1,2,3,4,5,6,7,8\n"), HasSubstr(":2: expected"));
  EXPECT_THAT(ErrorOf(std::string(kHead) + "1,2,3,4,5,6,7\n2,nan,3,4,5,6,7\n"), HasSubstr(":3:"));
  EXPECT_THAT(ErrorOf(std::string(kHead) + "1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n"),
              EndsWith(":3: time does not rise"));
  EXPECT_THAT(ErrorOf(kHead), EndsWith("holds no state"));
  EXPECT_THROW(ReadTruth("/no/such/truth.csv"), std::runtime_error);
}

CorrectedState StateOf(double s, const Pose2& dead_reckoned, const Pose2& corrected) {
  CorrectedState state;
  state.time = FromUtime(0) + FromSeconds(s);
  state.p_dead_reckoned = {dead_reckoned.x, dead_reckoned.y, 10.0};
  state.rpy_dead_reckoned_rad = {0, 0, dead_reckoned.yaw};
  state.corrected = corrected;
  return state;
}

TEST(Truth, IsComparedAsDeliveredAndForTheShapeAlone) {
  // The delivered track has the true shape, turned by 90 degrees and shifted; dead reckoning runs
  // 1 % long.
  const Pose2 T_truth_map{100, 50, 0.5 * kPi};
  std::vector<CorrectedState> track;
  std::vector<TruthState> truth;
  for (int i = 0; i <= 100; ++i) {
    const double s = 0.1 * i;
    const Pose2 p{s, 0.1 * s * s, 0.01 * s};
    track.push_back(StateOf(s, {1.01 * p.x, 1.01 * p.y, p.yaw}, Inverse(T_truth_map) * p));
    truth.push_back({FromUtime(0) + FromSeconds(s), p});
  }
  const auto result = CompareWithTruth(track, truth);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->before.states, 101u);
  EXPECT_NEAR(result->before.position_max_m, 0.01 * std::hypot(10.0, 10.0), 1e-9);
  EXPECT_NEAR(result->before.position_end_m, result->before.position_max_m, 1e-9);
  EXPECT_NEAR(result->before.yaw_rms_deg, 0.0, 1e-9);
  EXPECT_NEAR(result->after.yaw_rms_deg, 90.0, 1e-9);
  EXPECT_NEAR(result->after.yaw_mean_deg, -90.0, 1e-9);
  EXPECT_GT(result->after.position_rms_m, 50.0);
  EXPECT_NEAR(result->after_aligned.position_max_m, 0.0, 1e-9);
  EXPECT_NEAR(result->after_aligned.yaw_rms_deg, 0.0, 1e-9);
  // What is left of a wrong scale is 1 % of the scatter about the mean.
  EXPECT_NEAR(result->before_aligned.position_rms_m, 0.01 * std::hypot(2.9155, 3.0129), 1e-3);
}

TEST(Truth, IsNotInterpolatedOverGaps) {
  std::vector<CorrectedState> track;
  for (int i = 0; i <= 40; ++i) track.push_back(StateOf(0.1 * i, {}, {}));
  const std::vector<TruthState> truth = {
      {FromUtime(0), {}}, {FromUtime(1'000'000), {}}, {FromUtime(3'500'000), {}}};
  const auto result = CompareWithTruth(track, truth);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->before.states, 12u);  // 0.0 to 1.0 s, and 3.5 s itself
}

TEST(Truth, OfAnotherTimeGivesNoComparison) {
  const std::vector<CorrectedState> track = {StateOf(0, {}, {}), StateOf(1, {}, {})};
  const std::vector<TruthState> truth = {{FromUtime(90'000'000), {}}, {FromUtime(91'000'000), {}}};
  EXPECT_FALSE(CompareWithTruth(track, truth));
}

}  // namespace
}  // namespace seastitch
