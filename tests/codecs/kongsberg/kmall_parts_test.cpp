#include "tests/codecs/kongsberg/kmall_fixtures.hpp"

namespace seastitch {
namespace {

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
    const ByteVector whole = BytesOf(Shared("vectors/kmall/" + name + ".bin"));
    const ByteVector one = BytesOf(Shared("vectors/kmall/" + name + "_part1of2.bin"));
    const ByteVector two = BytesOf(Shared("vectors/kmall/" + name + "_part2of2.bin"));
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
  const ByteVector spo = BytesOf(Shared("vectors/kmall/spo.bin"));
  const auto position = DecodeSpo(spo);
  ASSERT_TRUE(position);
  ASSERT_TRUE(position->position);
  EXPECT_NEAR(position->position->latitude_rad,
              Deg2Rad(golden("spo")["sensorData"]["correctedLat_deg"].get<double>()),
              1e-12);
  EXPECT_NEAR(position->position->longitude_rad,
              Deg2Rad(golden("spo")["sensorData"]["correctedLong_deg"].get<double>()),
              1e-12);

  const ByteVector skm = BytesOf(Shared("vectors/kmall/skm.bin"));
  const auto motion = DecodeSkm(skm);
  const nlohmann::json samples = golden("skm")["sample"];
  ASSERT_TRUE(motion);
  ASSERT_EQ(motion->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) ExpectKmb((*motion)[i], samples[i]["KMdefault"]);

  const ByteVector svt = BytesOf(Shared("vectors/kmall/svt.bin"));
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
