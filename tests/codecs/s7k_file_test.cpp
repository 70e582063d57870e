#include "codecs/makers/s7k_file.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "codecs/makers/s7k_sensors.hpp"
#include "common/core/pose.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

const char* const kGolden = "vectors/survey/s7k/synthetic.s7k";

nlohmann::json GoldenValues() { return ReadJson(Shared("vectors/survey/s7k/synthetic.json")); }

NavigationRecord SampleOf(const SurveyContents& file, const std::string& source) {
  for (const NavigationRecord& n : file.All<NavigationRecord>())
    if (n.source == source) return n;
  ADD_FAILURE() << "no sample of " << source;
  return {};
}

TEST(S7kFile, GoldenFileHoldsThePing) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = GoldenValues();
  const auto file = ReadSurvey<S7kFileReader>(BytesOf(Shared(kGolden)));
  const auto pings = file.All<MbesPing>();
  ASSERT_EQ(pings.size(), 1u);
  const MbesPing& ping = pings[0];
  EXPECT_LE(std::abs(static_cast<double>(ToUtime(ping.time)) -
                     golden["time_of_ping_unix"].get<double>() * 1e6),
            4.0);  // a float of seconds
  EXPECT_EQ(ping.ping_number, golden["r7027"]["ping"]);
  EXPECT_EQ(ping.sound_speed_mps, golden["r7000"]["soundVelocity"]);
  ASSERT_EQ(ping.beams.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(ping.beams[i].twtt_s, golden["r7027"]["two_way_time_s"][i].get<double>(), 1e-8);
    EXPECT_NEAR(ping.beams[i].rx_angle_rad, golden["r7027"]["rxAngle"][i].get<double>(), 1e-7);
    EXPECT_NEAR(ping.beams[i].tx_tilt_rad, golden["r7027"]["txAngle"].get<double>(), 1e-8);
    const double depth_m = 0.5 * ping.beams[i].twtt_s * ping.sound_speed_mps *
                           std::cos(double{ping.beams[i].rx_angle_rad});
    EXPECT_NEAR(depth_m, golden["r7027"]["straight_line_depth_m"].get<double>(), 1e-4);
  }
  EXPECT_EQ(file.counters,
            (Counters{{"s7k_ignored_1010", 1},
                      {"s7k_ignored_7004", 1},
                      {"s7k_ignored_7200", 1},
                      {"s7k_ignored_7300", 1}}));
}

TEST(S7kFile, GoldenFileHoldsNavigationAndProfile) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = GoldenValues();
  const auto file = ReadSurvey<S7kFileReader>(BytesOf(Shared(kGolden)));

  const NavigationRecord position = SampleOf(file, "1003");
  EXPECT_NEAR(position.position->latitude_rad, golden["r1003"]["lat_rad"].get<double>(), 1e-15);
  EXPECT_NEAR(position.position->longitude_rad, golden["r1003"]["lon_rad"].get<double>(), 1e-15);
  EXPECT_EQ(*position.height_m, golden["r1003"]["height"]);
  EXPECT_EQ(position.status, golden["r1003"]["method"]);

  const NavigationRecord motion = SampleOf(file, "1012");
  EXPECT_NEAR(motion.roll_pitch_rad->x(), golden["r1012"]["roll"].get<double>(), 1e-9);
  EXPECT_NEAR(motion.roll_pitch_rad->y(), golden["r1012"]["pitch"].get<double>(), 1e-9);
  EXPECT_EQ(*motion.heave_m, -golden["r1012"]["heave"].get<double>());
  EXPECT_EQ(*SampleOf(file, "1013").heading_rad, golden["r1013"].get<double>());

  const NavigationRecord navigation = SampleOf(file, "1015");
  EXPECT_EQ(*navigation.heading_rad, golden["r1015"]["heading"].get<double>());
  EXPECT_TRUE(navigation.position);
  const double course_rad = golden["r1015"]["course"];
  const Eigen::Vector2d ahead(std::cos(course_rad), std::sin(course_rad));
  EXPECT_NEAR(navigation.velocity->v_ned_mps.head<2>().dot(ahead),
              golden["r1015"]["speed"].get<double>(),
              1e-6);
  EXPECT_NEAR(navigation.velocity->v_ned_mps.norm(), golden["r1015"]["speed"].get<double>(), 1e-6);

  std::vector<NavigationRecord> attitudes;
  for (const NavigationRecord& n : file.All<NavigationRecord>())
    if (n.source == "1016") attitudes.push_back(n);
  ASSERT_EQ(attitudes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ((attitudes[i].time - attitudes[0].time).count(),
              1000 * golden["r1016"]["dt_ms"][i].get<int>());
    EXPECT_NEAR(RpyFromRotation(attitudes[i].attitude->q_ned_imu.toRotationMatrix()).x(),
                golden["r1016"]["roll"][i].get<double>(),
                1e-9);
  }

  const auto profile = file.All<SoundVelocityProfile>().at(0);
  EXPECT_EQ(profile.depth_m, golden["r1009"]["depth"].get<std::vector<double>>());
  EXPECT_EQ(profile.speed_mps, golden["r1009"]["c"].get<std::vector<double>>());
}

TEST(S7kFile, GoldenInstallationComesInOurAxes) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = GoldenValues()["r7030"];
  const auto file = ReadSurvey<S7kFileReader>(BytesOf(Shared(kGolden)));
  const auto installation = file.All<SonarInstallation>().at(0);
  const auto expect = [](const Eigen::Isometry3d& T, const nlohmann::json& values) {
    const auto v = values.get<std::vector<double>>();
    // Starboard, forward, up in the file.
    EXPECT_TRUE(T.translation().isApprox(Eigen::Vector3d(v[1], v[0], -v[2]), 1e-6));
    EXPECT_TRUE(T.linear().isApprox(RotationFromRpy(v[3], v[4], v[5]), 1e-6));
  };
  expect(installation.transmitters.at(0).At(0), golden["transmit"]);
  expect(installation.receivers.at(0).At(0), golden["receive"]);
  EXPECT_NEAR(installation.water_line_m, -golden["waterline"].get<double>(), 1e-6);
  ASSERT_EQ(installation.sensors.size(), 2u);
  EXPECT_EQ(installation.sensors[0].delay_s, 0.004);
  EXPECT_EQ(installation.sensors[1].delay_s, 0.12);
  EXPECT_TRUE(installation.sensors[1].T_vehicle_sensor.translation().isApprox(
      Eigen::Vector3d(-2.0, -0.5, -3.5)));
}

ByteVector PingRecords(std::uint32_t number, std::uint16_t head) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'000'000 + 100'000 * std::int64_t{number});
  for (int i = 0; i < 10; ++i) {
    MbesBeam beam;
    beam.twtt_s = 0.04f;
    beam.rx_angle_rad = 0.1f * static_cast<float>(i - 5);
    beam.backscatter_db = 40.0f;
    beam.flags = kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  const S7kPingId id{7125, head, number, 0};
  ByteVector bytes = EncodeS7k7000(id, ping.time, 1480.0);
  const ByteVector detections = EncodeS7k7027(id, ping);
  bytes.insert(bytes.end(), detections.begin(), detections.end());
  return bytes;
}

TEST(S7kFile, TwoHeadsOfOnePingAreToldApart) {
  ByteVector bytes = PingRecords(1, 0);
  const ByteVector second = PingRecords(1, 1);
  bytes.insert(bytes.end(), second.begin(), second.end());
  const auto pings = ReadSurvey<S7kFileReader>(bytes).All<MbesPing>();
  ASSERT_EQ(pings.size(), 2u);
  EXPECT_EQ(pings[0].head, 0);
  EXPECT_EQ(pings[1].head, 1);
}

void Append(const ByteVector& more, ByteVector* all) {
  all->insert(all->end(), more.begin(), more.end());
}

// A record of the golden file, of that type, with some bytes of its data changed.
ByteVector GoldenRecord(std::uint32_t type,
                        const S7kPingId& id,
                        const std::function<void(ByteVector*)>& change = {}) {
  const ByteVector golden = BytesOf(Shared(kGolden));
  for (std::size_t at = 0; at < golden.size();) {
    const auto record = ReadS7kRecord(Bytes(golden).subspan(at));
    if (!record) break;
    if (record->type == type) {
      ByteVector data(record->data.begin(), record->data.end());
      if (change) change(&data);
      return EncodeS7kRecord(type, id, record->time, data);
    }
    at += record->size;
  }
  ADD_FAILURE() << "no record " << type;
  return {};
}

void PutFloat(float value, std::size_t at, ByteVector* data) {
  ByteWriter out;
  out.Le(value);
  std::copy(out.bytes().begin(), out.bytes().end(), data->begin() + std::ptrdiff_t(at));
}

TEST(S7kFile, EachHeadHasItsOwnInstallation) {
  SKIP_WITHOUT(Shared(kGolden));
  // Frequency, four texts of 130 bytes; then the transmitter's place and angles, and the
  // receiver's.
  constexpr std::size_t kTxAt = 4 + 4 * 130;
  constexpr std::size_t kRollAt = 12;
  const auto tilted = [&](float starboard_m, float roll_rad) {
    return [=](ByteVector* data) {
      for (const std::size_t array : {kTxAt, kTxAt + 24}) {
        PutFloat(starboard_m, array, data);
        PutFloat(roll_rad, array + kRollAt, data);
      }
    };
  };
  ByteVector bytes = GoldenRecord(7030, {7125, 0, 0, 0}, tilted(-1.0f, 0.6f));
  Append(GoldenRecord(7030, {7125, 1, 0, 0}, tilted(1.0f, -0.6f)), &bytes);
  const auto installations = ReadSurvey<S7kFileReader>(bytes).All<SonarInstallation>();
  ASSERT_EQ(installations.size(), 2u);
  EXPECT_EQ(installations[0].transmitters.size(), 1u);
  ASSERT_EQ(installations[1].transmitters.size(), 2u);
  ASSERT_EQ(installations[1].receivers.size(), 2u);
  for (const std::size_t head : {0u, 1u}) {
    const double side = head == 0 ? -1.0 : 1.0;
    const Eigen::Isometry3d rx = installations[1].ReceiverOf(head)->At(0);
    EXPECT_EQ(rx.translation().y(), side);
    EXPECT_NEAR(RpyFromRotation(rx.linear()).x(), -0.6 * side, 1e-6);
    EXPECT_EQ(installations[1].TransmitterOf(head)->At(0).translation().y(), side);
  }
}

TEST(S7kFile, DetectionsWithoutSettingsHaveTheLastSoundSpeedOrNone) {
  MbesPing ping;
  ping.beams.resize(3);
  for (MbesBeam& beam : ping.beams) beam.twtt_s = 0.04f;
  const auto detections = [&ping](std::uint32_t number) {
    ping.time = FromUtime(1'700'000'000'000'000 + 500'000 * std::int64_t{number});
    return EncodeS7k7027({7125, 0, number, 0}, ping);
  };
  ByteVector none;
  for (std::uint32_t number = 0; number < 20; ++number) Append(detections(number), &none);
  const auto without = ReadSurvey<S7kFileReader>(none);
  ASSERT_EQ(without.All<MbesPing>().size(), 20u);
  EXPECT_EQ(without.All<MbesPing>()[7].sound_speed_mps, 0.0);
  EXPECT_EQ(without.counters, (Counters{{"s7k_ping_without_settings", 20}}));

  ByteVector of_another_device;
  for (std::uint32_t number = 0; number < 20; ++number) {
    Append(EncodeS7k7000({7000, 0, number, 0},
                         FromUtime(1'700'000'000'000'000 + 500'000 * std::int64_t{number}),
                         1480.0),
           &of_another_device);
    Append(detections(number), &of_another_device);
  }
  const auto pings = ReadSurvey<S7kFileReader>(of_another_device).All<MbesPing>();
  ASSERT_EQ(pings.size(), 20u);
  for (const MbesPing& one : pings) EXPECT_EQ(one.sound_speed_mps, 1480.0);
}

TEST(S7kFile, PositionsInAGridAreGivenAsSuch) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto in_grid = [](ByteVector* data) {
    ByteWriter out;
    out.Le(6'375'000.0);
    out.Le(325'000.0);
    std::copy(out.bytes().begin(), out.bytes().end(), data->begin() + 8);
    (*data)[32] = 1;
  };
  const auto file = ReadSurvey<S7kFileReader>(GoldenRecord(1003, {}, in_grid));
  const NavigationRecord sample = SampleOf(file, "1003");
  EXPECT_FALSE(sample.position);
  EXPECT_EQ(sample.grid_north_east_m, Eigen::Vector2d(6'375'000.0, 325'000.0));
}

TEST(S7kFile, DamageIsSteppedOverToTheNextRecord) {
  ByteVector bytes = PingRecords(1, 0);
  const std::size_t damaged_at = bytes.size();
  for (const std::uint32_t number : {2u, 3u}) {
    const ByteVector next = PingRecords(number, 0);
    bytes.insert(bytes.end(), next.begin(), next.end());
  }
  // The sizes of ping 2's first record.
  for (std::size_t i = 8; i < 12; ++i) bytes[damaged_at + i] = 0xFF;
  const auto file = ReadSurvey<S7kFileReader>(bytes);
  EXPECT_EQ(file.All<MbesPing>().size(), 2u);
  EXPECT_EQ(file.counters.at("damaged_bytes"),
            std::int64_t(EncodeS7k7000({}, FromUtime(1'700'000'000'000'000), 1480.0).size()));
}

TEST(S7kFile, EveryCutGivesNoMoreThanWasThere) {
  const ByteVector whole = PingRecords(1, 0);
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_TRUE(ReadSurvey<S7kFileReader>(Bytes(whole).first(n)).records.empty());
}

TEST(S7kFile, AnyPiecesAndAnyDamage) {
  ByteVector made;
  for (std::uint32_t number = 0; number < 5; ++number) {
    const ByteVector next = PingRecords(number, number % 2 == 0 ? 0 : 1);
    made.insert(made.end(), next.begin(), next.end());
  }
  ExpectRobust(made, [] { return std::make_unique<S7kFileReader>(); });
  SKIP_WITHOUT(Shared(kGolden));
  ByteVector golden = BytesOf(Shared(kGolden));
  // Without checksums, so that damage reaches the decoders.
  for (std::size_t at = 0; at + 64 <= golden.size();) {
    golden[at + 48] &= 0xFE;
    at += ByteReader(Bytes(golden).subspan(at + 8)).Le<std::uint32_t>();
  }
  ExpectRobust(golden, [] { return std::make_unique<S7kFileReader>(); });
}

}  // namespace
}  // namespace seastitch
