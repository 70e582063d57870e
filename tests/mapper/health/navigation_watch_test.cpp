// Faults of navigation that the mapper reports.

#include "mapper/health/navigation_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
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
  explicit Dive(const MapperParams& params = {}) : mapper_(params) { vehicle_.sonar_on = false; }

  // Weaves, so that a late attitude has an effect.
  void Drive(double duration_s, double most_yaw_rate_radps = 0.2) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      const double t_s = ToSeconds(vehicle_.time - FromUtime(1'700'000'000'000'000));
      for (const auto& sample :
           vehicle_.Step(kSpeedMps, most_yaw_rate_radps * std::sin(0.4 * t_s))) {
        const double late_s = std::holds_alternative<DvlSample>(sample) ? dvl_late_s_ : 0.0;
        std::visit([&](const auto& s) { waiting_.emplace(s.time + FromSeconds(late_s), s); },
                   sample);
      }
      if (fix_every_s_ > 0.0 && std::fmod(t_s, fix_every_s_) < PerfectVehicle::kImuStepS)
        waiting_.emplace(vehicle_.time + FromSeconds(2.0), Fix());
      for (; !waiting_.empty() && waiting_.begin()->first <= vehicle_.time;
           waiting_.erase(waiting_.begin()))
        std::visit([this](const auto& s) { mapper_.Add(s); }, waiting_.begin()->second);
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

  PositionFix Fix() const { return vehicle_.Fix("usbl"); }
  std::int64_t Counter(const std::string& name) const {
    const auto counters = mapper_.counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }

  using Sample = std::variant<ImuSample, DvlSample, DepthSample, MbesPing, PositionFix>;
  std::multimap<Time, Sample> waiting_;  // by arrival
  double dvl_late_s_ = 0.0;
  double fix_every_s_ = 0.0;  // they arrive 2 s late; 0: none
  PerfectVehicle vehicle_;
  Mapper mapper_;
  std::set<std::string> seen_;  // names of all faults so far
};

struct WaitingDive : Dive {
  WaitingDive()
      : Dive([] {
          MapperParams params;
          params.navigation.start_at_first_fix = true;
          return params;
        }()) {}
};

// Its attitude is taken to be measured 0.2 s before it was.
struct WronglyConfiguredDive : Dive {
  WronglyConfiguredDive()
      : Dive([] {
          MapperParams params;
          params.navigation.attitude_time_offset_s = -0.2;
          return params;
        }()) {}
};

struct FusingDive : Dive {
  FusingDive()
      : Dive([] {
          MapperParams params;
          params.navigation.fuse_position_fixes = true;
          params.navigation.fix_interval_s = 0.0;
          return params;
        }()) {}
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

TEST_F(WaitingDive, AnAttitudeThatEndsBeforeTheStartIsTheReasonWhyItDoesNotStart) {
  Drive(3.0);
  vehicle_.attitude_on = false;
  Drive(20.0);
  EXPECT_THAT(mapper_.WaitsFor(), HasSubstr("enable its attitude output"));
  const auto why = Holds(conditions::kNavigationNotStarted);
  ASSERT_TRUE(why);
  EXPECT_THAT(*why, HasSubstr("enable its attitude output"));
}

TEST_F(Dive, AnAttitudeThatEndsIsNamed) {
  Drive(20.0);
  EXPECT_FALSE(Holds(conditions::kAttitudeSilent));
  vehicle_.attitude_on = false;
  Drive(5.0);
  EXPECT_EQ(Holds(conditions::kAttitudeSilent), "since 22:13:40 UTC");
  vehicle_.attitude_on = true;
  Drive(1.0);
  EXPECT_FALSE(Holds(conditions::kAttitudeSilent));
}

TEST_F(Dive, FixesThatComeLateAndAreUsedAreNoLoss) {
  fix_every_s_ = 2.0;
  Drive(60.0);
  EXPECT_GT(Counter("nav_fix_late_taken"), 20);
  EXPECT_FALSE(seen_.contains("samples_late"));
}

TEST_F(Dive, SamplesThatComeTooLateAreNamed) {
  Drive(20.0);
  dvl_late_s_ = 2.0;
  Drive(20.0);
  const auto late = Holds(conditions::kSamplesLate);
  ASSERT_TRUE(late);
  EXPECT_THAT(*late, HasSubstr("dvl "));
}

TEST_F(Dive, StuckGyrosAreNamedAndNotTheAttitudeThatIsFollowed) {
  Drive(60.0);
  vehicle_.gyros_stuck = true;
  Drive(30.0);
  EXPECT_TRUE(Holds(conditions::kGyroDoubted));
  EXPECT_FALSE(seen_.contains("attitude_refused"));
  vehicle_.gyros_stuck = false;
  Drive(30.0);
  EXPECT_FALSE(Holds(conditions::kGyroDoubted));
}

TEST_F(Dive, WrongAccelerometersAreNamedAndNotTheDopplerLogThatIsFollowed) {
  Drive(60.0);
  vehicle_.accelerometer_error_mps2 = 2.0;
  Drive(100.0);
  EXPECT_TRUE(Holds(conditions::kAccelerometerDoubted));
  EXPECT_FALSE(Holds(conditions::kDvlRefused));
  vehicle_.accelerometer_error_mps2 = 0.0;
  Drive(60.0);
  EXPECT_FALSE(Holds(conditions::kAccelerometerDoubted));
}

TEST_F(Dive, AFrozenAttitudeIsNamed) {
  Drive(60.0);
  vehicle_.attitude_frozen = true;
  Drive(10.0);
  EXPECT_TRUE(Holds(conditions::kAttitudeFrozen));
  vehicle_.attitude_frozen = false;
  Drive(5.0);
  EXPECT_FALSE(Holds(conditions::kAttitudeFrozen));
}

// Every other ensemble: their beams do not see the same bottom.
TEST_F(Dive, EnsemblesOfBeamsThatDisagreeCountAsRefused) {
  Drive(60.0);
  for (int i = 0; i < 100; ++i) {
    vehicle_.dvl_error_velocity_mps = i % 2 == 0 ? -0.31 : 0.29;
    Drive(0.2);
  }
  EXPECT_EQ(Counter("nav_dvl_error_velocity"), 50);
  const auto refused = Holds(conditions::kDvlRefused);
  ASSERT_TRUE(refused);
  EXPECT_THAT(*refused, HasSubstr("% of the last minute, since 22:14:"));
  EXPECT_FALSE(seen_.contains("no_bottom_lock"));
}

TEST_F(Dive, EnsemblesFasterThanTheVehicleCountAsRefused) {
  Drive(60.0);
  vehicle_.dvl_error_mps = 15.0;
  Drive(20.0);
  EXPECT_GT(Counter("nav_dvl_too_fast"), 90);
  const auto refused = Holds(conditions::kDvlRefused);
  ASSERT_TRUE(refused);
  EXPECT_THAT(*refused, HasSubstr("% of the last minute, since 22:14:"));
}

TEST_F(FusingDive, RefusalsOfLongAgoAreNotOfTheLastMinute) {
  Drive(20.0);
  for (int i = 0; i < 2; ++i) {
    PositionFix wild = Fix();
    wild.latitude_rad += 1e-4;
    mapper_.Add(wild);
    Drive(1.0);
  }
  EXPECT_TRUE(Holds(conditions::kFixesRefused));
  Drive(70.0);
  EXPECT_FALSE(Holds(conditions::kFixesRefused));
}

TEST_F(WaitingDive, AFixThatComesLateBeforeTheStartIsItsPlace) {
  fix_every_s_ = 2.0;
  Drive(20.0);
  EXPECT_EQ(mapper_.WaitsFor(), "waiting for navigation: ");
  EXPECT_FALSE(seen_.contains("place_unknown"));
}

TEST_F(WronglyConfiguredDive, EarlyStampsAreNotSaidToBeCorrected) {
  Drive(200.0);
  const auto offset = Holds(conditions::kTimeOffsetSuspected);
  ASSERT_TRUE(offset);
  EXPECT_THAT(*offset, HasSubstr("set navigation.attitude_time_offset_s to 0.01"));
  EXPECT_THAT(*offset, HasSubstr("early stamps are not corrected meanwhile"));
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

// --- an inertial unit that is too slow -----------------------------------------------------------

// Keeps one sample of `of` for so many; the others are lost.
class SlowImu : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(SlowImu, IsNamedAndNoOtherSensorIs) {
  const auto [keep, of] = GetParam();
  PerfectVehicle vehicle;
  vehicle.sonar_on = false;
  Mapper mapper(MapperParams{});
  std::set<std::string> seen;
  int number = 0;
  for (int i = 0; i < 60 * 50; ++i) {
    for (const auto& sample : vehicle.Step(kSpeedMps, 0.0)) {
      if (std::holds_alternative<ImuSample>(sample) && number++ % of >= keep) continue;
      std::visit([&](const auto& s) { mapper.Add(s); }, sample);
    }
    for (const Condition& condition : mapper.conditions()) seen.insert(condition.kind->name);
  }
  EXPECT_TRUE(seen.contains("imu_too_slow"));
  for (const std::string& name : seen)
    EXPECT_TRUE(name == "imu_too_slow" || name == "navigation_not_started") << name;
  // With all samples it ends.
  for (int i = 0; i < 25 * 50; ++i)
    for (const auto& sample : vehicle.Step(kSpeedMps, 0.0))
      std::visit([&](const auto& s) { mapper.Add(s); }, sample);
  for (const Condition& condition : mapper.conditions())
    EXPECT_NE(condition.kind, &conditions::kImuTooSlow);
}
// 1 Hz, 4 Hz; holes of 0.26 s after 0.34 s of data.
INSTANTIATE_TEST_SUITE_P(Rates,
                         SlowImu,
                         testing::Values(std::pair(1, 50), std::pair(1, 12), std::pair(17, 30)));

}  // namespace
}  // namespace seastitch
