// Faults of navigation that the mapper reports.

#include "mapper/navigation_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <variant>

#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

constexpr double kSpeedMps = 1.5;

class Dive : public testing::Test {
 protected:
  Dive() : mapper_(MapperParams{}) { vehicle_.sonar_on = false; }

  // Weaves, so that a late attitude has an effect.
  void Drive(double duration_s, double most_yaw_rate_radps = 0.2) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      const double t_s = ToSeconds(vehicle_.time - FromUtime(1'700'000'000'000'000));
      for (const auto& sample : vehicle_.Step(kSpeedMps, most_yaw_rate_radps * std::sin(0.4 * t_s)))
        std::visit([this](const auto& s) { mapper_.Add(s); }, sample);
      for (const Condition& condition : mapper_.conditions()) seen_.insert(condition.kind->name);
    }
    mapper_.TakeEvents();
  }
  // Text of a fault; nothing if it is not present.
  std::optional<std::string> Holds(const ConditionKind& kind) const {
    for (const Condition& condition : mapper_.conditions())
      if (condition.kind == &kind) return condition.detail;
    return std::nullopt;
  }

  PerfectVehicle vehicle_;
  Mapper mapper_;
  std::set<std::string> seen_;  // names of all faults so far
};

TEST_F(Dive, NothingIsSaidOfGoodNavigation) {
  Drive(60.0);
  EXPECT_TRUE(seen_.empty()) << *seen_.begin();
}

TEST_F(Dive, WithoutAttitudeSaysWhyItDoesNotStart) {
  EXPECT_THAT(mapper_.WaitsFor(), HasSubstr("no usable inertial samples"));
  vehicle_.attitude_on = false;
  Drive(5.0);
  EXPECT_THAT(mapper_.WaitsFor(), HasSubstr("enable its attitude output"));
  Drive(10.0);
  const auto why = Holds(conditions::kNavigationNotStarted);
  ASSERT_TRUE(why);
  EXPECT_THAT(*why, HasSubstr("enable its attitude output"));
  vehicle_.attitude_on = true;
  Drive(5.0);
  EXPECT_FALSE(Holds(conditions::kNavigationNotStarted));
}

TEST_F(Dive, RefusedVelocitiesAreNoLossOfBottomLock) {
  Drive(60.0);
  vehicle_.dvl_error_mps = 2.0;
  Drive(20.0);
  const auto refused = Holds(conditions::kDvlRefused);
  ASSERT_TRUE(refused);
  EXPECT_THAT(*refused, HasSubstr("% of the last minute, since 22:14:"));
  EXPECT_FALSE(seen_.contains("no_bottom_lock"));
  vehicle_.dvl_error_mps = 0.0;
  Drive(120.0);
  EXPECT_FALSE(Holds(conditions::kDvlRefused));
  EXPECT_FALSE(seen_.contains("no_bottom_lock"));
}

TEST_F(Dive, LossOfBottomLockIsNoRefusal) {
  Drive(30.0);
  vehicle_.bottom_lock = false;
  Drive(5.0);
  EXPECT_TRUE(Holds(conditions::kNoBottomLock));
  EXPECT_FALSE(seen_.contains("dvl_refused"));
  vehicle_.bottom_lock = true;
  Drive(5.0);
  EXPECT_FALSE(Holds(conditions::kNoBottomLock));
}

TEST_F(Dive, AHeadingThatStepsIsNamed) {
  Drive(60.0);
  vehicle_.compass_step_rad = Deg2Rad(40.0);
  Drive(15.0);
  EXPECT_TRUE(seen_.contains("heading_step")) << testing::PrintToString(seen_);
  EXPECT_FALSE(seen_.contains("no_bottom_lock"));
}

TEST_F(Dive, LateAttitudeIsToldWithWhatToPutIntoTheConfiguration) {
  vehicle_.attitude_late_steps = 15;
  Drive(200.0);
  const auto offset = Holds(conditions::kTimeOffsetSuspected);
  ASSERT_TRUE(offset);
  // 0.3 s, less half a sample: the rates are means over the interval before their stamps.
  EXPECT_THAT(*offset, HasSubstr("set navigation.attitude_time_offset_s to -0.29"));
  EXPECT_THAT(*offset, HasSubstr("1 sigma 0.0"));
}

// Almost straight ahead nothing shows the delay, and the estimate is forgotten.
TEST_F(Dive, ALateAttitudeIsInTheReportAlsoAfterItIsForgotten) {
  EXPECT_TRUE(mapper_.stamp_offsets().empty());
  vehicle_.attitude_late_steps = 15;
  Drive(200.0);
  Drive(3000.0, 1e-4);
  EXPECT_FALSE(Holds(conditions::kTimeOffsetSuspected));
  const std::vector<StampOffsetEstimate> offsets = mapper_.stamp_offsets();
  ASSERT_EQ(offsets.size(), 1u);
  EXPECT_EQ(offsets[0].key, "navigation.attitude_time_offset_s");
  EXPECT_EQ(offsets[0].configured_s, 0.0);
  EXPECT_NEAR(offsets[0].add_s, -0.29, 0.01);
  EXPECT_LT(offsets[0].sigma_s, 0.05);
  EXPECT_GT(offsets[0].suspected_s, 100.0);
  EXPECT_LT(offsets[0].suspected_s, 3000.0);
}

}  // namespace
}  // namespace seastitch
