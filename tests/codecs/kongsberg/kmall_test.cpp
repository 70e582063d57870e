#include "tests/codecs/kongsberg/kmall_fixtures.hpp"

namespace seastitch {
namespace {

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
    const auto ping = DecodeMrz(BytesOf(Shared("vectors/kmall/" + name + ".bin")));
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
        DecodeMrz(BytesOf(Shared("vectors/kmall/real/" + name + ".kmall")), &unusable);
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
    const ByteVector whole = BytesOf(Shared("vectors/kmall/" + name + ".bin"));
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
  const auto golden = DecodeSvp(BytesOf(Shared("vectors/kmall/svp.bin")));
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

}  // namespace
}  // namespace seastitch
