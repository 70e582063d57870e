#include "products/track/truth.hpp"

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

// As navigated the position steps by half a metre once; the delivered track creeps by a centimetre
// a second.
TEST(Truth, AStepOfTheTrackIsAChangeOfItsErrorWithinASecond) {
  std::vector<CorrectedState> track;
  std::vector<TruthState> truth;
  for (int i = 0; i <= 1000; ++i) {
    const double s = 0.1 * i;
    const Pose2 p{1.5 * s, 0.0, 0.0};
    track.push_back(StateOf(s, {p.x, i < 500 ? 0.0 : 0.5, 0.0}, {p.x, 0.01 * s, 0.0}));
    truth.push_back({FromUtime(0) + FromSeconds(s), p});
  }
  const auto result = CompareWithTruth(track, truth);
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->before.position_change_m, 0.5, 1e-9);
  EXPECT_NEAR(result->after.position_change_m, 0.01, 1e-4);
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

// Frames a second apart at the true poses, and what the solution makes of the closures.
struct SolvedClosures {
  Survey survey;
  std::vector<TruthState> truth;

  explicit SolvedClosures(const std::vector<Pose2>& true_frames) {
    for (std::size_t i = 0; i < true_frames.size(); ++i) {
      SurveySubmap& submap = survey.submaps.emplace_back();
      submap.id.value = static_cast<int>(i);
      submap.frame_time = FromUtime(0) + FromSeconds(static_cast<double>(i));
      truth.push_back({submap.frame_time, true_frames[i]});
    }
  }
  GraphEdge& Add(int from, int to, const Eigen::Matrix3d& information, double weight) {
    GraphEdge edge;
    edge.kind = EdgeKind::kLoopClosure;
    edge.from.value = from;
    edge.to.value = to;
    edge.information = information;
    const auto at = [this](int id) { return truth.at(static_cast<std::size_t>(id)).T_map_level; };
    edge.T_from_to = Inverse(at(from)) * at(to);
    survey.solution.loop_edges.push_back({edge.from, edge.to, weight});
    return survey.edges.emplace_back(edge);
  }
};

TEST(Truth, JudgesTheClosuresThatAreBelieved) {
  SolvedClosures solved({{0, 0, 0.0}, {10, 0, 1.5}, {10, 20, 3.0}});
  const Eigen::Matrix3d known = Eigen::Vector3d(100.0, 400.0, 1e4).asDiagonal();
  GraphEdge& off = solved.Add(0, 2, known, 1.0);
  off.T_from_to.x += 0.2;  // 2 sigma
  off.T_from_to.yaw += 0.01 - 2.0 * kPi;
  // Known across alone, and wrong along.
  const Eigen::Matrix3d across = Eigen::Vector3d(0.0, 25.0, 0.0).asDiagonal();
  GraphEdge& ridge = solved.Add(1, 2, across, 0.9);
  ridge.T_from_to.x += 5.0;
  ridge.T_from_to.y -= 0.6;  // 3 sigma
  solved.Add(0, 1, known, 0.0).T_from_to.x += 50.0;
  solved.Add(0, 1, known, 1.0);
  solved.survey.edges.back().to.value = 7;  // not there
  solved.survey.solution.loop_edges.back().to.value = 7;
  const auto errors = CompareClosuresWithTruth(solved.survey, solved.truth);
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->closures, 2u);
  EXPECT_EQ(errors->degrees_of_freedom, 4u);
  EXPECT_NEAR(errors->chi2, 4.0 + 1.0 + 9.0, 1e-9);
  EXPECT_NEAR(errors->worst_chi2, 9.0, 1e-9);
}

TEST(Truth, LeavesErrorsOfMountingThatWereFoundOutOfTheClosures) {
  SolvedClosures solved({{0, 0, 0.0}, {10, 4, kPi}});
  const Eigen::Matrix3d known = Eigen::Vector3d(100.0, 400.0, 1e4).asDiagonal();
  // Lines of opposite heading; the sonar stands 0.3 m further back than it was told.
  solved.Add(0, 1, known, 1.0).T_from_to.x += 0.6;
  EXPECT_NEAR(CompareClosuresWithTruth(solved.survey, solved.truth)->chi2, 36.0, 1e-9);
  solved.survey.solution.mounting[0].sonar_m = {-0.3, 0.0};
  EXPECT_NEAR(CompareClosuresWithTruth(solved.survey, solved.truth)->chi2, 0.0, 1e-9);
}

TEST(Truth, LeavesTheErrorsOfEachDiveOutOfAClosureBetweenTwo) {
  SolvedClosures solved({{0, 0, 0.0}, {10, 4, 0.0}});
  const Eigen::Matrix3d known = Eigen::Vector3d(100.0, 400.0, 1e4).asDiagonal();
  solved.survey.submaps[1].chain = 1;
  // Lines of one heading; the sonar of the second dive stands 0.3 m further back than it was told.
  solved.Add(0, 1, known, 1.0).T_from_to.x -= 0.3;
  EXPECT_NEAR(CompareClosuresWithTruth(solved.survey, solved.truth)->chi2, 9.0, 1e-9);
  solved.survey.solution.mounting[1].sonar_m = {-0.3, 0.0};
  EXPECT_NEAR(CompareClosuresWithTruth(solved.survey, solved.truth)->chi2, 0.0, 1e-9);
}

TEST(Truth, SaysNothingOfClosuresThatItDoesNotCover) {
  SolvedClosures solved({{0, 0, 0}, {10, 0, 0}});
  solved.Add(0, 1, Eigen::Matrix3d::Identity(), 1.0);
  solved.truth.pop_back();
  EXPECT_FALSE(CompareClosuresWithTruth(solved.survey, solved.truth));
}

}  // namespace
}  // namespace seastitch
