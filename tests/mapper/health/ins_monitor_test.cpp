// Faults of a given INS that the mapper reports.

#include "mapper/health/ins_monitor.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <optional>
#include <string>

#include "mapper/mapper.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

// An INS at 10 Hz on a vehicle that goes north at 1.5 m/s, and a depth sensor.
class GivenDive : public testing::Test {
 protected:
  GivenDive() : mapper_(Params()) {}

  static MapperParams Params() {
    MapperParams params;
    params.navigation_source = NavigationSource::kGiven;
    return params;
  }

  void Drive(double duration_s) {
    for (int i = 0; i < static_cast<int>(10.0 * duration_s); ++i) {
      time_ += FromSeconds(0.1);
      north_m_ += 0.15;
      if (ins_on_) mapper_.Add(Sample());
      DepthSample depth;
      depth.time = time_;
      depth.depth_m = 5.0;
      if (depth_on_) mapper_.Add(depth);
      MbesPing ping;
      ping.time = time_;
      ping.sound_speed_mps = 1500.0;
      mapper_.Add(ping);
    }
    mapper_.TakeEvents();
  }
  NavigationSample Sample() const {
    NavigationSample sample;
    sample.time = time_;
    sample.status = status_;
    constexpr double kMetresARadian = 6'371'000.0;
    if (position_on_) sample.position = GeoPosition{north_m_ / kMetresARadian, 0.0, {0.1, 0.1}};
    if (attitude_on_) sample.attitude = Attitude{};
    sample.velocity = GeoVelocity{{1.5, 0.0, 0.0}, {0.01, 0.01, 0.01}};
    return sample;
  }
  std::optional<std::string> Holds(const ConditionKind& kind) const {
    for (const Condition& condition : mapper_.conditions())
      if (condition.kind == &kind) return condition.detail;
    return std::nullopt;
  }

  Mapper mapper_;
  Time time_ = FromUtime(1'700'000'000'000'000);
  double north_m_ = 0.0;
  InsStatus status_ = InsStatus::kAided;
  bool ins_on_ = true, position_on_ = true, attitude_on_ = true, depth_on_ = true;
};

TEST_F(GivenDive, NothingIsSaidOfAGoodOne) {
  Drive(30.0);
  EXPECT_FALSE(Holds(conditions::kInsNotUsable));
  EXPECT_FALSE(Holds(conditions::kInsJumps));
  EXPECT_FALSE(Holds(conditions::kNavigationNotStarted));
}

TEST_F(GivenDive, OneThatIsSilentIsMissedWhileTheSonarPings) {
  ins_on_ = false;
  Drive(1.0);
  EXPECT_THAT(Holds(conditions::kInsNotUsable).value_or(""), HasSubstr("no message of it yet"));
  ins_on_ = true;
  Drive(20.0);
  EXPECT_FALSE(Holds(conditions::kInsNotUsable));
  ins_on_ = false;
  Drive(5.0);
  EXPECT_EQ(Holds(conditions::kInsNotUsable), "silent for 5 s");
}

TEST_F(GivenDive, ItsOwnStatusIsBelieved) {
  status_ = InsStatus::kAligning;
  Drive(12.0);
  EXPECT_EQ(Holds(conditions::kInsNotUsable), "it says that it is aligning for 12 s");
  EXPECT_TRUE(Holds(conditions::kNavigationNotStarted));
  status_ = InsStatus::kAided;
  Drive(5.0);
  EXPECT_FALSE(Holds(conditions::kInsNotUsable));
  status_ = InsStatus::kInvalid;
  Drive(3.0);
  EXPECT_THAT(Holds(conditions::kInsNotUsable).value_or(""), HasSubstr("not valid"));
}

TEST_F(GivenDive, WhatItLeavesOutIsNamed) {
  Drive(5.0);
  position_on_ = false;
  Drive(4.0);
  EXPECT_EQ(Holds(conditions::kInsNotUsable), "no position for 4 s");
  position_on_ = true;
  attitude_on_ = false;
  Drive(4.0);
  EXPECT_EQ(Holds(conditions::kInsNotUsable), "no attitude for 4 s");
}

TEST_F(GivenDive, WithoutDepthThereIsNoStart) {
  depth_on_ = false;
  Drive(15.0);
  EXPECT_TRUE(Holds(conditions::kNavigationNotStarted));
  EXPECT_FALSE(Holds(conditions::kInsNotUsable));
}

TEST_F(GivenDive, FixesNowAndThenAreFineAndJumpsAllTheTimeAreNot) {
  Drive(20.0);
  north_m_ += 3.0;
  Drive(20.0);
  EXPECT_FALSE(Holds(conditions::kInsJumps));
  for (int i = 0; i < 8; ++i) {
    north_m_ += i % 2 == 0 ? 3.0 : -3.0;
    Drive(5.0);
  }
  EXPECT_THAT(Holds(conditions::kInsJumps).value_or(""), HasSubstr(" in all"));
  Drive(70.0);
  EXPECT_FALSE(Holds(conditions::kInsJumps));
}

}  // namespace
}  // namespace seastitch
