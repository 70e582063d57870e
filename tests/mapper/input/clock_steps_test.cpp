// Clocks that step while a vehicle surveys: the computer's, and those of single sensors.

#include "tests/mapper/input/stepping_clocks.hpp"

namespace seastitch {
namespace {

TEST_F(SteppingClocks, NothingIsSaidOfClocksThatRun) {
  Drive(60.0);
  ExpectUnbroken();
  EXPECT_FALSE(seen_.contains("clock_step"));
  EXPECT_FALSE(seen_.contains("clock_drift"));
  EXPECT_FALSE(seen_.contains("sensor_silent"));
}

class ComputerSteps : public SteppingClocks, public testing::WithParamInterface<double> {};

TEST_P(ComputerSteps, NavigationGoesOnAndHealthNamesTheStep) {
  Drive(30.0);
  StepComputer(GetParam());
  Drive(30.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  char size[40];
  std::snprintf(size, sizeof size, "the computer's clock by %+.0f.0", GetParam());
  EXPECT_THAT(step_, HasSubstr(std::string(size).substr(0, 24)));
  EXPECT_FALSE(seen_.contains("no_navigation"));
  // The fault ends after a minute.
  Drive(60.0);
  for (const Condition& condition : mapper_->conditions())
    EXPECT_NE(condition.kind, &conditions::kClockStep);
}

// Stamps of sensors with clocks of their own do not change.
TEST_P(ComputerSteps, SensorsWithClocksOfTheirOwnGoOn) {
  Drive(30.0);
  StepComputer(GetParam(), {SensorChannel::kImu, SensorChannel::kMbesPing});
  Drive(30.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  for (const char* name : {"IMU", "DVL", "DEPTH", "MBES_PING"})
    EXPECT_EQ(Counter(std::string("clock_steps_") + name), 0) << name;
}
INSTANTIATE_TEST_SUITE_P(Sizes, ComputerSteps, testing::Values(-600.0, 60.0, -3.0, 3600.0, -1e6));

class SensorSteps
    : public SteppingClocks,
      public testing::WithParamInterface<std::tuple<SensorChannel, double, const char*>> {};

TEST_P(SensorSteps, OneSensorAloneIsNamed) {
  const auto& [channel, by_s, name] = GetParam();
  Drive(30.0);
  clocks_[channel].utime_s += by_s;
  Drive(30.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter(std::string("clock_steps_") + name), 1);
  EXPECT_EQ(Counter("clock_steps_computer"), 0);
  EXPECT_THAT(step_, HasSubstr(std::string("the clock of ") + name));
}
INSTANTIATE_TEST_SUITE_P(Channels,
                         SensorSteps,
                         testing::Values(std::tuple(SensorChannel::kImu, -600.0, "IMU"),
                                         std::tuple(SensorChannel::kImu, 60.0, "IMU"),
                                         std::tuple(SensorChannel::kDvl, -600.0, "DVL"),
                                         std::tuple(SensorChannel::kDvl, 7.0, "DVL"),
                                         std::tuple(SensorChannel::kDepth, -5.0, "DEPTH"),
                                         std::tuple(SensorChannel::kMbesPing, 45.0, "MBES_PING"),
                                         std::tuple(SensorChannel::kMbesPing, -45.0, "MBES_PING")));

// Silence is not a step, with or without messages of other processes.
TEST_F(SteppingClocks, SilenceIsAGapAndNoStep) {
  Drive(30.0);
  for (const SensorChannel channel : kChannels) clocks_[channel].silent = true;
  Drive(60.0);
  EXPECT_TRUE(seen_.contains("no_navigation"));
  EXPECT_TRUE(seen_.contains("sensor_silent"));
  for (const SensorChannel channel : kChannels) clocks_[channel].silent = false;
  Drive(10.0);
  EXPECT_EQ(Counter("nav_imu_gap"), 1);
  EXPECT_FALSE(seen_.contains("clock_step"));
  const Eigen::Vector3d off =
      navs_.back().first.T_map_vehicle.translation() - vehicle_.TrueAt(vehicle_.time).translation();
  EXPECT_LT(std::abs(off.x()), 5.0 + 3.0 * std::sqrt(navs_.back().first.covariance(0, 0)));
}

TEST_F(SteppingClocks, SilenceWithoutAnyHealthIsAGapToo) {
  processes_run_ = false;
  Drive(30.0);
  vehicle_.Sleep(60.0);
  Drive(10.0);
  EXPECT_EQ(Counter("nav_imu_gap"), 1);
  EXPECT_FALSE(seen_.contains("clock_step"));
}

TEST_F(SteppingClocks, SilenceInASimulationThatIsFasterThanTimeIsAGap) {
  pace_ = 20.0;
  Drive(30.0);
  clocks_[SensorChannel::kMbesPing].silent = true;
  clocks_[SensorChannel::kDvl].silent = true;
  Drive(60.0);
  clocks_[SensorChannel::kMbesPing].silent = false;
  clocks_[SensorChannel::kDvl].silent = false;
  Drive(60.0);
  EXPECT_FALSE(seen_.contains("clock_step"));
  EXPECT_FALSE(seen_.contains("clock_drift"));
  ExpectNothingRefused();
}

// One sensor falls silent, the others go on.
TEST_F(SteppingClocks, ASilentSensorIsNamedWithinThreeSeconds) {
  Drive(30.0);
  clocks_[SensorChannel::kImu].silent = true;
  Drive(2.9);
  EXPECT_TRUE(seen_.contains("no_navigation"));
  EXPECT_TRUE(seen_.contains("sensor_silent"));
  clocks_[SensorChannel::kImu].silent = false;
  Drive(5.0);
  for (const Condition& condition : mapper_->conditions()) {
    EXPECT_NE(condition.kind, &conditions::kSensorSilent);
    EXPECT_NE(condition.kind, &conditions::kNoNavigation);
  }
  EXPECT_EQ(Counter("clock_steps_IMU"), 0);
}

// For example two loggers: their uptimes alternate. The profile was sent once.
TEST_F(SteppingClocks, TwoProcessesOfOneNameSilenceNoSensor) {
  SoundVelocityProfile profile;
  profile.time = vehicle_.time;
  profile.depth_m = {0.0, 100.0};
  profile.speed_mps = {1480.0, 1490.0};
  Send(profile);
  for (int i = 0; i < 30; ++i) {
    SendHeartbeat("logger", 100.0 + i);
    Drive(0.5);
    SendHeartbeat("logger", 5.0 + i);
    Drive(0.5);
  }
  EXPECT_FALSE(seen_.contains("sensor_silent"));
  EXPECT_FALSE(seen_.contains("clock_step"));
  ExpectUnbroken();
}

TEST_F(SteppingClocks, ADamagedStampIsNoStep) {
  Drive(30.0);
  Clock& imu = clocks_[SensorChannel::kImu];
  for (const double wild_s : {-1e7, 1e7, -600.0, 600.0}) {
    imu.utime_s = wild_s;
    Drive(PerfectVehicle::kImuStepS);
    imu.utime_s = 0.0;
    Drive(1.0);
    imu.utime_s = imu.recv_s = wild_s;
    Drive(PerfectVehicle::kImuStepS);
    imu.utime_s = imu.recv_s = 0.0;
    Drive(1.0);
  }
  ExpectUnbroken();
  EXPECT_FALSE(seen_.contains("clock_step"));
  EXPECT_EQ(Counter("stamps_damaged"), 8);
}

// Messages lost during the step count as lost, and the step is found nevertheless.
TEST_F(SteppingClocks, AStepAmongLostMessagesIsFound) {
  Drive(30.0);
  StepComputer(-600.0);
  for (const SensorChannel channel : kChannels) clocks_[channel].lose = 3;
  Drive(30.0);
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  EXPECT_NEAR(ToSeconds(navs_.back().second - navs_.back().first.time), 0.5, 0.3);
}

// The driver was restarted while the clock stepped: another sensor determines the step.
TEST_F(SteppingClocks, ADriverThatRestartsMeanwhileFollowsTheOthers) {
  Drive(30.0);
  Clock& dvl = clocks_[SensorChannel::kDvl];
  dvl.silent = true;
  Drive(5.0);
  StepComputer(-600.0);
  Drive(5.0);
  dvl.silent = false;
  dvl.seq = 0;
  Drive(20.0);
  EXPECT_EQ(Counter("nav_dvl_late"), 0);
  EXPECT_EQ(Counter("nav_dvl_ahead"), 0);
  EXPECT_EQ(Counter("clock_steps_computer"), 1);
  for (const Condition& condition : mapper_->conditions())
    EXPECT_NE(condition.kind, &conditions::kNoBottomLock);
}

// Power fails for the inertial unit and its driver; its clock begins ten years back.
TEST_F(SteppingClocks, ASensorThatRestartsWithAnotherClockIsHeld) {
  Drive(90.0);
  for (const SensorChannel channel : {SensorChannel::kImu, SensorChannel::kDvl}) {
    Clock& clock = clocks_[channel];
    clock.silent = true;
    Drive(5.0);
    clock.silent = false;
    clock.seq = 0;
    clock.utime_s = -3.2e8;
    navs_.clear();
    Drive(30.0);
    ASSERT_GT(navs_.size(), 280U);
    EXPECT_NEAR(ToSeconds(navs_.back().second - navs_.back().first.time), 0.5, 0.15);
  }
  EXPECT_EQ(Counter("clock_steps_IMU"), 1);
  EXPECT_EQ(Counter("clock_steps_DVL"), 1);
  EXPECT_EQ(Counter("nav_dvl_late"), 0);
}

TEST_F(SteppingClocks, StepsAddUp) {
  for (const double by_s : {-600.0, 60.0, -5.0, 4000.0, 61.0}) {
    Drive(20.0);
    StepComputer(by_s);
  }
  Drive(20.0);
  ExpectUnbroken();
  ExpectNothingRefused();
  EXPECT_EQ(Counter("clock_steps_computer"), 5);
}

TEST_F(SteppingClocks, AClockThatDriftsAwayIsNamed) {
  Drive(60.0);
  for (int i = 0; i < 300; ++i) {
    clocks_[SensorChannel::kDvl].utime_s -= 0.001;
    Drive(0.2);
  }
  Drive(30.0);
  std::string detail;
  for (const Condition& condition : mapper_->conditions())
    if (condition.kind == &conditions::kClockDrift) detail = condition.detail;
  EXPECT_THAT(detail, HasSubstr("DVL has come to lag by 0.3"));
  EXPECT_THAT(detail, testing::Not(HasSubstr("IMU")));
}

// A ping is stamped at its transmit pulse and received after its last echo: on a descent from 170 m
// to 10 m above the seabed it comes sooner and sooner.
TEST_F(SteppingClocks, ASonarThatComesNearerHasNoDriftingClock) {
  deeper_s_ = 2.0 * 160.0 / PerfectVehicle::kSoundMps;
  Drive(30.0);
  for (; deeper_s_ > 0.0; deeper_s_ -= 0.001) Drive(0.5);
  Drive(30.0);
  EXPECT_FALSE(seen_.contains("clock_drift"));
  for (int i = 0; i < 300; ++i) {
    clocks_[SensorChannel::kMbesPing].utime_s -= 0.001;
    Drive(0.2);
  }
  Drive(30.0);
  EXPECT_TRUE(seen_.contains("clock_drift")) << "the clock of the same sonar";
}

// Without a receive stamp of its own, as from a file.
TEST_F(SteppingClocks, PingsReceivedAtTheirTransmitPulseHaveNoDriftingClock) {
  deeper_s_ = 2.0 * 160.0 / PerfectVehicle::kSoundMps;
  clocks_[SensorChannel::kMbesPing].silent = true;
  std::int64_t seq = 0;
  for (; deeper_s_ > 0.0; deeper_s_ -= 0.002) {
    Drive(0.2);
    MbesPing ping;
    ping.time = vehicle_.time;
    ping.beams.emplace_back();
    ping.beams.back().twtt_s = static_cast<float>(deeper_s_);
    ping.beams.back().flags = kBeamValid;
    mapper_->Add(ping, {ping.time, seq++});
  }
  EXPECT_FALSE(seen_.contains("clock_drift"));
}

// Two heads of one sonar at the same time, 2.5 s between its pings.
TEST_F(SteppingClocks, TwoHeadsOfASlowSonarAreNotSilent) {
  vehicle_.sonar_on = false;
  std::int64_t seq = 0;
  for (int i = 0; i < 40; ++i) {
    Drive(2.5);
    MbesPing ping;
    ping.time = vehicle_.time;
    for (ping.head = 0; ping.head < 2; ++ping.head)
      mapper_->Add(ping, {ping.time + FromSeconds(0.004), seq++});
    if (i == 5) seen_.clear();  // its interval is known
  }
  EXPECT_FALSE(seen_.contains("sensor_silent"));
}

}  // namespace
}  // namespace seastitch
