#include "common/runtime/health.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "common/core/utf8.hpp"
#include "common/runtime/process/restart_counter.hpp"
#include "tests/runtime/notify_socket.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr ConditionKind kMild{"mild", Severity::kDegraded, "a mild fault", "wait"};
constexpr ConditionKind kAnother{"another", Severity::kDegraded, "another fault", "wait"};
constexpr ConditionKind kBad{"bad", Severity::kLost, "a bad fault", "surface"};

// A clock that the test sets.
class HealthTest : public testing::Test {
 protected:
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    for (const condition_t& condition : health.Snapshot(0, 1.0).conditions)
      names.push_back(condition.name);
    return names;
  }

  double now_s = 100.0;
  Health health{"mapper", [this] { return now_s; }};
};

// Exit status of a process that runs `body`.
int StatusOf(const std::function<int()>& body) {
  const pid_t pid = fork();
  if (pid == 0) _exit(body());
  int status = -1;
  waitpid(pid, &status, 0);
  return WEXITSTATUS(status);
}

// A time namespace has the clocks of a machine that was suspended for 100 s.
TEST(MonotonicSeconds, CountASuspendOfTheMachine) {
  constexpr int kNotAllowed = 2;
  const double before_s = MonotonicSeconds();
  const int status = StatusOf([&] {
    if (unshare(CLONE_NEWTIME) != 0) return kNotAllowed;
    std::ofstream("/proc/self/timens_offsets") << "boottime 100 0\n";
    return StatusOf([&] {
      const double passed_s = MonotonicSeconds() - before_s;
      return passed_s > 100.0 && passed_s < 110.0 ? 0 : 1;
    });
  });
  if (status == kNotAllowed) GTEST_SKIP() << "no time namespace without privileges";
  EXPECT_EQ(status, 0);
}

TEST_F(HealthTest, FeedsTheWatchdogOfALongStep) {
  NotifySocket watchdog;
  health.ReportProgress();
  EXPECT_EQ(watchdog.Feedings(), 1);
}

TEST_F(HealthTest, IsStartingUntilItRunsUnlessAFaultHolds) {
  EXPECT_EQ(health.state(), HealthState::kStarting);
  EXPECT_EQ(health.text(), "starting");
  health.SetStarting("waiting for navigation");
  EXPECT_EQ(health.state(), HealthState::kStarting);
  health.Hold(kBad, "7 times");
  EXPECT_EQ(health.state(), HealthState::kLost);
  EXPECT_EQ(health.text(), "a bad fault: 7 times; waiting for navigation");
  EXPECT_THAT(Names(), ElementsAre("bad"));
  health.SetRunning();
  EXPECT_EQ(health.state(), HealthState::kLost);
  health.Release(kBad);
  EXPECT_EQ(health.state(), HealthState::kOk);
  EXPECT_EQ(health.text(), "ok");
}

TEST_F(HealthTest, StateIsThatOfTheWorstAndTheTextBeginsWithIt) {
  health.SetRunning();
  health.SetText("12 submaps");
  health.Hold(kAnother);
  health.Hold(kMild);
  EXPECT_EQ(health.state(), HealthState::kDegraded);
  health.Hold(kBad);
  EXPECT_EQ(health.state(), HealthState::kLost);
  EXPECT_EQ(health.text(), "a bad fault; another fault; a mild fault; 12 submaps");
  EXPECT_THAT(Names(), ElementsAre("bad", "another", "mild"));
  health.Release(kBad);
  EXPECT_EQ(health.state(), HealthState::kDegraded);
}

TEST_F(HealthTest, WhatTheCoreFindsReplacesWhatItFoundAndLeavesWhatIsHeld) {
  health.SetRunning();
  health.Hold(kMild, "of the node");
  health.SetConditions({{&kMild, "of the core"}, {&kBad, ""}});
  EXPECT_EQ(health.text(), "a bad fault; a mild fault: of the node, of the core");
  health.SetConditions({});
  EXPECT_EQ(health.text(), "a mild fault: of the node");
  health.SetConditions({{&kMild, "of the core"}});
  health.Release(kMild);
  EXPECT_EQ(health.state(), HealthState::kDegraded) << "the core still finds it";
  health.SetConditions({});
  EXPECT_EQ(health.state(), HealthState::kOk);
}

TEST_F(HealthTest, OneKindFoundTwiceIsOneConditionWithBothDetails) {
  health.SetRunning();
  health.SetConditions({{&kMild, "IMU"}, {&kMild, "DVL"}});
  EXPECT_THAT(Names(), ElementsAre("mild"));
  EXPECT_THAT(health.text(), HasSubstr("IMU, DVL"));
  EXPECT_EQ(health.Snapshot(0, 1.0).conditions[0].count, 1);
}

TEST_F(HealthTest, EachConditionHasSinceAndCount) {
  health.SetRunning();
  health.Hold(kMild, "first");
  now_s += 10.0;
  health.Hold(kMild, "again");  // the same occurrence
  const std::int64_t utime = 1'700'000'000'000'000;
  health_t msg = health.Snapshot(utime, 1.0);
  ASSERT_EQ(msg.num_conditions, 1);
  EXPECT_EQ(msg.conditions[0].since_utime, utime - 10'000'000);
  EXPECT_EQ(msg.conditions[0].count, 1);
  EXPECT_EQ(msg.conditions[0].severity, health_t::STATE_DEGRADED);
  EXPECT_EQ(msg.conditions[0].sentence, "a mild fault: again");
  EXPECT_EQ(msg.state_since_utime, utime - 10'000'000);
  health.Release(kMild);
  now_s += 1.0;
  health.Hold(kMild);
  msg = health.Snapshot(utime, 1.0);
  EXPECT_EQ(msg.conditions[0].since_utime, utime);
  EXPECT_EQ(msg.conditions[0].count, 2);
}

// The system's clock is set when the time server is found: "since" must not lie before the dive.
TEST_F(HealthTest, SinceIsRightAfterTheSystemClockWasSet) {
  health.SetRunning();
  health.Hold(kMild);
  now_s += 5.0;
  EXPECT_EQ(health.Snapshot(5'000'000, 1.0).conditions[0].since_utime, 0);
  EXPECT_EQ(health.Snapshot(1'700'000'005'000'000, 1.0).conditions[0].since_utime,
            1'700'000'000'000'000);
}

TEST_F(HealthTest, ReportsCountersRatesVersionAndUptime) {
  health.Count("bad", 2);
  health.Count("bad");
  health.Set("queue_depth", 9);
  for (int i = 0; i < 20; ++i) health.Tick("imu");
  now_s += 7.5;
  const health_t first = health.Snapshot(123, 2.0);
  EXPECT_EQ(first.utime, 123);
  EXPECT_EQ(first.process, "mapper");
  EXPECT_FALSE(first.version.empty());
  EXPECT_EQ(first.uptime_s, 7.5);
  EXPECT_EQ(first.restarts, 0);
  ASSERT_EQ(first.num_counters, 2);
  EXPECT_EQ(first.counters[0].name, "bad");
  EXPECT_EQ(first.counters[0].value, 3);
  ASSERT_EQ(first.num_rates, 1);
  EXPECT_EQ(first.rate_hz[0], 10.0);
  const health_t second = health.Snapshot(124, 1.0);
  EXPECT_EQ(second.seq, 1);
  ASSERT_EQ(second.num_rates, 1) << "a stream that stopped stays in the list";
  EXPECT_EQ(second.rate_hz[0], 0.0);
  EXPECT_EQ(health.counter("bad"), 3);
  EXPECT_EQ(health.counter("never"), 0);
}

TEST_F(HealthTest, IsOneLineOfBoundedLengthWhateverTheDetail) {
  health.SetRunning();
  std::string endless = "a\nb\tc";
  while (endless.size() < 100'000) endless += "ü";
  health.Hold(kMild, endless);
  health.SetText(endless);
  const health_t msg = health.Snapshot(0, 1.0);
  EXPECT_EQ(msg.text.find('\n'), std::string::npos);
  EXPECT_THAT(msg.text, HasSubstr("a b c"));
  EXPECT_LT(msg.text.size(), 2'100u);
  EXPECT_LT(msg.conditions[0].sentence.size(), 400u);
  EXPECT_LT(msg.getEncodedSize(), 60'000);
}

TEST(WholeCharacters, CutsBetweenCharacters) {
  EXPECT_EQ(WholeCharacters("abc", 5), 3u);
  EXPECT_EQ(WholeCharacters("abc", 2), 2u);
  EXPECT_EQ(WholeCharacters("a\xC3\xBC", 2), 1u);
  EXPECT_EQ(WholeCharacters("\xF0\x9F\x90\x9F.", 3), 3u) << "no shorter cut would help";
  EXPECT_EQ(WholeCharacters("\xF0\x9F\x90\x9F.", 4), 4u);
  EXPECT_EQ(WholeCharacters("\x80\x80\x80\x80\x80\x80", 5), 5u) << "no UTF-8 at all";
}

TEST(RestartCounter, CountsTheStartsBeforeThisOne) {
  const TemporaryDir dir;
  for (const int restarts : {0, 1, 2}) EXPECT_EQ(CountRestart(dir.path()), restarts);
  dir.Write("starts", "garbage");
  EXPECT_EQ(CountRestart(dir.path()), 0);
  EXPECT_EQ(CountRestart(dir.path()), 1);
  dir.Write("starts", "-4");
  EXPECT_EQ(CountRestart(dir.path()), 0);
  EXPECT_EQ(CountRestart(dir / "absent"), 0);
  EXPECT_EQ(CountRestart(dir / "absent"), 0);
}

}  // namespace
}  // namespace seastitch
