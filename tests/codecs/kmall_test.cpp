#include "codecs/kongsberg/kmall_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "common/core/pose.hpp"
#include "drivers/mbes/mbes_decoder.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/paths.hpp"

namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;

std::vector<ByteVector> DatagramsOf(const std::filesystem::path& file, const std::string& type) {
  const ByteVector all = ReadBytes(file);
  std::vector<ByteVector> found;
  for (std::size_t at = 0; at + 8 <= all.size();) {
    const auto size = ByteReader(Bytes(all).subspan(at)).Le<std::uint32_t>();
    const std::string name(all.begin() + static_cast<std::ptrdiff_t>(at + 4),
                           all.begin() + static_cast<std::ptrdiff_t>(at + 8));
    const Bytes datagram = Bytes(all).subspan(at, size);
    if (name == type) found.emplace_back(datagram.begin(), datagram.end());
    at += size;
  }
  return found;
}

void ExpectEqual(const MbesPing& a, const MbesPing& b, float tolerance) {
  EXPECT_EQ(ToUtime(a.time), ToUtime(b.time));
  EXPECT_EQ(a.ping_number, b.ping_number);
  EXPECT_NEAR(a.sound_speed_mps, b.sound_speed_mps, 1e-4);
  ASSERT_EQ(a.beams.size(), b.beams.size());
  for (std::size_t i = 0; i < a.beams.size(); ++i) {
    EXPECT_EQ(a.beams[i].twtt_s, b.beams[i].twtt_s);
    EXPECT_NEAR(a.beams[i].rx_angle_rad, b.beams[i].rx_angle_rad, tolerance);
    EXPECT_NEAR(a.beams[i].tx_tilt_rad, b.beams[i].tx_tilt_rad, tolerance);
    EXPECT_EQ(a.beams[i].tx_delay_s, b.beams[i].tx_delay_s);
    EXPECT_NEAR(a.beams[i].depth_sigma_ratio, b.beams[i].depth_sigma_ratio, tolerance);
    EXPECT_EQ(a.beams[i].backscatter_db, b.beams[i].backscatter_db);
    EXPECT_EQ(a.beams[i].flags, b.beams[i].flags);
  }
}

// A ping of three sectors with beams of every kind.
MbesPing Ping(std::size_t num_beams = 12) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'250'000);
  ping.ping_number = 4660;
  ping.sound_speed_mps = 1490.25;
  for (std::size_t i = 0; i < num_beams; ++i) {
    const auto number = static_cast<float>(i);
    MbesBeam beam;
    beam.twtt_s = 0.05f + 0.001f * number;
    beam.rx_angle_rad = -1.0f + 2.0f * number / static_cast<float>(num_beams);
    beam.tx_tilt_rad = static_cast<float>(Deg2Rad(0.5 * static_cast<double>(i % 3)));
    beam.tx_delay_s = 0.001f * static_cast<float>(i % 3);
    beam.depth_sigma_ratio = 0.0025f;
    beam.backscatter_db = -24.5f;
    beam.flags = i % 4 == 0 ? 0 : i % 4 == 1 ? kBeamAmplitude : kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

KmallHeader Version(std::uint8_t version) {
  KmallHeader header;
  header.version = version;
  return header;
}

void ExpectGolden(const nlohmann::json& golden, const MbesPing& ping) {
  const auto& header = golden["header"];
  EXPECT_EQ(ToUtime(ping.time),
            header["time_sec"].get<std::int64_t>() * 1'000'000 +
                (header["time_nanosec"].get<std::int64_t>() + 500) / 1000);
  EXPECT_EQ(ping.ping_number, golden["cmnPart"]["pingCnt"]);
  EXPECT_EQ(ping.sound_speed_mps, golden["pingInfo"]["soundSpeedAtTxDepth_mPerSec"]);
  std::size_t beam = 0;
  for (const auto& s : golden["sounding"]) {
    if (s["detectionType"] == 1) continue;
    ASSERT_LT(beam, ping.beams.size());
    const MbesBeam& b = ping.beams[beam++];
    const auto& sector = golden["txSectorInfo"].at(s["txSectorNumb"].get<std::size_t>());
    const int method = s["detectionMethod"];
    EXPECT_EQ(b.twtt_s, s["twoWayTravelTime_sec"].get<float>());
    EXPECT_NEAR(b.rx_angle_rad, -Deg2Rad(s["beamAngleReRx_deg"].get<double>()), 1e-7);
    EXPECT_NEAR(b.tx_tilt_rad, Deg2Rad(sector["tiltAngleReTx_deg"].get<double>()), 1e-8);
    EXPECT_EQ(b.tx_delay_s, sector["sectorTransmitDelay_sec"].get<float>());
    EXPECT_NEAR(b.depth_sigma_ratio, s["qualityFactor"].get<double>() / 100.0, 1e-9);
    EXPECT_EQ(b.backscatter_db, s["reflectivity1_dB"].get<float>());
    EXPECT_EQ((b.flags & kBeamValid) != 0, s["detectionType"] == 0 && (method == 1 || method == 2));
    EXPECT_EQ((b.flags & kBeamAmplitude) != 0, method == 1);
    EXPECT_EQ((b.flags & kBeamPhase) != 0, method == 2);
  }
  EXPECT_EQ(beam, ping.beams.size());
}

TEST(KmallMrz, GoldenDatagramsOfEachVersion) {
  SKIP_WITHOUT(Shared("vectors/kmall"));
  for (const std::string name : {"mrz_v0", "mrz_v2", "mrz_v3"}) {
    SCOPED_TRACE(name);
    const auto ping = DecodeMrz(ReadBytes(Shared("vectors/kmall/" + name + ".bin")));
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->beams.size(), 6u);  // the two extra detections are left out
    ExpectGolden(ReadJson(Shared("vectors/kmall/" + name + ".json")), *ping);
  }
}

TEST(KmallMrz, RealDatagramsOfTwoRevisions) {
  SKIP_WITHOUT(Shared("vectors/kmall/real"));
  for (const std::string name : {"MRZ_versionF", "MRZ_versionH"}) {
    SCOPED_TRACE(name);
    const auto golden = ReadJson(Shared("vectors/kmall/real/" + name + ".json"));
    int unusable = -1;
    const auto ping =
        DecodeMrz(ReadBytes(Shared("vectors/kmall/real/" + name + ".kmall")), &unusable);
    ASSERT_TRUE(ping);
    EXPECT_EQ(unusable, 0);
    EXPECT_EQ(ping->beams.size(), golden["rxInfo"]["numSoundingsMaxMain"]);
    EXPECT_EQ(ping->ping_number, golden["cmnPart"]["pingCnt"]);
    EXPECT_EQ(ping->sound_speed_mps, golden["pingInfo"]["soundSpeedAtTxDepth_mPerSec"]);
    const auto valid = std::count_if(ping->beams.begin(), ping->beams.end(), [](const auto& b) {
      return (b.flags & kBeamValid) != 0;
    });
    EXPECT_EQ(valid, golden["rxInfo"]["numSoundingsValidMain"]);
    // Port positive on the wire: the first beam looks to port, here negative.
    EXPECT_LT(ping->beams.front().rx_angle_rad, -0.5);
    EXPECT_GT(ping->beams.back().rx_angle_rad, 0.5);
  }
}

TEST(KmallMrz, SixRealPingsOfAFile) {
  SKIP_WITHOUT(Shared("data/mbes/em2040_OS01.kmall"));
  const auto datagrams = DatagramsOf(Shared("data/mbes/em2040_OS01.kmall"), "#MRZ");
  ASSERT_EQ(datagrams.size(), 6u);
  for (const ByteVector& datagram : datagrams) {
    int unusable = -1;
    const auto ping = DecodeMrz(datagram, &unusable);
    ASSERT_TRUE(ping);
    EXPECT_EQ(unusable, 0);
    EXPECT_GT(ping->beams.size(), 200u);
    EXPECT_NEAR(ping->sound_speed_mps, 1500.0, 100.0);
  }
}

TEST(KmallMrz, EveryTruncationOfAGoldenDatagramIsRejected) {
  SKIP_WITHOUT(Shared("vectors/kmall"));
  for (const std::string name : {"mrz_v0", "mrz_v2", "mrz_v3"}) {
    const ByteVector whole = ReadBytes(Shared("vectors/kmall/" + name + ".bin"));
    for (std::size_t n = 0; n < whole.size(); ++n) {
      ByteVector cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_FALSE(DecodeMrz(cut)) << n;
      if (n < 28) continue;
      // The same with sizes that pretend to be right.
      for (const std::size_t at : {std::size_t{0}, n - 4})
        for (std::size_t i = 0; i < 4; ++i) cut[at + i] = static_cast<std::uint8_t>(n >> (8 * i));
      EXPECT_FALSE(DecodeMrz(cut)) << n;
    }
  }
}

TEST(KmallMrz, AnyChangedByteIsReadOrRefusedWithoutHarm) {
  const ByteVector whole = EncodeMrz(Ping(), Version(3));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0x00, 0x7F, 0xFF}) {
      ByteVector changed = whole;
      changed[at] = static_cast<std::uint8_t>(value);
      const auto ping = DecodeMrz(changed);
      if (!ping) continue;
      ASSERT_EQ(ping->beams.size(), 12u);
      for (const MbesBeam& beam : ping->beams)
        ASSERT_TRUE(std::isfinite(beam.twtt_s) && std::isfinite(beam.rx_angle_rad) &&
                    std::isfinite(beam.tx_tilt_rad) && std::isfinite(beam.tx_delay_s) &&
                    std::isfinite(beam.depth_sigma_ratio) && std::isfinite(beam.backscatter_db));
    }
  }
}

TEST(KmallMrz, PingsComeBackInEveryVersion) {
  for (std::uint8_t version = 0; version <= 3; ++version) {
    const auto ping = DecodeMrz(EncodeMrz(Ping(), Version(version)));
    ASSERT_TRUE(ping) << int{version};
    ExpectEqual(*ping, Ping(), 1e-7f);
  }
}

TEST(KmallMrz, AnyPingComesBack) {
  EXPECT_TRUE(rc::check([] {
    MbesPing ping = Ping(*rc::gen::inRange<std::size_t>(0, 64));
    ping.time = FromUtime(*rc::gen::inRange<std::int64_t>(1'000'000, 4'000'000'000'000'000));
    ping.ping_number = *rc::gen::arbitrary<std::uint16_t>();
    for (MbesBeam& beam : ping.beams) {
      beam.twtt_s = static_cast<float>(*rc::gen::inRange(1, 1'000'000)) * 1e-6f;
      beam.rx_angle_rad = static_cast<float>(*rc::gen::inRange(-1570, 1571)) * 1e-3f;
      beam.backscatter_db = static_cast<float>(*rc::gen::inRange(-1000, 100)) * 0.1f;
    }
    const auto decoded = DecodeMrz(EncodeMrz(ping, Version(*rc::gen::inRange<std::uint8_t>(0, 4))));
    RC_ASSERT(decoded.has_value());
    RC_ASSERT(decoded->time == ping.time);
    RC_ASSERT(decoded->ping_number == ping.ping_number);
    RC_ASSERT(decoded->beams.size() == ping.beams.size());
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      RC_ASSERT(decoded->beams[i].twtt_s == ping.beams[i].twtt_s);
      RC_ASSERT(std::abs(decoded->beams[i].rx_angle_rad - ping.beams[i].rx_angle_rad) < 3e-7f);
      RC_ASSERT(decoded->beams[i].backscatter_db == ping.beams[i].backscatter_db);
      RC_ASSERT(decoded->beams[i].flags == ping.beams[i].flags);
    }
  }));
}

TEST(KmallMrz, ABeamThatIsNotANumberKeepsItsPlaceWithoutValue) {
  MbesPing ping = Ping();
  ping.beams[2].twtt_s = std::numeric_limits<float>::quiet_NaN();
  ping.beams[3].rx_angle_rad = std::numeric_limits<float>::infinity();
  ping.beams[6].twtt_s = -0.1f;
  ping.beams[7].twtt_s = 0.0f;  // valid, and yet at no distance
  int unusable = 0;
  const auto decoded = DecodeMrz(EncodeMrz(ping, Version(3)), &unusable);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(unusable, 4);
  ASSERT_EQ(decoded->beams.size(), 12u);
  for (const std::size_t i : {2u, 3u, 6u, 7u}) {
    EXPECT_EQ(decoded->beams[i].flags, 0);
    EXPECT_EQ(decoded->beams[i].twtt_s, 0.0f);
  }
  EXPECT_EQ(decoded->beams[5].flags, Ping().beams[5].flags);
}

TEST(KmallMrz, WithoutSoundSpeedThereIsNoPing) {
  for (const double speed : {0.0, -1.0, std::nan("")}) {
    MbesPing ping = Ping();
    ping.sound_speed_mps = speed;
    EXPECT_FALSE(DecodeMrz(EncodeMrz(ping, Version(3))));
  }
}

TEST(KmallMrz, StructuresMayGrow) {
  // A sounding, a sector or an info that is longer than we know is stepped over by its size: the
  // golden datagram with two bytes more in its common part.
  ByteVector bytes = EncodeMrz(Ping(), Version(3));
  bytes.insert(bytes.begin() + 36, {0xAA, 0xBB});
  bytes[24] = 14;
  const auto size = static_cast<std::uint32_t>(bytes.size());
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[i] = static_cast<std::uint8_t>(size >> (8 * i));
    bytes[bytes.size() - 4 + i] = bytes[i];
  }
  const auto ping = DecodeMrz(bytes);
  ASSERT_TRUE(ping);
  ExpectEqual(*ping, Ping(), 1e-7f);
}

TEST(KmallMrz, EncodeRefusesWhatTheFormatCannotHold) {
  EXPECT_THROW(EncodeMrz(Ping(1025), Version(3)), std::invalid_argument);
  MbesPing many = Ping(300);
  for (std::size_t i = 0; i < 300; ++i) many.beams[i].tx_delay_s = 0.001f * static_cast<float>(i);
  EXPECT_THROW(EncodeMrz(many, Version(3)), std::invalid_argument);
}

TEST(KmallSvp, GoldenProfileAndTheRealOne) {
  SKIP_WITHOUT(Shared("vectors/kmall"));
  const auto golden = DecodeSvp(ReadBytes(Shared("vectors/kmall/svp.bin")));
  ASSERT_TRUE(golden);
  EXPECT_EQ(ToUtime(golden->time), 1'699'990'000'000'000);
  EXPECT_EQ(golden->depth_m, (std::vector<double>{0.0, 10.0, 50.0}));
  EXPECT_EQ(golden->speed_mps, (std::vector<double>{1490.5, 1488.25, 1485.0}));

  SKIP_WITHOUT(Shared("data/mbes/em2040_OS01.kmall"));
  const auto real = DatagramsOf(Shared("data/mbes/em2040_OS01.kmall"), "#SVP");
  ASSERT_EQ(real.size(), 1u);
  const auto profile = DecodeSvp(real[0]);
  ASSERT_TRUE(profile);
  ASSERT_EQ(profile->depth_m.size(), 12u);
  EXPECT_EQ(profile->depth_m.back(), 12000.0);
  EXPECT_EQ(profile->speed_mps[3], 1498.0);
  EXPECT_TRUE(std::is_sorted(profile->depth_m.begin(), profile->depth_m.end()));
}

TEST(KmallSvp, ComesBackAndEveryTruncationIsRejected) {
  SoundVelocityProfile profile;
  profile.time = FromUtime(1'700'000'000'000'000);
  for (int i = 0; i < 40; ++i) {
    profile.depth_m.push_back(0.5 * i);
    profile.speed_mps.push_back(1500.0 - 0.25 * i);
  }
  const ByteVector bytes = EncodeSvp(profile, KmallHeader{});
  const auto decoded = DecodeSvp(bytes);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->time, profile.time);
  EXPECT_EQ(decoded->depth_m, profile.depth_m);
  EXPECT_EQ(decoded->speed_mps, profile.speed_mps);
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(DecodeSvp(Bytes(bytes).first(n)));
}

TEST(KmallSvp, SamplesThatDoNotGoDeeperAreLeftOut) {
  SoundVelocityProfile profile;
  profile.time = FromUtime(1'700'000'000'000'000);
  profile.depth_m = {0.0, 5.0, 5.0, 4.0, 6.0};
  profile.speed_mps = {1500.0, 1499.0, 1498.0, 1497.0, 1496.0};
  const auto decoded = DecodeSvp(EncodeSvp(profile, KmallHeader{}));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->depth_m, (std::vector<double>{0.0, 5.0, 6.0}));
  EXPECT_EQ(decoded->speed_mps, (std::vector<double>{1500.0, 1499.0, 1496.0}));
  profile.speed_mps[1] = std::nan("");
  EXPECT_FALSE(DecodeSvp(EncodeSvp(profile, KmallHeader{})));
}

std::optional<ByteVector> AddAll(KmallReassembler* reassembler,
                                 const std::vector<ByteVector>& parts) {
  std::optional<ByteVector> whole;
  for (const ByteVector& part : parts)
    if (auto done = reassembler->Add(part)) whole = done;
  return whole;
}

TEST(KmallParts, GoldenPartsJoinToTheGoldenDatagrams) {
  SKIP_WITHOUT(Shared("vectors/kmall"));
  for (const std::string name : {"mrz_v2", "mrz_v2_big"}) {
    const ByteVector whole = ReadBytes(Shared("vectors/kmall/" + name + ".bin"));
    const ByteVector one = ReadBytes(Shared("vectors/kmall/" + name + "_part1of2.bin"));
    const ByteVector two = ReadBytes(Shared("vectors/kmall/" + name + "_part2of2.bin"));
    KmallReassembler forward({});
    EXPECT_EQ(AddAll(&forward, {one, two}), whole);
    KmallReassembler backward({});
    EXPECT_EQ(AddAll(&backward, {two, one}), whole);
    EXPECT_EQ(SplitIntoParts(whole, one.size()), (std::vector<ByteVector>{one, two}));
    EXPECT_TRUE(forward.counters().empty());
  }
}

TEST(KmallParts, AnyOrderAnyRepeatsBothRules) {
  EXPECT_TRUE(rc::check([] {
    const auto version = *rc::gen::inRange<std::uint8_t>(0, 4);
    const MbesPing ping = Ping(*rc::gen::inRange<std::size_t>(2, 40));
    const std::vector<ByteVector> parts = SplitIntoParts(EncodeMrz(ping, Version(version)),
                                                         *rc::gen::inRange<std::size_t>(400, 2000));
    RC_PRE(parts.size() <= 32u);
    std::vector<ByteVector> sent = parts;
    const auto repeats = *rc::gen::inRange<std::size_t>(0, 4);
    for (std::size_t i = 0; i < repeats; ++i)
      sent.push_back(parts[*rc::gen::inRange<std::size_t>(0, parts.size())]);
    std::vector<std::size_t> order(sent.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    for (std::size_t i = order.size(); i > 1; --i)
      std::swap(order[i - 1], order[*rc::gen::inRange<std::size_t>(0, i)]);
    MbesDecoder decoder({});
    std::vector<MbesOutput> outputs;
    for (const std::size_t i : order)
      for (MbesOutput& output : decoder.Add(sent[i], FromUtime(1)))
        outputs.push_back(std::move(output));
    RC_ASSERT(outputs.size() == 1u);
    RC_ASSERT(std::get<MbesPing>(outputs[0]).beams.size() == ping.beams.size());
    Counters expected;
    if (repeats > 0) expected["mbes_datagram_repeated"] = static_cast<std::int64_t>(repeats);
    RC_ASSERT(decoder.counters() == expected);
  }));
}

TEST(KmallParts, TwoHeadsWithoutNumbersInTheirPartsAreKeptApart) {
  // Up to revision H two fans of one ping may have the same key.
  MbesPing left = Ping(40);
  MbesPing right = Ping(40);
  for (MbesBeam& beam : right.beams) beam.twtt_s += 0.01f;
  const auto a = SplitIntoParts(EncodeMrz(left, Version(2)), 2000);
  const auto b = SplitIntoParts(EncodeMrz(right, Version(2)), 2000);
  KmallReassembler reassembler({});
  std::vector<ByteVector> whole;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (const ByteVector& part : {a[i], b[i]})
      if (auto done = reassembler.Add(part)) whole.push_back(std::move(*done));
  EXPECT_EQ(whole,
            (std::vector<ByteVector>{EncodeMrz(left, Version(2)), EncodeMrz(right, Version(2))}));
  EXPECT_TRUE(reassembler.counters().empty());
}

TEST(KmallParts, DualSwathAndDualHeadOfTheNewRuleInterleave) {
  // Four fans of one ping: the same ping counter, two times, two fan numbers.
  std::vector<std::vector<ByteVector>> fans;
  for (int swath = 0; swath < 2; ++swath) {
    for (std::uint8_t head = 0; head < 2; ++head) {
      MbesPing ping = Ping(40);
      ping.time += std::chrono::milliseconds(3 * swath);
      ByteVector whole = EncodeMrz(ping, Version(3));
      whole[29] = static_cast<std::uint8_t>(2 * swath + head);
      whole[33] = head;
      fans.push_back(SplitIntoParts(whole, 2000));
    }
  }
  MbesDecoderParams params;
  params.codec.head_roll_rad = {0.5, -0.5};
  MbesDecoder decoder(params);
  std::vector<MbesPing> pings;
  for (std::size_t part = fans[0].size(); part-- > 0;)
    for (const auto& fan : fans)
      for (MbesOutput& output : decoder.Add(fan[part], FromUtime(1)))
        pings.push_back(std::get<MbesPing>(std::move(output)));
  ASSERT_EQ(pings.size(), 4u);
  EXPECT_TRUE(decoder.counters().empty());
  EXPECT_EQ(ToUtime(pings[2].time) - ToUtime(pings[0].time), 3000);
  // Positive roll: the head looks to port.
  EXPECT_NEAR(pings[0].beams[3].rx_angle_rad, Ping(40).beams[3].rx_angle_rad - 0.5f, 1e-6);
  EXPECT_NEAR(pings[3].beams[3].rx_angle_rad, Ping(40).beams[3].rx_angle_rad + 0.5f, 1e-6);
}

TEST(KmallParts, ALatePartCostsItsOwnPingOnly) {
  PartCollectorParams params;
  params.max_age_s = 1.0;
  KmallReassembler reassembler(params);
  MbesPing ping = Ping(40);
  const auto first = SplitIntoParts(EncodeMrz(ping, Version(3)), 2000);
  for (std::size_t i = 1; i < first.size(); ++i) EXPECT_FALSE(reassembler.Add(first[i]));
  ping.time += std::chrono::milliseconds(1500);
  EXPECT_TRUE(AddAll(&reassembler, SplitIntoParts(EncodeMrz(ping, Version(3)), 2000)));
  EXPECT_FALSE(reassembler.Add(first[0]));
  EXPECT_EQ(Count(reassembler.counters(), "kmall_set_incomplete"), 1);
}

TEST(KmallParts, NewVersionSplitByTheOldRuleIsJoinedAllTheSame) {
  ByteVector v2 = EncodeMrz(Ping(40), Version(2));
  std::vector<ByteVector> parts = SplitIntoParts(v2, 1000);
  ASSERT_GT(parts.size(), 2u);
  for (ByteVector& part : parts) {
    part[8] = 3;
    // What stands where the common part would: key fields as in the first part.
    std::copy_n(parts[0].begin() + 24, 6, part.begin() + 24);
  }
  // The key bytes overwrote soundings; sizes still add up, which is what the rule is chosen by.
  KmallReassembler reassembler({});
  const auto whole = AddAll(&reassembler, parts);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->size(), v2.size());
}

TEST(KmallParts, AMissingPartCostsItsPingOnlyAfterItsTime) {
  PartCollectorParams params;
  params.max_age_s = 1.0;
  KmallReassembler reassembler(params);
  MbesPing ping = Ping(40);
  int whole = 0;
  for (int i = 0; i < 50; ++i) {
    ping.time += std::chrono::milliseconds(100);
    std::vector<ByteVector> parts = SplitIntoParts(EncodeMrz(ping, Version(3)), 1500);
    if (i == 20) parts.erase(parts.begin() + 1);
    whole += AddAll(&reassembler, parts).has_value() ? 1 : 0;
  }
  EXPECT_EQ(whole, 49);
  EXPECT_EQ(Count(reassembler.counters(), "kmall_set_incomplete"), 1);
}

TEST(KmallParts, TwoHeadsAndTwoSendersMayInterleave) {
  MbesPing ping = Ping(40);
  KmallHeader other = Version(3);
  other.system_id = 41;
  const auto a = SplitIntoParts(EncodeMrz(ping, Version(3)), 2000);
  const auto b = SplitIntoParts(EncodeMrz(ping, other), 2000);
  KmallReassembler reassembler({});
  int whole = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    whole += reassembler.Add(a[i], 1).has_value() ? 1 : 0;
    whole += reassembler.Add(b[i], 1).has_value() ? 1 : 0;
    whole += reassembler.Add(a[i], 2).has_value() ? 1 : 0;
  }
  EXPECT_EQ(whole, 3);
  EXPECT_TRUE(reassembler.counters().empty());
}

TEST(KmallParts, AFloodOfFirstPartsStaysBounded) {
  KmallReassembler reassembler({});
  MbesPing ping = Ping(40);
  const int flood = 1000;
  for (int i = 0; i < flood; ++i) {
    ping.time += Duration(1);  // never old enough to be dropped by time
    reassembler.Add(SplitIntoParts(EncodeMrz(ping, Version(3)), 2000)[0]);
  }
  EXPECT_EQ(Count(reassembler.counters(), "kmall_set_incomplete"),
            flood - PartCollectorParams{}.max_open);
}

TEST(KmallParts, ImpossiblePartsAreCounted) {
  const auto parts = SplitIntoParts(EncodeMrz(Ping(40), Version(3)), 2000);
  const auto with = [&parts](std::uint8_t num, std::uint8_t number) {
    ByteVector part = parts[1];
    part[20] = num;
    part[22] = number;
    return part;
  };
  KmallReassembler reassembler({});
  EXPECT_FALSE(reassembler.Add(with(3, 0)));
  EXPECT_FALSE(reassembler.Add(with(3, 4)));
  EXPECT_FALSE(reassembler.Add(with(0, 1)));
  EXPECT_FALSE(reassembler.Add(with(33, 1)));
  EXPECT_FALSE(reassembler.Add(Bytes(parts[1]).first(30)));
  EXPECT_FALSE(reassembler.Add({}));
  EXPECT_EQ(Count(reassembler.counters(), "kmall_part_malformed"), 6);
}

TEST(KmallParts, AWrongTailIsCountedButUsed) {
  auto parts = SplitIntoParts(EncodeMrz(Ping(40), Version(3)), 2000);
  parts[0].back() ^= 0xFF;
  KmallReassembler reassembler({});
  EXPECT_TRUE(AddAll(&reassembler, parts));
  EXPECT_EQ(Count(reassembler.counters(), "kmall_part_tail_wrong"), 1);
}

TEST(KmallParts, SetsThatDoNotAddUpAreCounted) {
  auto parts = SplitIntoParts(EncodeMrz(Ping(40), Version(3)), 2000);
  // Two bytes of the last slice are missing.
  ByteVector& last = parts.back();
  last.erase(last.end() - 6, last.end() - 4);
  last[0] = static_cast<std::uint8_t>(last.size());
  last[1] = static_cast<std::uint8_t>(last.size() >> 8);
  KmallReassembler reassembler({});
  EXPECT_FALSE(AddAll(&reassembler, parts));
  EXPECT_EQ(Count(reassembler.counters(), "kmall_set_inconsistent"), 1);
}

TEST(KmallParts, SplitRefusesImpossibleSizes) {
  const ByteVector whole = EncodeMrz(Ping(), Version(3));
  EXPECT_THROW(SplitIntoParts(whole, 63), std::invalid_argument);
  EXPECT_THROW(SplitIntoParts(whole, 65508), std::invalid_argument);
  EXPECT_EQ(SplitIntoParts(whole), std::vector<ByteVector>{whole});
}

void ExpectKmb(const NavigationRecord& sample, const nlohmann::json& kmb) {
  const unsigned invalid = kmb["status"].get<unsigned>();
  EXPECT_EQ(sample.status, invalid);
  ASSERT_EQ(sample.attitude.has_value(), (invalid & 0x6) == 0);
  ASSERT_EQ(sample.position.has_value(), (invalid & 0x1) == 0);
  ASSERT_EQ(sample.heave_m.has_value(), (invalid & 0x8) == 0);
  EXPECT_EQ(sample.heave_m.value_or(0.0f), sample.heave_m ? kmb["heave_m"].get<float>() : 0.0f);
  if (sample.attitude) {
    const Eigen::Matrix3d expected = RotationFromRpy(Deg2Rad(kmb["roll_deg"].get<double>()),
                                                     Deg2Rad(kmb["pitch_deg"].get<double>()),
                                                     Deg2Rad(kmb["heading_deg"].get<double>()));
    EXPECT_LT((sample.attitude->q_ned_imu.toRotationMatrix() - expected).norm(), 1e-7);
  }
}

TEST(KmallSensors, GoldenDatagramsAreReadAndEveryTruncationRefused) {
  SKIP_WITHOUT(Shared("vectors/kmall"));
  const auto golden = [](const std::string& name) {
    return ReadJson(Shared("vectors/kmall/" + name + ".json"));
  };
  const ByteVector spo = ReadBytes(Shared("vectors/kmall/spo.bin"));
  const auto position = DecodeSpo(spo);
  ASSERT_TRUE(position);
  ASSERT_TRUE(position->position);
  EXPECT_NEAR(position->position->latitude_rad,
              Deg2Rad(golden("spo")["sensorData"]["correctedLat_deg"].get<double>()),
              1e-12);
  EXPECT_NEAR(position->position->longitude_rad,
              Deg2Rad(golden("spo")["sensorData"]["correctedLong_deg"].get<double>()),
              1e-12);

  const ByteVector skm = ReadBytes(Shared("vectors/kmall/skm.bin"));
  const auto motion = DecodeSkm(skm);
  const nlohmann::json samples = golden("skm")["sample"];
  ASSERT_TRUE(motion);
  ASSERT_EQ(motion->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) ExpectKmb((*motion)[i], samples[i]["KMdefault"]);

  const ByteVector svt = ReadBytes(Shared("vectors/kmall/svt.bin"));
  const auto speeds = DecodeSvt(svt);
  ASSERT_TRUE(speeds);
  ASSERT_EQ(speeds->size(), 1u);
  EXPECT_EQ((*speeds)[0].speed_mps,
            golden("svt")["sensorData"][0]["soundVelocity_mPerSec"].get<float>());

  for (std::size_t n = 0; n < spo.size(); ++n) EXPECT_FALSE(DecodeSpo(Bytes(spo).first(n)));
  for (std::size_t n = 0; n < skm.size(); ++n) EXPECT_FALSE(DecodeSkm(Bytes(skm).first(n)));
  for (std::size_t n = 0; n < svt.size(); ++n) EXPECT_FALSE(DecodeSvt(Bytes(svt).first(n)));
}

TEST(MbesDecoder, GivesPingsAndProfilesAndCountsTheRest) {
  SKIP_WITHOUT(Shared("data/mbes/em2040_OS01.kmall"));
  MbesDecoder decoder({});
  int pings = 0;
  int profiles = 0;
  const auto add = [&](const ByteVector& payload) {
    for (const MbesOutput& output : decoder.Add(payload, FromUtime(1)))
      (std::holds_alternative<MbesPing>(output) ? pings : profiles) += 1;
  };
  for (const char* const type : {"#SVP", "#SPO", "#SKM", "#IIP"})
    for (const auto& d : DatagramsOf(Shared("data/mbes/em2040_OS01.kmall"), type)) add(d);
  for (const auto& datagram : DatagramsOf(Shared("data/mbes/em2040_OS01.kmall"), "#MRZ"))
    for (const auto& part : SplitIntoParts(datagram, 9000)) add(part);
  EXPECT_EQ(pings, 6);
  EXPECT_EQ(profiles, 1);
  EXPECT_EQ(Count(decoder.counters(), "kmall_ignored"), 1);  // #IIP
  EXPECT_EQ(Count(decoder.counters(), "kmall_malformed"), 0);
  EXPECT_GT(Count(decoder.counters(), "kmall_positions"), 0);
  EXPECT_GT(Count(decoder.counters(), "kmall_motion_samples"), 0);
}

TEST(MbesDecoder, CountsWhatItCannotUse) {
  MbesDecoder decoder({});
  const auto add = [&](const ByteVector& bytes) { return decoder.Add(bytes, FromUtime(1)).size(); };
  EXPECT_EQ(add(EncodeMrz(Ping(), Version(4))), 0u);
  EXPECT_EQ(add({}), 0u);
  ByteVector wrong = EncodeMrz(Ping(), Version(3));
  wrong.back() ^= 1;  // the tail of a whole datagram
  EXPECT_EQ(add(wrong), 0u);
  MbesPing ping = Ping();
  ping.beams[2].twtt_s = -1.0f;
  EXPECT_EQ(add(EncodeMrz(ping, Version(3))), 1u);
  EXPECT_EQ(add(EncodeMrz(ping, Version(3))), 0u);  // the same once more
  EXPECT_EQ(Count(decoder.counters(), "kmall_version_unknown"), 1);
  EXPECT_EQ(Count(decoder.counters(), "kmall_malformed"), 2);
  EXPECT_EQ(Count(decoder.counters(), "mbes_beam_unusable"), 1);
  EXPECT_EQ(Count(decoder.counters(), "mbes_datagram_repeated"), 1);
}

TEST(MbesDecoder, ReceiveClockIsLessTheLatency) {
  MbesDecoderParams params;
  params.clock = {DeviceClock::kReceive, 0.25};
  MbesDecoder decoder(params);
  const auto outputs = decoder.Add(EncodeMrz(Ping(), Version(3)), FromUtime(9'000'000));
  ASSERT_EQ(outputs.size(), 1u);
  EXPECT_EQ(ToUtime(std::get<MbesPing>(outputs[0]).time), 8'750'000);
}

TEST(MbesDecoder, RefusesFormatsThatDoNotExist) {
  MbesDecoderParams params;
  params.format = "sidescan";
  EXPECT_THROW(MbesDecoder{params}, std::invalid_argument);
}

}  // namespace
}  // namespace seastitch
