#include "codecs/makers/wbms.hpp"

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

MbesPing Ping(int i) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'250'000 + 50'000 * i);
  ping.ping_number = static_cast<std::uint32_t>(i);
  ping.sound_speed_mps = 1500.0;
  for (int b = 0; b < 9; ++b)
    ping.beams.push_back({0.05f, -1.0f + 0.2f * static_cast<float>(b), 0, 0, 0, 40, kBeamPhase});
  return ping;
}

// The sum as the maker's document has it, bit by bit.
std::uint32_t SumOf(Bytes bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes)
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = ((crc ^ (byte >> bit)) & 1) != 0;
      crc = (crc >> 1) ^ (carry ? 0xEDB88320u : 0u);
    }
  return ~crc;
}

void PutLe(std::uint32_t value, std::size_t at, ByteVector* packet) {
  for (std::size_t i = 0; i < 4; ++i)
    (*packet)[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

// Makes a changed packet whole again.
ByteVector Sealed(ByteVector packet) {
  PutLe(static_cast<std::uint32_t>(packet.size()), 8, &packet);
  PutLe(SumOf(Bytes(packet).subspan(24)), 20, &packet);
  return packet;
}

std::vector<MbesPing> PingsOf(const std::vector<MbesOutput>& outputs) {
  std::vector<MbesPing> pings;
  for (const MbesOutput& output : outputs) pings.push_back(std::get<MbesPing>(output));
  return pings;
}

class Wbms : public testing::Test {
 protected:
  static MbesDecoderParams Params() {
    MbesDecoderParams params;
    params.format = "wbms";
    return params;
  }
  std::vector<MbesPing> Feed(const ByteVector& bytes, std::size_t piece) {
    std::vector<MbesPing> pings;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      for (MbesPing& ping : PingsOf(decoder.Add(
               Bytes(bytes).subspan(at, std::min(piece, bytes.size() - at)), FromUtime(1))))
        pings.push_back(std::move(ping));
    return pings;
  }
  MbesDecoder decoder{Params()};
};

TEST(WbmsCodec, GoldenPacketsOfEveryVersion) {
  SKIP_WITHOUT(Shared("vectors/wbms"));
  for (const char* const version : {"4", "5", "7"}) {
    SCOPED_TRACE(version);
    const std::string stem = Shared("vectors/wbms") / (std::string("wbms_bathy_v") + version);
    const nlohmann::json golden = ReadJson(stem + ".json");
    const ByteVector packet = BytesOf(stem + ".bin");
    EXPECT_EQ(SizeOfWbms(packet), packet.size());
    int unusable = -1;
    const auto ping = DecodeWbms(packet, &unusable);
    ASSERT_TRUE(ping);
    EXPECT_EQ(unusable, 0);
    const auto& header = golden["subheader"];
    EXPECT_EQ(ToUtime(ping->time), std::llround(header["time_s"].get<double>() * 1e6));
    EXPECT_EQ(ping->ping_number, header["pingNumber"]);
    EXPECT_EQ(ping->sound_speed_mps, header["sndVelocity_mps"]);
    ASSERT_EQ(ping->beams.size(), header["N"]);
    const float tilt_rad = header["txAngle_rad"];
    for (std::size_t i = 0; i < ping->beams.size(); ++i) {
      SCOPED_TRACE(i);
      const MbesBeam& beam = ping->beams[i];
      const auto& point = golden["points"][i];
      EXPECT_NEAR(0.5 * beam.twtt_s * ping->sound_speed_mps, point["range_m"].get<double>(), 3e-6);
      EXPECT_EQ(beam.tx_tilt_rad, tilt_rad);
      EXPECT_NEAR(std::sin(beam.rx_angle_rad),
                  std::sin(point["angle_rad"].get<double>()) * std::cos(tilt_rad),
                  1e-7);
      EXPECT_NEAR(beam.backscatter_db, 20.0 * std::log10(point["intensity"].get<double>()), 1e-5);
      const int flags = point["flags"], tests = point["qualityFlags"];
      EXPECT_EQ((beam.flags & kBeamAmplitude) != 0, (flags & 1) != 0);
      EXPECT_EQ((beam.flags & kBeamPhase) != 0, (flags & 2) != 0);
      EXPECT_EQ((beam.flags & kBeamValid) != 0, (flags & 3) != 0 && (tests & 3) == 3);
    }
  }
}

TEST(WbmsCodec, EveryTruncationWaitsAndEveryChangedByteIsRefused) {
  const ByteVector whole = EncodeWbms(Ping(7));
  EXPECT_EQ(SumOf(Bytes(whole).subspan(24)),
            ByteReader(Bytes(whole).subspan(20)).Le<std::uint32_t>());
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_EQ(SizeOfWbms(Bytes(whole).first(n)), 0u) << n;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    ByteVector changed = whole;
    changed[at] ^= 0x55;
    const bool of_the_sum = at < 4 || (at >= 8 && at < 12) || at >= 20;
    if (of_the_sum) {
      EXPECT_NE(SizeOfWbms(changed), whole.size()) << at;
    }
  }
}

TEST(WbmsCodec, WholePacketsThatMakeNoSenseDoNoHarm) {
  const ByteVector whole = EncodeWbms(Ping(7));
  for (std::size_t n = 24; n < whole.size(); ++n)
    EXPECT_FALSE(
        DecodeWbms(Sealed({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)})))
        << n;
  for (std::size_t at = 12; at < whole.size(); ++at)
    for (const int value : {0x00, 0x7F, 0xFF}) {
      ByteVector changed = whole;
      changed[at] = static_cast<std::uint8_t>(value);
      const auto ping = DecodeWbms(Sealed(changed));
      EXPECT_TRUE(!ping || AllFinite(*ping)) << at;
    }
}

TEST(WbmsCodec, AnyPingComesBack) {
  EXPECT_TRUE(rc::check([] {
    const MbesPing ping = *AnyFlatPing(300);
    const ByteVector bytes = EncodeWbms(ping);
    RC_ASSERT(SizeOfWbms(bytes) == bytes.size());
    const auto decoded = DecodeWbms(bytes);
    RC_ASSERT(decoded.has_value());
    RC_ASSERT(decoded->time == ping.time);
    RC_ASSERT(decoded->ping_number == ping.ping_number);
    RC_ASSERT(decoded->sound_speed_mps == ping.sound_speed_mps);
    RC_ASSERT(decoded->beams.size() == ping.beams.size());
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      const MbesBeam& a = decoded->beams[i];
      const MbesBeam& b = ping.beams[i];
      RC_ASSERT(std::abs(a.twtt_s - b.twtt_s) < 2e-7f);
      RC_ASSERT(std::abs(a.rx_angle_rad - b.rx_angle_rad) < 1e-6f);
      RC_ASSERT(a.tx_tilt_rad == b.tx_tilt_rad);
      RC_ASSERT(a.flags == b.flags);
      RC_ASSERT(std::abs(a.backscatter_db - b.backscatter_db) < 0.001f);
    }
  }));
}

TEST(WbmsCodec, EncodeRefusesWhatTheFormatCannotHold) {
  MbesPing ping;
  ping.beams.resize(1025);
  EXPECT_THROW(EncodeWbms(ping), std::invalid_argument);
}

TEST_F(Wbms, PiecesOfAnySizeGiveEveryPing) {
  ByteVector stream;
  for (int i = 0; i < 5; ++i) {
    const ByteVector packet = EncodeWbms(Ping(i));
    stream.insert(stream.end(), packet.begin(), packet.end());
  }
  for (const std::size_t piece :
       {std::size_t{1}, std::size_t{7}, std::size_t{1460}, stream.size()}) {
    const auto pings = Feed(stream, piece);
    ASSERT_EQ(pings.size(), 5u) << piece;
    for (int i = 0; i < 5; ++i) EXPECT_EQ(pings[static_cast<std::size_t>(i)].time, Ping(i).time);
  }
  EXPECT_EQ(decoder.counters(), Counters{}) << "equal pieces are no doubled datagrams";
}

// Whatever lies between them, whole packets come out and the other bytes are counted.
TEST_F(Wbms, GarbageAndPacketsThatWereCutCostNothingElse) {
  EXPECT_TRUE(rc::check([] {
    MbesDecoder fresh(Params());
    ByteVector stream;
    std::int64_t skipped = 0;
    for (int i = 0; i < 6; ++i) {
      ByteVector junk = *rc::gen::container<ByteVector>(rc::gen::arbitrary<std::uint8_t>());
      if (*rc::gen::arbitrary<bool>()) {  // a connection that was lost in the middle
        const ByteVector cut = EncodeWbms(Ping(100));
        const auto n =
            *rc::gen::inRange<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(cut.size()));
        junk.insert(junk.end(), cut.begin(), cut.begin() + n);
      }
      skipped += static_cast<std::int64_t>(junk.size());
      const ByteVector packet = EncodeWbms(Ping(i));
      stream.insert(stream.end(), junk.begin(), junk.end());
      stream.insert(stream.end(), packet.begin(), packet.end());
    }
    const ByteVector last = EncodeWbms(Ping(6));
    stream.insert(stream.end(), last.begin(), last.end());
    std::vector<std::uint32_t> numbers;
    const auto piece = *rc::gen::inRange<std::size_t>(1, 400);
    for (std::size_t at = 0; at < stream.size(); at += piece)
      for (const MbesPing& ping : PingsOf(fresh.Add(
               Bytes(stream).subspan(at, std::min(piece, stream.size() - at)), FromUtime(1))))
        numbers.push_back(ping.ping_number);
    RC_ASSERT(numbers == (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6}));
    RC_ASSERT(Count(fresh.counters(), "wbms_skipped_bytes") == skipped);
  }));
}

TEST_F(Wbms, OtherPacketsAreCountedByKind) {
  const ByteVector bathymetry = EncodeWbms(Ping(1));
  ByteVector water_column = bathymetry, scaled = bathymetry, empty = bathymetry, many = bathymetry;
  PutLe(2, 4, &water_column);
  PutLe(104, 12, &scaled);
  PutLe(0, 24, &empty);  // sound speed
  PutLe(1025, 32, &many);
  for (const ByteVector& packet : {water_column, scaled, empty, many})
    EXPECT_TRUE(Feed(Sealed(packet), 100).empty());
  ByteVector far = bathymetry;
  PutLe(0x7F800000, 136, &far);  // the first sample is infinite
  const auto pings = Feed(Sealed(far), 100);
  ASSERT_EQ(pings.size(), 1u);
  EXPECT_EQ(pings[0].beams[0].twtt_s, 0.0f);
  EXPECT_GT(pings[0].beams[1].twtt_s, 0.0f);
  EXPECT_EQ(decoder.counters(),
            (Counters{{"wbms_ignored", 1},
                      {"wbms_malformed", 2},
                      {"wbms_version_unknown", 1},
                      {"mbes_beam_unusable", 1}}));
}

// A header that promises much more than comes holds back at most one packet's worth.
TEST_F(Wbms, ASizeThatNeverComesIsGivenUp) {
  ByteVector promise = EncodeWbms(Ping(1));
  PutLe(65'536, 8, &promise);
  EXPECT_TRUE(Feed(promise, promise.size()).empty());
  std::size_t given = 0;
  for (int i = 0; i < 200; ++i) given += Feed(EncodeWbms(Ping(i)), 1000).size();
  EXPECT_EQ(given, 200u);
  PutLe(65'537, 8, &promise);
  EXPECT_FALSE(SizeOfWbms(promise));
}

}  // namespace
}  // namespace seastitch
