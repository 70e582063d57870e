#include "common/core/health/fault_events.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

constexpr ConditionKind kOne{"one", Severity::kDegraded, "one", "None.", {10.0}};
constexpr ConditionKind kMany{"many", Severity::kDegraded, "many", "None.", {10.0, 3, 30.0}};

TEST(FaultEvents, HoldForTheTimeOfTheirKindAfterTheLast) {
  FaultEvents<double> events(kOne);
  EXPECT_FALSE(events.Holds(0.0)) << "there was none";
  EXPECT_FALSE(events.last());
  events.Add(100.0);
  EXPECT_TRUE(events.Holds(109.9));
  EXPECT_FALSE(events.Holds(110.0));
  events.Add(120.0);
  EXPECT_TRUE(events.Holds(129.0));
  EXPECT_EQ(events.total(), 2);
  EXPECT_EQ(events.last(), 120.0);
}

TEST(FaultEvents, FollowACounterThatMayBeginAgain) {
  FaultEvents<double> events(kOne);
  events.Follow(7, 0.0);
  EXPECT_TRUE(events.Holds(1.0));
  events.Follow(7, 50.0);
  EXPECT_FALSE(events.Holds(50.0)) << "nothing new";
  events.Follow(0, 60.0);
  EXPECT_FALSE(events.Holds(60.0)) << "the counter began again";
  events.Follow(1, 70.0);
  EXPECT_TRUE(events.Holds(70.0));
  events.Follow(std::int64_t{1} << 60, 71.0);
  EXPECT_EQ(events.total(), std::int64_t{1} << 60) << "as many as a damaged counter says";
}

TEST(FaultEvents, EndWhereTheClockGoesBack) {
  FaultEvents<double> events(kOne);
  events.Add(3600.0);
  EXPECT_TRUE(events.Holds(3595.0)) << "a little: messages come in any order";
  EXPECT_FALSE(events.Holds(0.0));
  events.Add(5.0);
  EXPECT_TRUE(events.Holds(6.0));
}

TEST(FaultEvents, AreAFaultOnceSoManyLieWithinTheTimeOfTheirKind) {
  FaultEvents<Time> events(kMany);
  const auto at = [](double t_s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(t_s); };
  events.Add(at(0.0));
  events.Add(at(20.0));
  EXPECT_FALSE(events.Holds(at(20.0)));
  events.Add(at(40.0));
  EXPECT_FALSE(events.Holds(at(40.0))) << "the first of three is too long ago";
  events.Add(at(45.0));
  EXPECT_TRUE(events.Holds(at(45.0)));
  EXPECT_FALSE(events.Holds(at(50.0))) << "30 s after the first of the last three";
  events.Follow(events.total() + 5, at(100.0));
  EXPECT_TRUE(events.Holds(at(109.0)));
  EXPECT_FALSE(events.Holds(at(110.0))) << "10 s after the last";
}

}  // namespace
}  // namespace seastitch
