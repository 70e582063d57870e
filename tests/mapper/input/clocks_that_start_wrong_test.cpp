#include "tests/mapper/input/stepping_clocks.hpp"

namespace seastitch {
namespace {

TEST_F(SteppingClocks, AProcessThatFallsSilentIsNamedWithinThreeSeconds) {
  double uptime_s = 0.0;
  const auto run = [&](double duration_s, bool logger_runs) {
    for (double t = 0.0; t < duration_s; t += 1.0) {
      Drive(1.0);
      uptime_s += 1.0;
      if (logger_runs) SendHeartbeat("logger", uptime_s);
      if (logger_runs) SendHeartbeat("planner", uptime_s);  // of others: it may end
    }
  };
  const auto silent = [&] {
    for (const Condition& condition : mapper_->conditions())
      if (condition.kind == &conditions::kProcessSilent) return condition.detail;
    return std::string();
  };
  run(10.0, true);
  EXPECT_FALSE(seen_.contains("process_silent"));
  run(3.0, false);
  EXPECT_EQ(silent(), "logger");
  uptime_s = 0.0;  // started again
  run(1.0, true);
  EXPECT_EQ(silent(), "");
}

// The mapper is restarted while the clock steps.
TEST_F(SteppingClocks, AStepDuringARestartIsFoundAfterIt) {
  Drive(30.0);
  SavedMap saved;
  saved.checkpoint = *mapper_->MakeCheckpoint();
  mapper_ = std::make_unique<Mapper>(MapperParams{});
  navs_.clear();
  for (auto& [channel, clock] : clocks_) clock.seq += 10 * clock.seq / 30;
  vehicle_.Sleep(10.0);
  StepComputer(-600.0);
  ImuSample first;
  first.time = vehicle_.time + FromSeconds(-600.0);
  const Time resumed = mapper_->InDiveTime(*DecodeCheckpoint(Encode(saved.checkpoint)),
                                           first,
                                           {first.time, clocks_[SensorChannel::kImu].seq});
  EXPECT_NEAR(ToSeconds(resumed - saved.checkpoint.time), 10.5, 0.1);
  ASSERT_TRUE(mapper_->Resume(saved, [](SubmapId) { return nullptr; }));
  Drive(30.0);
  ASSERT_FALSE(navs_.empty());
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  EXPECT_NEAR(ToSeconds(navs_.back().second - navs_.back().first.time), 0.5, 0.2);
}

// --- which side of a step is right ---------------------------------------------------------------

// Clocks that are wrong when the dive starts, and are set later. All are right from then on.
struct WrongStart {
  const char* name;
  std::map<SensorChannel, double> ahead_s;
  double computer_s = 0.0;  // of the sensors that the computer stamps, too
  std::set<SensorChannel> own{};
  double for_s = 20.0;
};

std::ostream& operator<<(std::ostream& out, const WrongStart& wrong) { return out << wrong.name; }

class ClocksThatStartWrong : public SteppingClocks,
                             public testing::WithParamInterface<WrongStart> {};

TEST_P(ClocksThatStartWrong, CostTheDiveThatTimeAtMost) {
  const WrongStart& wrong = GetParam();
  for (const auto& [channel, s] : wrong.ahead_s) clocks_[channel].utime_s = s;
  if (wrong.computer_s != 0.0) StepComputer(wrong.computer_s, wrong.own);
  Drive(wrong.for_s);
  for (const auto& [channel, s] : wrong.ahead_s) clocks_[channel].utime_s = 0.0;
  if (wrong.computer_s != 0.0) StepComputer(-wrong.computer_s, wrong.own);
  Drive(5.0);
  EXPECT_TRUE(seen_.contains("clock_step"));
  navs_.clear();
  submaps_ = 0;
  Drive(120.0);
  ASSERT_GT(navs_.size(), 1100U);
  for (const auto& [nav, came] : navs_) {
    ASSERT_NEAR(ToSeconds(came - nav.time), 0.5, 0.15);
    const Eigen::Vector3d moved =
        nav.T_map_vehicle.translation() - navs_.front().first.T_map_vehicle.translation();
    const double way_m = kSpeedMps * ToSeconds(nav.time - navs_.front().first.time);
    ASSERT_NEAR(moved.head<2>().norm(), way_m, 0.3);
  }
  EXPECT_GT(submaps_, 0);
  for (const Condition& condition : mapper_->conditions())
    EXPECT_EQ(condition.kind, &conditions::kNoSoundSpeedProfile) << condition.kind->name;
}
INSTANTIATE_TEST_SUITE_P(
    Clocks,
    ClocksThatStartWrong,
    testing::Values(WrongStart{"ImuTenYearsBehind", {{SensorChannel::kImu, -3.2e8}}},
                    WrongStart{"ImuTenYearsAhead", {{SensorChannel::kImu, 3.2e8}}},
                    WrongStart{"ImuFourSecondsBehind", {{SensorChannel::kImu, -4.0}}},
                    WrongStart{"DvlAndDepthTwoSecondsBehind",
                               {{SensorChannel::kDvl, -2.0}, {SensorChannel::kDepth, -2.0}}},
                    WrongStart{"SonarTwoSecondsAhead", {{SensorChannel::kMbesPing, 2.0}}},
                    WrongStart{"SonarAnHourBehind", {{SensorChannel::kMbesPing, -3600.0}}},
                    WrongStart{"ComputerNotTheImu", {}, -1e8, {SensorChannel::kImu}, 4.0},
                    WrongStart{"ComputerNotTheSonar", {}, -600.0, {SensorChannel::kMbesPing}, 8.0},
                    WrongStart{"ComputerNotDvlAndDepth",
                               {},
                               3600.0,
                               {SensorChannel::kDvl, SensorChannel::kDepth},
                               8.0}),
    [](const auto& param) { return param.param.name; });

// The map is by the inertial unit's time: the other sensors are brought to it.
TEST_F(SteppingClocks, ASonarThatIsSetDuringTheDiveComesBackToTheMap) {
  clocks_[SensorChannel::kDvl].utime_s = -2.0;
  Drive(90.0);
  clocks_[SensorChannel::kDvl].utime_s = 0.0;
  Drive(60.0);
  EXPECT_EQ(Counter("clock_steps_DVL"), 1);
  EXPECT_EQ(Counter("navigation_restarts"), 0);
  const std::int64_t late = Counter("nav_dvl_late");
  Drive(60.0);
  EXPECT_EQ(Counter("nav_dvl_late"), late);
}

// --- who decides ---------------------------------------------------------------------------------

// The receive stamps of fixes are by another clock: such a message says nothing of the computer's.
class FixesByAnotherClock : public SteppingClocks, public testing::WithParamInterface<double> {};

TEST_P(FixesByAnotherClock, AreNoStep) {
  pace_ = GetParam();
  for (const double apart_s : {0.0, 994.0, -600.0, 1e8}) {
    Drive(20.0);
    clocks_[SensorChannel::kPositionFix].recv_s = apart_s;
    for (int i = 0; i < 3; ++i) {
      Send(Fix());
      Drive(1.0);
    }
  }
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 0);
  for (const char* name : {"clock_step", "sensor_silent", "no_navigation"})
    EXPECT_FALSE(seen_.contains(name)) << name;
}
INSTANTIATE_TEST_SUITE_P(Paces, FixesByAnotherClock, testing::Values(1.0, 15.0));

// GPS time in place of UTC; an overflowed week count; an acoustic position on its way; GPS time of
// a receiver that comes right.
TEST_F(SteppingClocks, FixesWithTheTimeOfAnotherClockAreNamedAlone) {
  for (const double ahead_s : {18.0, -1024.0 * 7 * 86'400, -3.0, 18.0, 0.0}) {
    seen_.clear();
    clocks_[SensorChannel::kPositionFix].utime_s = ahead_s;
    Drive(ahead_s == 0.0 ? 5.0 : 1.0);
    for (int i = 0; i < 8; ++i) {
      Send(Fix());
      if (i == 5) seen_.clear();  // those before it may have been of the last clock
      Drive(1.0);
    }
    const bool is_off = std::abs(ahead_s) > 5.0;
    EXPECT_EQ(seen_.contains("fix_clock"), is_off) << ahead_s;
    for (const char* name : {"clock_step", "clock_drift", "sensor_silent"})
      EXPECT_FALSE(seen_.contains(name)) << name << " " << ahead_s;
  }
  clocks_[SensorChannel::kPositionFix].utime_s = 18.0;
  for (int i = 0; i < 5; ++i) Send(Fix());
  Drive(61.0);
  seen_.clear();
  Drive(1.0);
  EXPECT_FALSE(seen_.contains("fix_clock")) << "the last one is long ago";
}

TEST_F(SteppingClocks, AFixAfterARestartIsNoStep) {
  Drive(10.0);
  Send(Fix());
  Drive(20.0);
  SavedMap saved;
  saved.checkpoint = *mapper_->MakeCheckpoint();
  mapper_ = std::make_unique<Mapper>(MapperParams{});
  for (auto& [channel, clock] : clocks_) clock.seq += 5 * clock.seq / 30;
  vehicle_.Sleep(5.0);
  ASSERT_TRUE(mapper_->Resume(saved, [](SubmapId) { return nullptr; }));
  Drive(60.0);
  Send(Fix());
  navs_.clear();
  seen_.clear();
  Drive(30.0);
  EXPECT_EQ(Counter("clock_steps_computer"), 0);
  EXPECT_GT(navs_.size(), 290U);
  EXPECT_FALSE(seen_.contains("no_navigation"));
}

// A program on another computer whose clock is set, or a damaged heartbeat.
TEST_F(SteppingClocks, OneProcessAgainstTheOthersIsNoStep) {
  double foreign_s = 0.0;
  for (int i = 0; i < 60; ++i) {
    Drive(1.0);
    SendHeartbeat("mapper", 10.0 + i);
    if (i == 20) foreign_s = 3600.0;
    mapper_->OnHeartbeat({"nav-driver", vehicle_.time + FromSeconds(foreign_s), 5.0 + i});
    if (i == 40)
      mapper_->OnHeartbeat({"optimizer", vehicle_.time + FromSeconds(500.0), 40.0});
    else
      SendHeartbeat("optimizer", static_cast<double>(i));
  }
  ExpectUnbroken();
  EXPECT_EQ(Counter("clock_steps_computer"), 0);
}

// Messages of one sensor come through a computer of their own.
TEST_F(SteppingClocks, ReceiveStampsOfOneSensorAloneMoveNoOther) {
  Drive(30.0);
  clocks_[SensorChannel::kDvl].recv_s = -600.0;
  Drive(30.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 0);
  EXPECT_EQ(Counter("receive_stamps_stepped_DVL"), 1);
  EXPECT_THAT(step_, HasSubstr("the receive stamps of DVL by -600"));
}

TEST_F(SteppingClocks, WithoutHeartbeatsTwoSensorsAgreeOnAStepBack) {
  processes_run_ = false;
  Drive(30.0);
  StepComputer(-600.0);
  Drive(30.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
}

// A step while every sensor is off: only the heartbeats show it.
TEST_F(SteppingClocks, AStepWhileTheSensorsAreSilent) {
  Drive(30.0);
  for (const SensorChannel channel : kChannels) clocks_[channel].silent = true;
  Drive(10.0);
  StepComputer(-600.0);
  Drive(10.0);
  for (const SensorChannel channel : kChannels) clocks_[channel].silent = false;
  navs_.clear();
  Drive(20.0);
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  EXPECT_EQ(Counter("nav_imu_gap"), 1);
  ASSERT_GT(navs_.size(), 150U);
  EXPECT_NEAR(ToSeconds(navs_.back().second - navs_.back().first.time), 0.5, 0.15);
}

// --- gaps ----------------------------------------------------------------------------------------

class Gaps : public SteppingClocks, public testing::WithParamInterface<double> {};

TEST_P(Gaps, AreBridgedWithoutStatesInBetween) {
  Drive(30.0);
  vehicle_.Sleep(GetParam());
  navs_.clear();
  Drive(10.0);
  EXPECT_LT(navs_.size(), 130U);
  ASSERT_GT(navs_.size(), 50U);
  EXPECT_NEAR(ToSeconds(navs_.back().second - navs_.back().first.time), 0.5, 0.15);
  EXPECT_EQ(Counter("nav_imu_gap"), 1);
  const double sigma_m = std::sqrt(navs_.back().first.covariance(0, 0));
  EXPECT_GT(sigma_m, 0.5);
}
INSTANTIATE_TEST_SUITE_P(Lengths, Gaps, testing::Values(5.0, 3600.0, 864'000.0));

}  // namespace
}  // namespace seastitch
