// Clocks that step while a vehicle surveys: the computer's, and those of single sensors.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

// A vehicle whose messages are stamped by clocks that may be wrong.
class SteppingClocks : public testing::Test {
 protected:
  static constexpr double kSpeedMps = 1.5;
  struct Clock {
    double utime_s = 0.0;  // ahead of the truth
    double recv_s = 0.0;
    bool silent = false;
    int lose = 0;  // number of next messages to lose
    std::int64_t seq = 0;
  };

  SteppingClocks() : mapper_(std::make_unique<Mapper>(MapperParams{})) {}

  void Drive(double duration_s) {
    for (int i = 0; i < static_cast<int>(std::lround(duration_s / PerfectVehicle::kImuStepS));
         ++i) {
      for (const auto& sample : vehicle_.Step(kSpeedMps, 0.0))
        std::visit([this](const auto& s) { Send(s); }, sample);
      if (++steps_ % 50 == 0 && processes_run_) SendHeartbeat("dvl-driver", Elapsed() / pace_);
      Look();
    }
  }
  template <class Sample>
  void Send(Sample sample) {
    Clock& clock = clocks_[ChannelOf(sample)];
    if (clock.silent) return;
    if (clock.lose > 0) {
      --clock.lose;
      ++clock.seq;
      return;
    }
    Time received = ReceivedAt(sample.time) + FromSeconds(0.004 + clock.recv_s);
    sample.time += FromSeconds(clock.utime_s);
    if constexpr (std::is_same_v<Sample, MbesPing>) {
      for (MbesBeam& beam : sample.beams) beam.twtt_s += static_cast<float>(deeper_s_);
      if (deeper_s_ > 0.0) received += LastEcho(sample) - sample.time;
    }
    mapper_->Add(sample, {received, clock.seq++});
  }
  // Steps the computer's clock, which stamps all sensors except those of `own`.
  void StepComputer(double by_s, std::set<SensorChannel> own = {}) {
    computer_s_ += by_s;
    for (const SensorChannel channel : kChannels) {
      clocks_[channel].recv_s += by_s;
      if (!own.contains(channel)) clocks_[channel].utime_s += by_s;
    }
  }
  void SendHeartbeat(const std::string& process, double uptime_s) {
    mapper_->OnHeartbeat({process, ReceivedAt(vehicle_.time) + FromSeconds(computer_s_), uptime_s});
  }
  // Receive time in a simulation faster than real time.
  Time ReceivedAt(Time t) const { return kStart + FromSeconds(ToSeconds(t - kStart) / pace_); }
  double Elapsed() const { return ToSeconds(vehicle_.time - kStart); }
  void Look() {
    for (const MapperEvent& event : mapper_->TakeEvents()) {
      if (const auto* nav = std::get_if<NavState>(&event)) navs_.push_back({*nav, vehicle_.time});
      submaps_ += std::holds_alternative<std::shared_ptr<const Submap>>(event) ? 1 : 0;
    }
    for (const Condition& condition : mapper_->conditions()) {
      seen_.insert(condition.kind->name);
      if (condition.kind == &conditions::kClockStep) step_ = condition.detail;
    }
  }
  PositionFix Fix() const {
    const Eigen::Vector3d p = vehicle_.TrueAt(vehicle_.time).translation();
    PositionFix fix;
    fix.time = vehicle_.time;
    fix.latitude_rad = p.x() / 6335439.3;
    fix.longitude_rad = p.y() / 6378137.0;
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    fix.source = "gps";
    return fix;
  }
  // As without a step: NAV ten times a second, every state at the true position.
  void ExpectUnbroken() {
    ASSERT_GT(navs_.size(), 2U);
    for (std::size_t i = 0; i < navs_.size(); ++i) {
      const auto& [nav, came] = navs_[i];
      const double lag_s = ToSeconds(came - nav.time);
      EXPECT_NEAR(lag_s, 0.5, 0.15) << i;  // reorder_window_s
      const Eigen::Vector3d truth = vehicle_.TrueAt(came).translation();
      EXPECT_NEAR(
          nav.T_map_vehicle.translation().x() - (truth.x() - kSpeedMps * 0.5), start_m_, 0.3)
          << i;
      if (i == 0) continue;
      EXPECT_NEAR(ToSeconds(nav.time - navs_[i - 1].first.time), 0.1, 0.021) << i;
    }
  }
  std::int64_t Counter(const std::string& name) const {
    const auto counters = mapper_->counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }
  void ExpectNothingRefused() {
    for (const auto& [name, count] : mapper_->counters()) {
      const bool refused = name.ends_with("_late") || name.ends_with("_ahead") ||
                           name == "nav_imu_gap" || name == "pings_from_the_future";
      EXPECT_TRUE(!refused || count == 0) << name << " " << count;
    }
  }

  static constexpr Time kStart = FromUtime(1'700'000'000'000'000);
  static constexpr std::array kChannels{
      SensorChannel::kImu, SensorChannel::kDvl, SensorChannel::kDepth, SensorChannel::kMbesPing};
  PerfectVehicle vehicle_;
  std::unique_ptr<Mapper> mapper_;
  std::map<SensorChannel, Clock> clocks_;
  std::vector<std::pair<NavState, Time>> navs_;
  std::set<std::string> seen_;
  std::string step_;
  bool processes_run_ = true;
  double computer_s_ = 0.0;  // the computer's clock, ahead of the truth
  double pace_ = 1.0;
  double deeper_s_ = 0.0;  // two-way travel time that all beams have in addition
  int steps_ = 0;
  int submaps_ = 0;
  double start_m_ = 0.0;
};

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
std::ostream& operator<<(std::ostream& out, const struct WrongStart& wrong);
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
