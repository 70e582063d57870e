#include "codecs/makers/r2sonic.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/mbes/mbes_decoder.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;

void ExpectGolden(const std::string& stem) {
  SCOPED_TRACE(stem);
  const nlohmann::json golden = ReadJson(Shared("vectors/r2sonic/" + stem + ".json"));
  int unusable = -1;
  const auto ping = DecodeBth0(BytesOf(Shared("vectors/r2sonic/" + stem + ".bin")), &unusable);
  ASSERT_TRUE(ping);
  const auto& h0 = golden["H0"];
  EXPECT_EQ(ToUtime(ping->time),
            h0["timeSeconds"].get<std::int64_t>() * 1'000'000 +
                (h0["timeNanoseconds"].get<std::int64_t>() + 500) / 1000);
  EXPECT_EQ(ping->ping_number, h0["pingNumber"]);
  EXPECT_EQ(ping->sound_speed_mps, h0["soundSpeed_mps"]);
  ASSERT_EQ(ping->beams.size(), h0["points"]);
  int shut_out = 0;
  for (std::size_t i = 0; i < ping->beams.size(); ++i) {
    const MbesBeam& beam = ping->beams[i];
    const int quality = golden["Q0"]["flags"][i];
    EXPECT_EQ(beam.twtt_s, golden["R0"]["twtt_s"][i].get<float>());
    EXPECT_NEAR(beam.rx_angle_rad, golden["angle_rad"][i].get<double>(), 2e-7);
    EXPECT_EQ(beam.tx_tilt_rad, h0["txSteeringVert_rad"].get<float>());
    EXPECT_NEAR(beam.backscatter_db,
                20.0 * std::log10(golden["I1"]["intensity_uPa"][i].get<double>()),
                1e-4);
    EXPECT_EQ((beam.flags & kBeamAmplitude) != 0, (quality & 4) != 0);
    EXPECT_EQ((beam.flags & kBeamPhase) != 0, (quality & 8) != 0);
    EXPECT_EQ((beam.flags & kBeamValid) != 0, (quality & 12) != 0 && (quality & 3) == 3);
    shut_out += (beam.flags & kBeamValid) == 0 ? 1 : 0;
  }
  EXPECT_EQ(unusable, 0);
  EXPECT_LT(shut_out, 3);
}

TEST(R2Sonic, GoldenDatagrams) {
  SKIP_WITHOUT(Shared("vectors/r2sonic"));
  for (const char* const stem : {"bth0_a0_odd", "bth0_a2_256", "bth0_unknown_section"})
    ExpectGolden(stem);
}

TEST(R2Sonic, RealDatagramsOfASonic2026) {
  SKIP_WITHOUT(Shared("vectors/r2sonic/real"));
  for (const char* const ping : {"151989", "152389", "152911"})
    ExpectGolden(std::string("real/bth0_2026_ping") + ping);
}

TEST(R2Sonic, EveryTruncationOfAGoldenDatagramIsRefused) {
  SKIP_WITHOUT(Shared("vectors/r2sonic"));
  for (const char* const stem : {"bth0_a0_odd", "bth0_unknown_section"}) {
    const ByteVector whole = BytesOf(Shared(std::string("vectors/r2sonic/") + stem + ".bin"));
    for (std::size_t n = 0; n < whole.size(); ++n) {
      ByteVector cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_FALSE(DecodeBth0(cut)) << n;
      if (n < 12) continue;
      // The same with a size that pretends to be right: a ping without its quality section (the
      // last) has no beam that is called valid.
      cut[6] = static_cast<std::uint8_t>(n >> 8);
      cut[7] = static_cast<std::uint8_t>(n);
      const auto ping = DecodeBth0(cut);
      if (!ping) continue;
      EXPECT_TRUE(AllFinite(*ping));
      EXPECT_TRUE(std::all_of(ping->beams.begin(), ping->beams.end(), [](const MbesBeam& beam) {
        return beam.flags == 0;
      })) << n;
    }
  }
}

TEST(R2Sonic, AnyPingComesBack) {
  EXPECT_TRUE(rc::check([] {
    const MbesPing ping = *AnyFlatPing(300);
    const ByteVector bytes = EncodeBth0(ping);
    const auto decoded = DecodeBth0(bytes);
    RC_ASSERT(decoded.has_value());
    RC_ASSERT(decoded->time == ping.time);
    RC_ASSERT(decoded->ping_number == ping.ping_number);
    RC_ASSERT(decoded->sound_speed_mps == ping.sound_speed_mps);
    RC_ASSERT(decoded->beams.size() == ping.beams.size());
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      const MbesBeam& a = decoded->beams[i];
      const MbesBeam& b = ping.beams[i];
      // Half a step of the longest time: a second over 65535.
      RC_ASSERT(std::abs(a.twtt_s - b.twtt_s) < 8e-6f);
      RC_ASSERT(std::abs(a.rx_angle_rad - b.rx_angle_rad) < 2.4f / 65'000.0f);
      RC_ASSERT(a.tx_tilt_rad == b.tx_tilt_rad);
      RC_ASSERT(a.flags == b.flags);
      RC_ASSERT(std::abs(a.backscatter_db - b.backscatter_db) < 0.01f);
    }
    for (std::size_t n = 0; n < bytes.size(); ++n)
      RC_ASSERT(!DecodeBth0(Bytes(bytes).first(n)).has_value());
  }));
}

TEST(R2Sonic, AnyChangedByteIsReadOrRefusedWithoutHarm) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'250'000);
  ping.sound_speed_mps = 1500.0;
  for (int i = 0; i < 9; ++i)
    ping.beams.push_back({0.05f, -1.0f + 0.2f * static_cast<float>(i), 0, 0, 0, 40, kBeamPhase});
  const ByteVector whole = EncodeBth0(ping);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0x00, 0x7F, 0xFF}) {
      ByteVector changed = whole;
      changed[at] = static_cast<std::uint8_t>(value);
      const auto decoded = DecodeBth0(changed);
      EXPECT_TRUE(!decoded || AllFinite(*decoded)) << at;
    }
  }
}

TEST(R2Sonic, StreamCountsWhatItCannotUse) {
  MbesDecoderParams params;
  params.format = "r2sonic";
  MbesDecoder decoder(params);
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'250'000);
  ping.sound_speed_mps = 1500.0;
  ping.beams.resize(3);
  const ByteVector whole = EncodeBth0(ping);
  EXPECT_EQ(decoder.Add(whole, FromUtime(1)).size(), 1u);
  EXPECT_TRUE(decoder.Add(whole, FromUtime(1)).empty());
  ByteVector truepix = whole;
  std::copy_n("TPX0", 4, truepix.begin());
  EXPECT_TRUE(decoder.Add(truepix, FromUtime(1)).empty());
  EXPECT_TRUE(decoder.Add(Bytes(whole).first(100), FromUtime(1)).empty());
  EXPECT_EQ(
      decoder.counters(),
      (Counters{{"mbes_datagram_repeated", 1}, {"r2sonic_ignored", 1}, {"r2sonic_malformed", 1}}));
}

TEST(R2Sonic, EncodeRefusesWhatTheFormatCannotHold) {
  MbesPing ping;
  ping.beams.resize(1025);
  EXPECT_THROW(EncodeBth0(ping), std::invalid_argument);
  ping.beams.resize(2);
  ping.beams[1].rx_angle_rad = -1.0f;
  EXPECT_THROW(EncodeBth0(ping), std::invalid_argument);
}

}  // namespace
}  // namespace seastitch
