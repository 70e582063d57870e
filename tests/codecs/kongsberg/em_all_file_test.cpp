#include "codecs/kongsberg/em_all_file.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "codecs/kongsberg/em_all_writer.hpp"
#include "common/core/pose.hpp"
#include "tests/codecs/maker_soundings.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

std::filesystem::path Golden(const std::string& name) { return Shared("vectors/survey/" + name); }
std::filesystem::path Survey(const std::string& name) { return Shared("data/mbes/" + name); }

// --- real files -------------------------------------------------------------------------------

struct RealFile {
  std::string name;
  int pings;
  std::size_t beams;
  // That an independent ray trace of the same file reached; of em2040_ac that of this geometry,
  // with R of its tilted receivers as an inclination (docs/survey-files-accuracy.md).
  Eigen::Vector3d rms_percent;
};

class EmAllRealFile : public testing::TestWithParam<RealFile> {};

TEST_P(EmAllRealFile, SoundingsFromRawTimesAndAnglesAreWhereKongsbergPutsThem) {
  const RealFile& real = GetParam();
  SKIP_WITHOUT(Survey(real.name));
  const auto file = ReadSurvey<EmAllFileReader>(BytesOf(Survey(real.name)));
  ComparisonOptions options;
  options.motion_source = "A";
  options.depth_from_transmitter = true;
  const auto comparison = CompareWithMaker(file, options);
  comparison.PrintByAngle(real.name);
  EXPECT_EQ(comparison.pings, real.pings);
  EXPECT_EQ(comparison.residuals.size(), real.beams);
  const Eigen::Vector3d rms = comparison.Rms();
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(rms(axis), 1.2 * real.rms_percent(axis)) << axis;
}

INSTANTIATE_TEST_SUITE_P(
    Files,
    EmAllRealFile,
    testing::Values(RealFile{"em710_g.all", 7, 2800, {0.0018, 0.0031, 0.0042}},
                    RealFile{"em2040_ac.all", 8, 3191, {0.0052, 0.0426, 0.0395}},
                    RealFile{"em2040c_ay.all", 28, 10833, {0.0022, 0.0037, 0.0017}}),
    [](const auto& test) {
      std::string name = test.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(EmAllFile, EveryDatagramIsReadOrCountedByName) {
  SKIP_WITHOUT(Survey("em710_g.all"));
  const auto file = ReadSurvey<EmAllFileReader>(BytesOf(Survey("em710_g.all")));
  EXPECT_EQ(file.All<MbesPing>().size(), 10u);
  EXPECT_EQ(file.All<PlacedPing>().size(), 10u);
  EXPECT_EQ(file.All<SurfaceSoundSpeed>().size(), 100u);
  EXPECT_EQ(file.All<ClockComparison>().size(), 5u);
  EXPECT_EQ(file.counters,
            (Counters{{"all_ignored_0", 1},
                      {"all_ignored_1", 5},
                      {"all_ignored_3", 1},
                      {"all_ignored_O", 10},
                      {"all_ignored_R", 3},
                      {"all_ignored_Y", 10}}));
}

TEST(EmAllFile, TheTwoReceiversOfOnePingAreToldApart) {
  SKIP_WITHOUT(Survey("em2040_ac.all"));
  const auto file = ReadSurvey<EmAllFileReader>(BytesOf(Survey("em2040_ac.all")));
  std::map<std::uint32_t, std::vector<int>> heads;
  for (const MbesPing& ping : file.All<MbesPing>()) heads[ping.ping_number].push_back(ping.head);
  EXPECT_EQ(heads.size(), 6u);
  for (const auto& [number, of_ping] : heads) EXPECT_EQ(of_ping, (std::vector<int>{0, 1}));
  const auto installation = file.All<SonarInstallation>().at(0);
  EXPECT_EQ(installation.TransmitterOf(1), installation.TransmitterOf(0));
  EXPECT_NE(installation.ReceiverOf(1), installation.ReceiverOf(0));
}

// --- golden datagrams -------------------------------------------------------------------------

Time TimeOf(const nlohmann::json& datagram) {
  return FromUtime(
      static_cast<std::int64_t>(std::llround(datagram["unix_time"].get<double>() * 1000.0) * 1000));
}

void ExpectMotion(const NavigationRecord& sample,
                  const nlohmann::json& datagram,
                  const nlohmann::json& entry) {
  EXPECT_EQ(sample.time, TimeOf(datagram) + std::chrono::milliseconds(entry["ms"].get<int>()));
  EXPECT_EQ(*sample.heave_m, entry["heave"].get<int>() / 100.0);
  const Eigen::Matrix3d expected = RotationFromRpy(Deg2Rad(entry["roll"].get<int>() / 100.0),
                                                   Deg2Rad(entry["pitch"].get<int>() / 100.0),
                                                   Deg2Rad(entry["head"].get<int>() / 100.0));
  EXPECT_LT((sample.attitude->q_ned_imu.toRotationMatrix() - expected).norm(), 1e-14);
}

TEST(EmAllFile, GoldenDatagramsOfThreeSonars) {
  SKIP_WITHOUT(Golden("em710_g_all.json"));
  for (const std::string name : {"em710_g", "em2040_ac", "em2040c_ay"}) {
    SCOPED_TRACE(name);
    const auto golden = ReadJson(Golden(name + "_all.json"))["datagram"];
    const auto file = ReadSurvey<EmAllFileReader>(BytesOf(Survey(name + ".all")));
    const auto navigation = file.All<NavigationRecord>();
    const auto first = [&](const std::string& source) {
      return *std::find_if(
          navigation.begin(), navigation.end(), [&](const auto& n) { return n.source == source; });
    };
    ExpectMotion(first("A1"), golden["A"]["first"], golden["A"]["first"]["entries"]["0"]);
    EXPECT_EQ(first("A1").status, golden["A"]["first"]["entries"]["0"]["st"]);
    ExpectMotion(first("n1"), golden["n"]["first"], golden["n"]["first"]["entries"]["0"]);

    const auto& p = golden["P"]["first"];
    const NavigationRecord position = first("P1");
    EXPECT_NEAR(Rad2Deg(position.position->latitude_rad), p["lat"].get<double>(), 1e-12);
    EXPECT_NEAR(Rad2Deg(position.position->longitude_rad), p["lon"].get<double>(), 1e-12);
    EXPECT_NEAR(position.position->sigma_north_east_m.x(), p["qual"].get<double>(), 1e-12);

    const auto& u = golden["U"]["first"];
    const auto profile = file.All<SoundVelocityProfile>().at(0);
    EXPECT_EQ(profile.depth_m.front(), u["profile_first3"][0][0]);
    EXPECT_NEAR(profile.speed_mps[1], u["profile_first3"][1][1].get<double>(), 1e-12);
    EXPECT_EQ(profile.depth_m.back(), u["profile_last"][0]);
    // Seconds of the day, not milliseconds.
    EXPECT_EQ(ToUtime(profile.time) / 1'000'000 % 86'400, u["ptime"].get<std::int64_t>());

    const auto& c = golden["C"]["first"];
    const ClockComparison clock = file.All<ClockComparison>().at(0);
    EXPECT_EQ(ToUtime(clock.external_time - clock.time + Time{}),
              1000 * (c["xms"].get<std::int64_t>() - c["ms"].get<std::int64_t>()));

    const auto& n = golden["N"]["first"];
    const MbesPing ping = file.All<MbesPing>().at(0);
    EXPECT_EQ(ping.time, TimeOf(n));
    EXPECT_EQ(ping.ping_number, n["counter"]);
    EXPECT_NEAR(ping.sound_speed_mps, n["ssp"].get<double>(), 1e-9);
    EXPECT_EQ(ping.beams.size(), n["nrx"]);
    for (const auto& [key, beam] : n["beams"].items()) {
      const MbesBeam& b = ping.beams.at(std::stoul(key));
      const auto& sector = n["sectors"].at(beam["sec"].get<std::size_t>());
      EXPECT_EQ(b.twtt_s, beam["twtt"].get<float>());
      EXPECT_NEAR(b.rx_angle_rad, -Deg2Rad(beam["ang"].get<int>() / 100.0), 1e-7);
      EXPECT_NEAR(b.tx_tilt_rad, Deg2Rad(sector["tilt"].get<int>() / 100.0), 1e-8);
      EXPECT_EQ(b.tx_delay_s, sector["delay"].get<float>());
      EXPECT_EQ(b.tx_array, name == "em2040_ac" ? sector["sec"].get<int>() : 0);
      EXPECT_EQ((b.flags & kBeamPhase) != 0, (beam["det"].get<int>() & 0x8F) == 1);
    }

    const auto& x = golden["X"]["first"];
    const PlacedPing placed = file.All<PlacedPing>().at(0);
    EXPECT_EQ(*placed.origin_depth_m, x["txdepth"].get<float>());
    for (const auto& [key, beam] : x["beams"].items())
      EXPECT_EQ(
          placed.soundings.at(std::stoul(key)).p_level_m,
          Eigen::Vector3f(beam["x"].get<float>(), beam["y"].get<float>(), beam["z"].get<float>()));
  }
}

TEST(EmAllFile, APositionsTimeIsTheReceiversOwnWhereTheSonarUsesIt) {
  SKIP_WITHOUT(Golden("all/em710_g_P.bin"));
  const ByteVector bytes = BytesOf(Golden("all/em710_g_P.bin"));
  const auto datagram = ReadEmDatagram(bytes);
  ASSERT_TRUE(datagram);
  SonarInstallation installation;
  const auto sample = DecodeEmP(*datagram, installation);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->time, datagram->time - std::chrono::milliseconds(31));
  installation.sensors.push_back({"P1", true, Eigen::Isometry3d::Identity(), 0.25});
  EXPECT_EQ(DecodeEmP(*datagram, installation)->time,
            datagram->time - std::chrono::milliseconds(281));
}

TEST(EmAllFile, InstallationParametersOfThreeKindsOfSonar) {
  SKIP_WITHOUT(Golden("all/em710_g_I.bin"));
  const auto read = [](const std::string& name) {
    const ByteVector bytes = BytesOf(Golden("all/" + name + "_I.bin"));
    return *DecodeEmI(*ReadEmDatagram(bytes));
  };
  const SonarInstallation em710 = read("em710_g");
  EXPECT_EQ(em710.model, "EM 710");
  ASSERT_EQ(em710.receivers.size(), 1u);
  EXPECT_EQ(em710.transmitters.at(0).At(1).translation(), Eigen::Vector3d(12.341, -0.908, 7.005));
  EXPECT_EQ(em710.receivers[0].At(0).translation(), Eigen::Vector3d(11.622, -0.807, 7.01));
  EXPECT_EQ(em710.water_line_m, 1.031);
  EXPECT_EQ(EmSoundingOrigin(em710), Eigen::Vector3d(0.0, 0.0, 1.031));

  const SonarInstallation dual = read("em2040_ac");  // one transmitter, two receivers
  EXPECT_EQ(dual.transmitters.size(), 1u);
  ASSERT_EQ(dual.receivers.size(), 2u);
  EXPECT_EQ(dual.receivers[1].T_vehicle_array.translation(),
            Eigen::Vector3d(-0.008, 0.338, -0.164));
  EXPECT_EQ(dual.transmitters[0].centres_m.size(), 3u);

  const SonarInstallation head = read("em2040c_ay");  // an old file without STC: one head
  EXPECT_EQ(head.model, "EM 2040C");
  ASSERT_EQ(head.transmitters.size(), 1u);
  EXPECT_EQ(head.transmitters[0].T_vehicle_array.matrix(),
            head.receivers.at(0).T_vehicle_array.matrix());
  EXPECT_EQ(head.values.at("MSR"), "-0.170");
}

// R of a receiver is what an installer measures: the inclination of its across axis.
TEST(EmAllFile, AReceiverIsInclinedAcrossByWhatTheFileStates) {
  for (const double pitch_deg : {-10.0, 0.0, 2.0, 30.0})
    for (const double roll_deg : {-40.0, 0.5, 40.0}) {
      SonarInstallation sent;
      sent.transmitters.resize(1);
      sent.receivers.resize(1);
      sent.receivers[0].T_vehicle_array = MakePose(
          {1.0, 2.0, 3.0}, RotationFromRpy(Deg2Rad(roll_deg), Deg2Rad(pitch_deg), Deg2Rad(170.0)));
      const auto read = DecodeEmI(*ReadEmDatagram(EncodeEmI(sent)));
      ASSERT_TRUE(read);
      const Eigen::Isometry3d& array = read->receivers.at(0).T_vehicle_array;
      EXPECT_TRUE(array.isApprox(sent.receivers[0].T_vehicle_array, 1e-4));
      const double stated_rad = Deg2Rad(std::stod(read->values.at("S2R")));
      EXPECT_NEAR((array.linear() * Eigen::Vector3d::UnitY()).z(), std::sin(stated_rad), 2e-5)
          << roll_deg << " " << pitch_deg;
    }
}

TEST(EmAllFile, TheActivePositioningPointIsTheSoundingsOrigin) {
  SonarInstallation installation;
  installation.water_line_m = -0.5;
  for (int i = 1; i <= 3; ++i)
    installation.sensors.push_back({"P" + std::to_string(i),
                                    i == 2,
                                    Eigen::Isometry3d(Eigen::Translation3d(i, 10.0 * i, 100.0)),
                                    0.0});
  EXPECT_EQ(EmSoundingOrigin(installation), Eigen::Vector3d(2.0, 20.0, -0.5));
}

// --- made here --------------------------------------------------------------------------------

// A body of numbers, each of its own type, in either byte order.
class Body {
 public:
  explicit Body(bool big_endian) : big_endian_(big_endian) {}
  template <class T>
  Body& Put(T value) {
    big_endian_ ? out_.Be(value) : out_.Le(value);
    return *this;
  }
  ByteVector Datagram(char type, std::uint32_t date, std::uint32_t ms) const {
    Body all(big_endian_);
    all.Put(static_cast<std::uint32_t>(16 + out_.size() + 3))
        .Put(std::uint8_t{2})
        .Put(static_cast<std::uint8_t>(type))
        .Put(std::uint16_t{2040})
        .Put(date)
        .Put(ms)
        .Put(std::uint16_t{7})
        .Put(std::uint16_t{101});
    all.out_.Append(out_.bytes());
    const auto& bytes = all.out_.bytes();
    const auto sum = std::accumulate(bytes.begin() + 5, bytes.end(), 0u);
    all.Put(std::uint8_t{3}).Put(static_cast<std::uint16_t>(sum));
    return all.out_.Release();
  }

 private:
  bool big_endian_;
  ByteWriter out_;
};

ByteVector AttitudeRecord(bool big_endian, std::uint32_t ms, std::uint16_t status = 0x9090) {
  Body body(big_endian);
  body.Put(std::uint16_t{2});
  for (const std::uint16_t after_ms : {std::uint16_t{0}, std::uint16_t{700}})
    body.Put(after_ms)
        .Put(status)
        .Put(std::int16_t{-250})
        .Put(std::int16_t{125})
        .Put(std::int16_t{-3})
        .Put(std::uint16_t{35999});
  body.Put(std::uint8_t{0});
  return body.Datagram('A', 20231231, ms);
}

ByteVector RawPing(bool big_endian, std::uint16_t num_beams, std::uint16_t speed_dmps = 14905) {
  Body body(big_endian);
  body.Put(speed_dmps).Put(std::uint16_t{1}).Put(num_beams).Put(num_beams);
  body.Put(14000.0f).Put(std::uint32_t{0});
  body.Put(std::int16_t{-150}).Put(std::uint16_t{0}).Put(0.001f).Put(0.0005f).Put(300e3f);
  body.Put(std::uint16_t{0}).Put(std::uint8_t{0}).Put(std::uint8_t{2}).Put(1e3f);
  for (std::uint16_t i = 0; i < num_beams; ++i) {
    body.Put(static_cast<std::int16_t>(6000 - 500 * i)).Put(std::uint8_t{0});
    // Amplitude, phase, invalid; one that the sonar's filter refused.
    body.Put(static_cast<std::uint8_t>(i % 3 == 2 ? 0x82 : i % 3)).Put(std::uint16_t{10});
    body.Put(std::uint8_t{25}).Put(std::int8_t{0}).Put(0.05f).Put(std::int16_t{-305});
    body.Put(static_cast<std::int8_t>(i == 4 ? -1 : 0)).Put(std::uint8_t{0});
  }
  return body.Datagram('N', 20240101, 5);
}

// ARO: 2 and 3 are the motion sensors at the serial ports, 8 and 9 the same over the network.
TEST(EmAllFile, TheActiveMotionSensorMayBeOnTheNetwork) {
  for (const auto& [number, active] :
       {std::pair{"2", "MS"}, {"3", "NS"}, {"8", "MS"}, {"9", "NS"}}) {
    Body body(false);
    body.Put(std::uint16_t{0});
    for (const char c : "WLZ=0.5,ARO=" + std::string(number) + ",")
      body.Put(static_cast<std::uint8_t>(c));
    const auto file = ReadSurvey<EmAllFileReader>(body.Datagram('I', 20260502, 0));
    const auto installation = file.All<SonarInstallation>().at(0);
    for (const InstalledSensor& sensor : installation.sensors)
      if (!sensor.name.starts_with('P')) {
        EXPECT_EQ(sensor.active, sensor.name == active) << number << ' ' << sensor.name;
      }
  }
}

// Without a probe; the mapper then uses the profile.
TEST(EmAllFile, APingWithoutASoundSpeedIsRead) {
  const auto file = ReadSurvey<EmAllFileReader>(RawPing(false, 6, 0));
  EXPECT_TRUE(file.counters.empty());
  EXPECT_EQ(file.All<MbesPing>().at(0).sound_speed_mps, 0.0);
}

class EmAllByteOrder : public testing::TestWithParam<bool> {};

TEST_P(EmAllByteOrder, APingIsReadInBothByteOrders) {
  const auto file = ReadSurvey<EmAllFileReader>(RawPing(GetParam(), 6));
  EXPECT_TRUE(file.counters.empty());
  const MbesPing ping = file.All<MbesPing>().at(0);
  EXPECT_EQ(ToUtime(ping.time), 1'704'067'200'005'000);
  EXPECT_EQ(ping.sound_speed_mps, 1490.5);
  ASSERT_EQ(ping.beams.size(), 6u);
  EXPECT_FLOAT_EQ(ping.beams[0].rx_angle_rad, static_cast<float>(Deg2Rad(-60.0)));
  EXPECT_FLOAT_EQ(ping.beams[0].tx_tilt_rad, static_cast<float>(Deg2Rad(-1.5)));
  EXPECT_EQ(ping.beams[0].tx_delay_s, 0.0005f);
  EXPECT_EQ(ping.beams[0].tx_array, 2);
  EXPECT_FLOAT_EQ(ping.beams[0].depth_sigma_ratio, 0.01f);
  EXPECT_EQ(ping.beams[0].backscatter_db, -30.5f);
  EXPECT_EQ(ping.beams[0].flags, kBeamValid | kBeamAmplitude);
  EXPECT_EQ(ping.beams[1].flags, kBeamValid | kBeamPhase);
  EXPECT_EQ(ping.beams[2].flags, 0);
  EXPECT_EQ(ping.beams[4].flags, kBeamPhase);
}

TEST_P(EmAllByteOrder, ARecordOfAttitudeRunsOverMidnight) {
  const auto file = ReadSurvey<EmAllFileReader>(AttitudeRecord(GetParam(), 86'399'500));
  const auto samples = file.All<NavigationRecord>();
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(ToUtime(samples[0].time), 1'704'067'199'500'000);
  EXPECT_EQ(ToUtime(samples[1].time), 1'704'067'200'200'000);
  const Eigen::Vector3d rpy = RpyFromRotation(samples[0].attitude->q_ned_imu.toRotationMatrix());
  EXPECT_TRUE(rpy.isApprox(Eigen::Vector3d(Deg2Rad(-2.5), Deg2Rad(1.25), Deg2Rad(-0.01)), 1e-9));
  EXPECT_EQ(*samples[0].heave_m, -0.03);
}

INSTANTIATE_TEST_SUITE_P(Orders, EmAllByteOrder, testing::Bool(), [](const auto& test) {
  return test.param ? "big" : "little";
});

ByteVector AttitudeOf(std::uint32_t date, std::uint32_t ms) {
  Body body(false);
  body.Put(std::uint16_t{1}).Put(std::uint16_t{0}).Put(std::uint16_t{0x9090});
  for (int i = 0; i < 4; ++i) body.Put(std::int16_t{0});
  return body.Put(std::uint8_t{0}).Datagram('A', date, ms);
}

// Datagram D of one beam, 12.34 m below a transmitter in 3.21 m: 7.5 m forward, 20 m to port.
ByteVector DepthRecord(std::uint16_t z, std::uint8_t quality, std::uint8_t num_beams = 1) {
  Body body(false);
  body.Put(std::uint16_t{9000}).Put(std::uint16_t{14905}).Put(std::uint16_t{321});
  body.Put(std::uint8_t{254}).Put(num_beams).Put(std::uint8_t{2}).Put(std::uint8_t{5});
  body.Put(std::uint16_t{15000});
  body.Put(z).Put(std::int16_t{-400}).Put(std::int16_t{150});
  body.Put(std::int16_t{4500}).Put(std::uint16_t{27000}).Put(std::uint16_t{500});
  body.Put(quality).Put(std::uint8_t{10}).Put(std::int8_t{-50}).Put(std::uint8_t{1});
  body.Put(std::int8_t{1});  // of 655.36 m more
  return body.Datagram('D', 20240101, 5);
}

TEST(EmAllFile, SoundingsOfAnOlderSonar) {
  const auto file = ReadSurvey<EmAllFileReader>(DepthRecord(617, 0x85));
  EXPECT_TRUE(file.counters.empty());
  const auto pings = file.All<PlacedPing>();
  ASSERT_EQ(pings.size(), 1u);
  EXPECT_EQ(pings[0].ping_number, 7u);
  EXPECT_DOUBLE_EQ(*pings[0].origin_depth_m, 655.36 + 3.21);
  ASSERT_EQ(pings[0].soundings.size(), 1u);
  EXPECT_TRUE(pings[0].soundings[0].p_level_m.isApprox(Eigen::Vector3f(7.5f, -20.0f, 12.34f)));
  EXPECT_EQ(pings[0].soundings[0].flags, kBeamValid | kBeamPhase);
  const auto above = ReadSurvey<EmAllFileReader>(DepthRecord(0xFFFF, 5)).All<PlacedPing>();
  EXPECT_FLOAT_EQ(above.at(0).soundings[0].p_level_m.z(), -0.02f);
  EXPECT_EQ(above.at(0).soundings[0].flags, kBeamValid | kBeamAmplitude);
  const auto too_short = ReadSurvey<EmAllFileReader>(DepthRecord(617, 5, 2));
  EXPECT_EQ(too_short.counters, (Counters{{"all_malformed", 1}}));
}

// Stamped eight hours ahead, in a ship's local time.
TEST(EmAllFile, AProfileIsInUseFromItsDatagramOnAtTheLatest) {
  Body body(false);
  body.Put(std::uint32_t{20240101}).Put(std::uint32_t{8 * 3600}).Put(std::uint16_t{1});
  body.Put(std::uint16_t{100}).Put(std::uint32_t{10}).Put(std::uint32_t{15000});
  const auto file = ReadSurvey<EmAllFileReader>(body.Datagram('U', 20240101, 60'000));
  const auto profiles = file.All<SoundVelocityProfile>();
  ASSERT_EQ(profiles.size(), 1u);
  EXPECT_EQ(ToUtime(profiles[0].time), 1'704'067'260'000'000);
}

TEST(EmAllFile, MotionThatItsSensorCallsInvalidIsNotGiven) {
  for (const std::uint16_t status : {std::uint16_t{0x909A}, std::uint16_t{0x90AF}}) {
    const auto file = ReadSurvey<EmAllFileReader>(AttitudeRecord(false, 0, status));
    EXPECT_FALSE(file.All<NavigationRecord>().at(0).attitude);
    EXPECT_FALSE(file.All<NavigationRecord>().at(0).heave_m);
  }
  const auto reduced = ReadSurvey<EmAllFileReader>(AttitudeRecord(false, 0, 0x9091));
  EXPECT_TRUE(reduced.All<NavigationRecord>().at(0).attitude);
}

TEST(EmAllFile, EveryCutAndAnyWrongChecksumIsRefused) {
  const ByteVector whole = RawPing(false, 5);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto cut = ReadSurvey<EmAllFileReader>(Bytes(whole).first(n));
    EXPECT_TRUE(cut.records.empty()) << n;
  }
  for (std::size_t i = 5; i < whole.size(); ++i) {
    ByteVector changed = whole;
    changed[i] ^= 0x10;
    EXPECT_TRUE(ReadSurvey<EmAllFileReader>(changed).records.empty()) << i;
  }
}

TEST(EmAllFile, CountsThatThePayloadDoesNotHoldAreRefused) {
  Body body(false);
  body.Put(std::uint16_t{14905}).Put(std::uint16_t{60000}).Put(std::uint16_t{60000});
  body.Put(std::uint16_t{1}).Put(14000.0f).Put(std::uint32_t{0});
  const auto file = ReadSurvey<EmAllFileReader>(body.Datagram('N', 20240101, 5));
  EXPECT_EQ(file.counters, (Counters{{"all_malformed", 1}}));
}

TEST(EmAllFile, AnyPiecesAndAnyDamageOfAnOlderSonar) {
  ByteVector file;
  for (int i = 0; i < 8; ++i) {
    const ByteVector one = i % 2 == 0 ? DepthRecord(617, 0x85) : AttitudeOf(20240101, 10);
    file.insert(file.end(), one.begin(), one.end());
  }
  ExpectRobust(file, [] { return std::make_unique<EmAllFileReader>(); });
}

TEST(EmAllFile, AnyPiecesAndAnyDamage) {
  ByteVector file = RawPing(false, 20);
  for (int i = 0; i < 3; ++i) {
    for (const ByteVector& next : {AttitudeRecord(i == 1, 1000), RawPing(i == 2, 10)})
      file.insert(file.end(), next.begin(), next.end());
  }
  ExpectRobust(file, [] { return std::make_unique<EmAllFileReader>(); });

  SKIP_WITHOUT(Golden("all"));
  ByteVector real;
  for (const char* name : {"I", "P", "U", "A", "n110", "G", "R", "C"}) {
    const ByteVector one = BytesOf(Golden(std::string("all/em710_g_") + name + ".bin"));
    real.insert(real.end(), one.begin(), one.end());
  }
  ExpectRobust(real, [] { return std::make_unique<EmAllFileReader>(); });
}

}  // namespace
}  // namespace seastitch
