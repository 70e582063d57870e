#include "page/process_roll.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace seastitch {
namespace {

health_t Health(const std::string& process, std::int64_t seq) {
  health_t health{};
  health.process = process;
  health.seq = seq;
  return health;
}

TEST(ProcessRoll, NamesWhoWasNeverHeardAndWhoIsNotExpected) {
  ProcessRoll roll;
  roll.Add(Health("planner", 3), 1.0);
  EXPECT_THAT(
      roll.names(),
      testing::ElementsAre(
          "imu-driver", "dvl-driver", "mbes-driver", "mapper", "optimizer", "logger", "planner"));
  EXPECT_EQ(roll.Find("mapper"), nullptr);
  EXPECT_TRUE(std::isinf(roll.SilentFor("mapper", 2.0)));
  EXPECT_EQ(roll.SilentFor("planner", 3.5), 2.5);
}

TEST(ProcessRoll, TwoThatSpeakByTurnsAreTwo) {
  // The second's numbers are far, equal, or just ahead.
  for (const std::int64_t second : {1000, 5, 7, 0}) {
    ProcessRoll roll;
    for (int i = 0; i < 4; ++i) {
      roll.Add(Health("mapper", 5 + i), i);
      roll.Add(Health("mapper", second + i), i + 0.5);
    }
    EXPECT_TRUE(roll.IsTwice("mapper", 4.0)) << second;
    EXPECT_FALSE(roll.IsTwice("mapper", 9.0)) << "one that ended is not there any more";
    EXPECT_FALSE(roll.IsTwice("logger", 4.0));
  }
}

TEST(ProcessRoll, ARestartAndALostMessageAreNoSecondProcess) {
  ProcessRoll roll;
  double now_s = 0.0;
  const auto add = [&](std::int64_t seq) {
    roll.Add(Health("mapper", seq), now_s += 1.0);
    EXPECT_FALSE(roll.IsTwice("mapper", now_s)) << seq;
  };
  for (const std::int64_t seq : {70, 71, 74, 75}) add(seq);
  for (int restart = 0; restart < 5; ++restart)  // it crashes again and again
    for (const std::int64_t seq : {0, 1}) add(seq);
}

}  // namespace
}  // namespace seastitch
