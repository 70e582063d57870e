#include "common/core/sensors.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace seastitch {
namespace {

MbesBeam BeamAfter(float twtt_s, float tx_delay_s, std::uint8_t flags = kBeamValid) {
  MbesBeam beam;
  beam.twtt_s = twtt_s;
  beam.tx_delay_s = tx_delay_s;
  beam.flags = flags;
  return beam;
}

TEST(LastEcho, IsThatOfTheLatestBottomDetection) {
  MbesPing ping;
  ping.time = FromUtime(1'000'000);
  EXPECT_EQ(LastEcho(ping), ping.time);
  ping.beams = {BeamAfter(0.25f, 0.0f), BeamAfter(0.125f, 0.5f), BeamAfter(0.5f, 0.0f)};
  EXPECT_EQ(ToUtime(LastEcho(ping)), 1'625'000);
}

TEST(LastEcho, BelievesNoBeamThatCannotBe) {
  MbesPing ping;
  ping.time = FromUtime(1'000'000);
  constexpr float kHuge = std::numeric_limits<float>::max();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  ping.beams = {BeamAfter(0.25f, 0.0f),
                BeamAfter(1e5f, 0.0f),
                BeamAfter(kHuge, kHuge),
                BeamAfter(kNan, 0.0f),
                BeamAfter(0.1f, -kHuge),
                BeamAfter(5.0f, 0.0f, 0)};  // not valid: no bottom found
  EXPECT_EQ(ToUtime(LastEcho(ping)), 1'250'000);
}

}  // namespace
}  // namespace seastitch
