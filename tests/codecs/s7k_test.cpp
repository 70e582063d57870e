#include "codecs/makers/s7k.hpp"

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

ByteVector Vector(const std::string& stem) {
  return BytesOf(Shared("vectors/s7k/" + stem + ".bin"));
}

MbesDecoder Decoder() {
  MbesDecoderParams params;
  params.format = "s7k";
  return MbesDecoder(params);
}

std::vector<MbesPing> AddAll(MbesDecoder* decoder,
                             const std::vector<ByteVector>& packets,
                             Time recv = FromUtime(1'000'000)) {
  std::vector<MbesPing> pings;
  for (const ByteVector& packet : packets)
    for (MbesOutput& output : decoder->Add(packet, recv))
      pings.push_back(std::get<MbesPing>(std::move(output)));
  return pings;
}

void ExpectGolden(const nlohmann::json& golden, const MbesPing& ping) {
  EXPECT_EQ(ToUtime(ping.time), 1'700'000'000'250'000);  // day 318 of 2023, 22:13:20.25
  EXPECT_EQ(ping.ping_number, golden["RTH"]["pingNumber"]);
  EXPECT_EQ(ping.sound_speed_mps, 1500.0);
  ASSERT_EQ(ping.beams.size(), golden["RD"].size());
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    const auto& detection = golden["RD"][i];
    const MbesBeam& beam = ping.beams[i];
    const int flags = detection["flags"];
    EXPECT_NEAR(beam.twtt_s * 1500.0 / 2.0, detection["range_m(c=1500)"].get<double>(), 1e-5);
    EXPECT_EQ(beam.rx_angle_rad, detection["rxAngle_rad"].get<float>());
    EXPECT_EQ(beam.tx_tilt_rad, golden["RTH"]["txAngle_rad"].get<float>());
    EXPECT_EQ((beam.flags & kBeamAmplitude) != 0, (flags & 1) != 0);
    EXPECT_EQ((beam.flags & kBeamPhase) != 0, (flags & 2) != 0);
    EXPECT_EQ((beam.flags & kBeamValid) != 0, detection["quality"] == 3);
    EXPECT_EQ(beam.depth_sigma_ratio, 0.0f);  // no method of estimating it is named
    if (detection.contains("signalStrength")) {
      EXPECT_NEAR(
          beam.backscatter_db, 20.0 * std::log10(detection["signalStrength"].get<double>()), 1e-4);
    }
  }
}

TEST(S7k, GoldenPingsInBothOrdersOfTheirRecords) {
  SKIP_WITHOUT(Shared("vectors/s7k"));
  for (const char* const stem : {"s7k_7027_dfs22", "s7k_7027_dfs34"}) {
    SCOPED_TRACE(stem);
    for (const bool settings_first : {true, false}) {
      std::vector<ByteVector> packets{Vector("s7k_7000"), Vector(stem)};
      if (!settings_first) std::swap(packets[0], packets[1]);
      MbesDecoder decoder = Decoder();
      const std::vector<MbesPing> pings = AddAll(&decoder, packets);
      ASSERT_EQ(pings.size(), 1u);
      ExpectGolden(ReadJson(Shared(std::string("vectors/s7k/") + stem + ".json")), pings[0]);
      EXPECT_TRUE(decoder.counters().empty());
    }
  }
}

TEST(S7k, GoldenRecordInTwoPackets) {
  SKIP_WITHOUT(Shared("vectors/s7k"));
  const ByteVector one = Vector("s7k_7027_dfs34_packet1of2");
  const ByteVector two = Vector("s7k_7027_dfs34_packet2of2");
  for (const auto& packets : {std::vector<ByteVector>{one, two}, {two, one, one}}) {
    MbesDecoder decoder = Decoder();
    AddAll(&decoder, {Vector("s7k_7000")});
    const std::vector<MbesPing> pings = AddAll(&decoder, packets);
    ASSERT_EQ(pings.size(), 1u);
    ExpectGolden(ReadJson(Shared("vectors/s7k/s7k_7027_dfs34.json")), pings[0]);
  }
}

TEST(S7k, EitherSumIsAccepted) {
  SKIP_WITHOUT(Shared("vectors/s7k"));
  const ByteVector packet = Vector("s7k_7000");
  ByteVector record(packet.begin() + 36, packet.end());
  EXPECT_TRUE(ReadS7kRecord(record));
  record[70] ^= 1;  // a changed byte of the data
  EXPECT_FALSE(ReadS7kRecord(record));
  std::uint32_t sum_of_data = 0;
  for (std::size_t i = 64; i < record.size() - 4; ++i) sum_of_data += record[i];
  for (std::size_t i = 0; i < 4; ++i)
    record[record.size() - 4 + i] = static_cast<std::uint8_t>(sum_of_data >> (8 * i));
  EXPECT_TRUE(ReadS7kRecord(record));
}

TEST(S7k, EveryTruncationOfAGoldenRecordIsRefused) {
  SKIP_WITHOUT(Shared("vectors/s7k"));
  for (const char* const stem : {"s7k_7000", "s7k_7027_dfs34"}) {
    const ByteVector packet = Vector(stem);
    for (std::size_t n = 0; n < packet.size(); ++n) {
      ByteVector cut(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_FALSE(ReadS7kRecord(Bytes(cut).subspan(std::min<std::size_t>(n, 36)))) << n;
      MbesDecoder decoder = Decoder();
      EXPECT_TRUE(AddAll(&decoder, {cut}).empty());
      EXPECT_EQ(Count(decoder.counters(), "s7k_malformed"), 1) << n;
      if (n <= 100) continue;
      // The same with sizes that pretend to be right, and without a checksum.
      cut[36 + 8] = static_cast<std::uint8_t>(n - 36);
      cut[36 + 9] = static_cast<std::uint8_t>((n - 36) >> 8);
      cut[36 + 48] = 0;
      const auto record = ReadS7kRecord(Bytes(cut).subspan(36));
      if (!record) continue;
      EXPECT_FALSE(DecodeS7k7027(*record)) << n;
      // The sound speed of the settings ends 10 bytes before their checksum's end.
      EXPECT_EQ(DecodeS7k7000(*record).has_value(), record->type == 7000 && n + 6 >= packet.size())
          << n;
    }
  }
}

TEST(S7k, AnyPingComesBackThroughPacketsOfAnySize) {
  EXPECT_TRUE(rc::check([] {
    const MbesPing ping = *AnyFlatPing(100);
    S7kPingId id;
    id.ping_number = ping.ping_number;
    std::vector<ByteVector> packets =
        FrameS7k(EncodeS7k7027(id, ping), 2, *rc::gen::inRange<std::size_t>(200, 4000));
    for (const ByteVector& packet : FrameS7k(EncodeS7k7000(id, ping.time, ping.sound_speed_mps), 1))
      packets.push_back(packet);
    for (std::size_t i = packets.size(); i > 1; --i)
      std::swap(packets[i - 1], packets[*rc::gen::inRange<std::size_t>(0, i)]);
    RC_PRE(packets.size() <= 32u);
    MbesDecoder decoder = Decoder();
    const std::vector<MbesPing> pings = AddAll(&decoder, packets);
    RC_ASSERT(pings.size() == 1u);
    const MbesPing& decoded = pings[0];
    RC_ASSERT(std::abs(ToUtime(decoded.time) - ToUtime(ping.time)) <= 3);  // float of 60 s
    RC_ASSERT(decoded.ping_number == ping.ping_number);
    RC_ASSERT(decoded.sound_speed_mps == ping.sound_speed_mps);
    RC_ASSERT(decoded.beams.size() == ping.beams.size());
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      RC_ASSERT(std::abs(decoded.beams[i].twtt_s - ping.beams[i].twtt_s) < 1e-6f);
      RC_ASSERT(decoded.beams[i].rx_angle_rad == ping.beams[i].rx_angle_rad);
      RC_ASSERT(decoded.beams[i].tx_tilt_rad == ping.beams[i].tx_tilt_rad);
      RC_ASSERT(std::abs(decoded.beams[i].backscatter_db - ping.beams[i].backscatter_db) < 1e-3f);
      RC_ASSERT(decoded.beams[i].flags == ping.beams[i].flags);
    }
    RC_ASSERT(decoder.counters().empty());
  }));
}

MbesPing SmallPing(std::uint32_t number) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'000'000 + 100'000 * std::int64_t{number});
  ping.ping_number = number;
  ping.beams.resize(20, {0.05f, 0.1f, 0, 0, 0, 40, kBeamValid | kBeamPhase});
  return ping;
}

TEST(S7k, ALostRecordCostsItsPingOnlyAndIsCounted) {
  MbesDecoder decoder = Decoder();
  std::size_t pings = 0;
  for (std::uint32_t i = 0; i < 30; ++i) {
    S7kPingId id;
    id.ping_number = i;
    const auto transmission = static_cast<std::uint16_t>(2 * i);
    if (i != 5)
      pings +=
          AddAll(&decoder, FrameS7k(EncodeS7k7000(id, SmallPing(i).time, 1500.0), transmission))
              .size();
    if (i != 9)
      pings += AddAll(&decoder,
                      FrameS7k(EncodeS7k7027(id, SmallPing(i)),
                               static_cast<std::uint16_t>(transmission + 1)))
                   .size();
  }
  EXPECT_EQ(pings, 28u);
  // The halves of both pings still wait; eight more push them out.
  for (std::uint32_t i = 100; i < 108; ++i) {
    S7kPingId id;
    id.ping_number = i;
    AddAll(&decoder,
           FrameS7k(EncodeS7k7000(id, SmallPing(i).time, 1500.0), static_cast<std::uint16_t>(i)));
  }
  EXPECT_EQ(Count(decoder.counters(), "s7k_ping_without_settings"), 1);
  EXPECT_EQ(Count(decoder.counters(), "s7k_ping_without_detections"), 1);
}

// The sonar restarts and counts its pings from 0 again.
TEST(S7k, AnOldHalfOfAPingNeverMeetsANewOne) {
  MbesDecoder decoder = Decoder();
  const auto record = [](const ByteVector& bytes, std::uint16_t transmission) {
    return FrameS7k(bytes, transmission);
  };
  const Time before = FromUtime(1'000'000);
  const Time after = before + FromSeconds(60.0);
  EXPECT_TRUE(AddAll(&decoder, record(EncodeS7k7027({}, SmallPing(0)), 0), before).empty());
  EXPECT_TRUE(
      AddAll(&decoder, record(EncodeS7k7000({}, SmallPing(500).time, 1490.0), 1), after).empty());
  EXPECT_EQ(Count(decoder.counters(), "s7k_ping_without_settings"), 1);
  const std::vector<MbesPing> pings =
      AddAll(&decoder, record(EncodeS7k7027({}, SmallPing(500)), 2), after);
  ASSERT_EQ(pings.size(), 1u);
  EXPECT_EQ(pings[0].time, SmallPing(500).time);
}

TEST(S7k, APacketThatNeverComesIsCountedByReceiveTime) {
  MbesDecoder decoder = Decoder();
  for (std::uint16_t i = 0; i < 10; ++i) {
    S7kPingId id;
    id.ping_number = i;
    auto packets = FrameS7k(EncodeS7k7027(id, SmallPing(i)), i, 300);
    if (i == 3) packets.pop_back();
    for (const ByteVector& packet : packets)
      decoder.Add(packet, FromUtime(1'000'000 + 500'000 * std::int64_t{i}));
  }
  EXPECT_EQ(Count(decoder.counters(), "s7k_transmission_incomplete"), 1);
}

TEST(S7k, TwoHeadsOfOnePingAreTwoPings) {
  MbesDecoderParams params;
  params.format = "s7k";
  params.codec.head_roll_rad = {0.0, 0.25};
  MbesDecoder decoder(params);
  std::vector<ByteVector> packets;
  for (std::uint16_t head = 0; head < 2; ++head) {
    const S7kPingId id{7125, head, 1, 0};
    for (const auto& record :
         {EncodeS7k7000(id, SmallPing(1).time, 1500.0 + head), EncodeS7k7027(id, SmallPing(1))})
      for (const auto& packet : FrameS7k(record, static_cast<std::uint16_t>(packets.size())))
        packets.push_back(packet);
  }
  std::swap(packets[1], packets[2]);  // both settings, then both detections
  const std::vector<MbesPing> pings = AddAll(&decoder, packets);
  ASSERT_EQ(pings.size(), 2u);
  EXPECT_EQ(pings[0].head, 0);
  EXPECT_EQ(pings[1].head, 1);
  EXPECT_EQ(pings[1].sound_speed_mps, 1501.0);
  EXPECT_EQ(pings[0].beams[0].rx_angle_rad, 0.1f);
  EXPECT_FLOAT_EQ(pings[1].beams[0].rx_angle_rad, 0.1f - 0.25f);
}

TEST(S7k, OtherRecordsAreIgnoredAndCounted) {
  MbesDecoder decoder = Decoder();
  ByteVector record = EncodeS7k7000({}, FromUtime(1'700'000'000'000'000), 1500.0);
  record[32] = static_cast<std::uint8_t>(7503 & 0xFF);
  record[33] = static_cast<std::uint8_t>(7503 >> 8);
  record[48] = 0;  // no checksum
  EXPECT_TRUE(AddAll(&decoder, FrameS7k(record, 1)).empty());
  EXPECT_EQ(decoder.counters(), (Counters{{"s7k_ignored", 1}}));
}

TEST(S7k, FrameRefusesImpossibleSizes) {
  const ByteVector record = EncodeS7k7000({}, FromUtime(1'700'000'000'000'000), 1500.0);
  EXPECT_THROW(FrameS7k(record, 1, 63), std::invalid_argument);
  EXPECT_THROW(FrameS7k(record, 1, 60'001), std::invalid_argument);
}

}  // namespace
}  // namespace seastitch
