#include "products/report/advice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A survey of one dive with one closure; its graph found the sonar further forward and turned.
struct AdviceCase {
  AdviceCase() {
    for (const int id : {0, 1}) {
      SurveySubmap submap;
      submap.id = SubmapId{id};
      survey.submaps.push_back(submap);
    }
    GraphEdge closure;
    closure.kind = EdgeKind::kLoopClosure;
    closure.from = SubmapId{0};
    closure.to = SubmapId{1};
    survey.edges = {closure};
    MountingErrors& errors = survey.solution.mounting[0];
    errors.sonar_m = {0.25, 0.03};
    errors.dvl_yaw_rad = Deg2Rad(0.5);
    errors.covariance.diagonal() << 0.0004, 0.0004, 1e-7;  // 2 cm, 2 cm, 0.018 degrees
    summary.outcome = Outcome::kCorrected;
    VehicleGeometry vehicle;
    vehicle.T_vehicle_mbes =
        MakePose({0.45, 0.0, 0.2}, RotationFromRpy(0.0, 0.0, Deg2Rad(180.0 - 1e-9)));
    options.vehicles = {vehicle};
    options.dives.emplace_back();
  }
  std::vector<std::string> Keys() const {
    std::vector<std::string> keys;
    for (const Advice& advice : AdviceOf(survey, summary, options)) keys.push_back(advice.key);
    return keys;
  }
  Survey survey;
  ProductSummary summary;
  ProductOptions options;
};

TEST(AdviceOf, CorrectsTheVehicleFileByWhatTheGraphFound) {
  const AdviceCase c;
  const std::vector<Advice> advice = AdviceOf(c.survey, c.summary, c.options);
  ASSERT_EQ(advice.size(), 2u);
  EXPECT_EQ(advice[0].file, "vehicle.yaml");
  EXPECT_EQ(advice[0].key, "mbes.position_m");
  EXPECT_EQ(advice[0].now, "[0.45, 0, 0.2]");
  EXPECT_EQ(advice[0].suggested, "[0.7, 0, 0.2]") << "3 cm to starboard are within 4 sigma";
  EXPECT_EQ(advice[1].key, "mbes.roll_pitch_yaw_deg");
  EXPECT_EQ(advice[1].suggested, "[0, 0, 179.5]");
}

TEST(AdviceOf, OfADopplerLogThatIsTurnedTellsOfThatAlone) {
  AdviceCase c;
  c.options.dives[0].dvl_turned_rad = Deg2Rad(-9.8);
  const std::vector<Advice> advice = AdviceOf(c.survey, c.summary, c.options);
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_EQ(advice[0].key, "dvl.roll_pitch_yaw_deg");
  EXPECT_EQ(advice[0].now, "[0, 0, 0]");
  EXPECT_EQ(advice[0].suggested, "[0, 0, -9.8]");
}

TEST(AdviceOf, NeedsAClosureAndAMapThatIsCorrected) {
  AdviceCase withheld;
  withheld.summary.outcome = Outcome::kWithheld;
  EXPECT_THAT(withheld.Keys(), IsEmpty());
  AdviceCase alone;
  alone.survey.edges.clear();
  EXPECT_THAT(alone.Keys(), IsEmpty());
  AdviceCase unknown;
  unknown.options.vehicles.clear();
  EXPECT_THAT(unknown.Keys(), IsEmpty());
}

TEST(AdviceOf, CorrectsStampsBeyondFourSigmaAndWithinTheKeysRange) {
  AdviceCase c;
  c.survey.edges.clear();
  DiveReport& dive = c.options.dives.front();
  dive.sonar.configured_s = 0.010;
  dive.sonar.roll = TimeOffsetEstimate{0.012, 0.001, 900};
  dive.stamp_offsets = {{"navigation.dvl_time_offset_s", 0.0, -0.2, 0.004, 60.0},
                        {"navigation.attitude_time_offset_s", 0.0, 0.01, 0.004, 60.0},
                        {"navigation.attitude_time_offset_s", 0.9, 0.3, 0.004, 60.0}};
  EXPECT_THAT(c.Keys(), ElementsAre("sonar_time_offset_s", "navigation.dvl_time_offset_s"));
  EXPECT_EQ(AdviceOf(c.survey, c.summary, c.options)[0].suggested, "0.022");
  EXPECT_EQ(AdviceOf(c.survey, c.summary, c.options)[1].suggested, "-0.200");
  dive.sonar.placed_by_source = true;
  EXPECT_THAT(c.Keys(), ElementsAre("navigation.dvl_time_offset_s"));
  dive.sonar.placed_by_source = false;
  c.options.warnings = {{WarningCode::kSensorClock, "positions 18 s ahead"}};
  EXPECT_THAT(c.Keys(), ElementsAre("navigation.dvl_time_offset_s")) << "its clock is the cause";
}

TEST(AdviceOf, NamesTheDiveOfSeveral) {
  AdviceCase c;
  c.survey.edges.clear();
  c.options.dives.emplace_back();
  c.options.vehicles.emplace_back();
  c.summary.dives.resize(2);
  c.summary.dives[0].name = "north";
  c.summary.dives[1].name = "south";
  c.options.dives[1].sonar.roll = TimeOffsetEstimate{0.02, 0.001, 900};
  const std::vector<Advice> advice = AdviceOf(c.survey, c.summary, c.options);
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_EQ(advice[0].file, "mapper.yaml of south");
}

}  // namespace
}  // namespace seastitch
