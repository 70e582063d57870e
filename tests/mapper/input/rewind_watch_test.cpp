// A log that is played again, and what is none.
#include "mapper/input/rewind_watch.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

constexpr double kJumpS = 0.5;

// Sensors at their usual rates.
class Sensors {
 public:
  // From the first time to the second, in dive time [s]; only: those that send.
  void Play(double from_s, double to_s, std::initializer_list<SensorChannel> only) {
    for (int i = 0; from_s + 0.02 * i < to_s; ++i) {
      const Time t = FromUtime(1'763'806'500'000'000) + FromSeconds(from_s + 0.02 * i);
      for (const SensorChannel channel : only) {
        const bool is_imu = channel == SensorChannel::kImu;
        if (!is_imu && i % (channel == SensorChannel::kDvl ? 50 : 10) != 0) continue;
        watch.Add(channel, t);
        if (watch.IsSure() && !sure_after_s) sure_after_s = 0.02 * i;
      }
    }
  }
  RewindWatch watch{kJumpS};
  std::optional<double> sure_after_s;
};

constexpr std::initializer_list<SensorChannel> kAll{
    SensorChannel::kImu, SensorChannel::kDvl, SensorChannel::kMbesPing};

TEST(RewindWatch, ALogThatIsPlayedAgainIsNamedWithinTwoSeconds) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  EXPECT_FALSE(sensors.watch.behind_s());
  sensors.Play(0.0, 0.1, kAll);
  EXPECT_NEAR(sensors.watch.behind_s().value_or(0.0), 60.0, 0.1);
  sensors.Play(0.1, 10.0, kAll);
  ASSERT_TRUE(sensors.sure_after_s);
  EXPECT_LE(*sensors.sure_after_s, 2.0);
  EXPECT_TRUE(sensors.watch.IsSure());
}

TEST(RewindWatch, ALogThatIsSoughtBackAndForthIsNotPlayedAgain) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  sensors.Play(10.0, 10.5, kAll);
  sensors.Play(60.0, 70.0, kAll);
  EXPECT_FALSE(sensors.sure_after_s);
  EXPECT_FALSE(sensors.watch.behind_s());
}

TEST(RewindWatch, OneSensorWithAnEarlierTimeIsNoRewind) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  for (int i = 0; i < 20; ++i) {  // the inertial unit has lost its clock, the others have not
    sensors.Play(i, i + 1.0, {SensorChannel::kImu});
    sensors.Play(60.0 + i, 61.0 + i, {SensorChannel::kDvl, SensorChannel::kMbesPing});
  }
  EXPECT_FALSE(sensors.sure_after_s);
  Sensors others;
  others.Play(0.0, 60.0, kAll);
  for (int i = 0; i < 20; ++i) {
    others.Play(i, i + 1.0, {SensorChannel::kDvl, SensorChannel::kMbesPing});
    others.Play(60.0 + i, 61.0 + i, {SensorChannel::kImu});
  }
  EXPECT_FALSE(others.sure_after_s);
  EXPECT_FALSE(others.watch.behind_s());
}

TEST(RewindWatch, OneStampFarAheadIsNoRewind) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  for (const SensorChannel channel : kAll) sensors.Play(1e6, 1e6 + 0.01, {channel});
  sensors.Play(60.0, 90.0, kAll);
  EXPECT_FALSE(sensors.watch.behind_s());
  EXPECT_FALSE(sensors.sure_after_s);
}

TEST(RewindWatch, ALogThatIsPlayedAgainAfterALongGapIsNamed) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  sensors.Play(1e6, 1e6 + 60.0, kAll);
  sensors.Play(0.0, 10.0, kAll);
  EXPECT_TRUE(sensors.sure_after_s);
}

TEST(RewindWatch, AnInertialUnitAloneIsNoRewind) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, {SensorChannel::kImu});
  sensors.Play(0.0, 30.0, {SensorChannel::kImu});
  EXPECT_FALSE(sensors.sure_after_s);
}

TEST(RewindWatch, ASensorThatIsOffDoesNotHinderIt) {
  Sensors sensors;
  sensors.Play(0.0, 60.0, kAll);
  sensors.Play(0.0, 30.0, {SensorChannel::kImu, SensorChannel::kMbesPing});
  EXPECT_TRUE(sensors.sure_after_s);
}

}  // namespace
}  // namespace seastitch
