#include "mapper/input/sound_speed.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

SoundVelocityProfile Constant(double time_s, double speed_mps) {
  return {FromUtime(0) + FromSeconds(time_s), {0.0, 100.0}, {speed_mps, speed_mps}};
}

MbesPing PingAt(double time_s, double speed_mps) {
  MbesPing ping;
  ping.time = FromUtime(0) + FromSeconds(time_s);
  ping.sound_speed_mps = speed_mps;
  return ping;
}

TEST(SoundSpeed, TakesTheProfileNearestInTime) {
  SoundSpeed sound_speed(Constant(0.0, 1450.0));
  ASSERT_TRUE(sound_speed.Add(Constant(100.0, 1500.0)));
  ASSERT_TRUE(sound_speed.Add(Constant(200.0, 1510.0)));
  EXPECT_EQ(sound_speed.For(PingAt(120.0, 1490.0)).rays->SpeedAt(10.0), 1500.0);
  EXPECT_EQ(sound_speed.For(PingAt(180.0, 1490.0)).rays->SpeedAt(10.0), 1510.0);
  EXPECT_EQ(sound_speed.For(PingAt(0.0, 1490.0)).source, SoundSpeed::Source::kProfile);
}

TEST(SoundSpeed, AProfileHoldsFromWhenItWasSaidWhateverItsAge) {
  SoundSpeed sound_speed(std::nullopt);
  sound_speed.Add(Constant(100.0, 1500.0));
  sound_speed.Add(Constant(160.0, 1510.0), FromUtime(0) + FromSeconds(200.0));
  EXPECT_EQ(sound_speed.For(PingAt(199.9, 1490.0)).rays->SpeedAt(10.0), 1500.0);
  EXPECT_EQ(sound_speed.For(PingAt(200.0, 1490.0)).rays->SpeedAt(10.0), 1510.0);
}

// Rather a profile than none.
TEST(SoundSpeed, AMessageOfAnotherClockHoldsAtOnce) {
  SoundSpeed sound_speed(std::nullopt);
  sound_speed.Add(Constant(100.0, 1500.0), FromUtime(0) + FromSeconds(1e9));
  EXPECT_EQ(sound_speed.For(PingAt(100.0, 1490.0)).source, SoundSpeed::Source::kProfile);
}

TEST(SoundSpeed, FallsBackStepByStep) {
  SoundSpeed configured(Constant(0.0, 1450.0));
  EXPECT_EQ(configured.For(PingAt(5.0, 1490.0)).source, SoundSpeed::Source::kConfigured);
  SoundSpeed nothing(std::nullopt);
  EXPECT_EQ(nothing.For(PingAt(5.0, 1477.0)).rays->SpeedAt(10.0), 1477.0);
  EXPECT_EQ(nothing.For(PingAt(5.0, 1478.0)).rays->SpeedAt(10.0), 1478.0);
  EXPECT_EQ(nothing.For(PingAt(5.0, 0.0)).source, SoundSpeed::Source::kAssumed);
}

TEST(SoundSpeed, RefusesWhatIsNoSeaWater) {
  SoundSpeed sound_speed(std::nullopt);
  EXPECT_FALSE(sound_speed.Add(Constant(0.0, 340.0)));
  EXPECT_FALSE(sound_speed.Add({}));
  EXPECT_EQ(sound_speed.For(PingAt(0.0, 1480.0)).source, SoundSpeed::Source::kTransducer);
}

TEST(SoundSpeed, KeepsABoundedNumberOfProfiles) {
  SoundSpeed sound_speed(std::nullopt);
  for (int i = 0; i < 1000; ++i) sound_speed.Add(Constant(i, 1400.0 + 0.1 * i));
  EXPECT_NEAR(sound_speed.For(PingAt(0.0, 1480.0)).rays->SpeedAt(0.0), 1493.6, 1e-9);
}

}  // namespace
}  // namespace seastitch
