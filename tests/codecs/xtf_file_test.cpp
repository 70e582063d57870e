#include "codecs/makers/xtf_file.hpp"

#include <gtest/gtest.h>

#include "codecs/makers/r2sonic.hpp"
#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/codecs/motion.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

const char* const kRealFile = "data/mbes/r2sonic2026.xtf";
const char* const kGolden = "vectors/survey/r2sonic2026_xtf.json";

SurveyContents RealFile() { return ReadSurvey<XtfFileReader>(BytesOf(Shared(kRealFile))); }

Time TimeOf(const nlohmann::json& one) {
  return FromUtime(std::llround(one["unix_time"].get<double>() * 1e6));
}

TEST(XtfFile, GoldenPingsAttitudeAndPositionsOfARealFile) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = ReadJson(Shared(kGolden));
  const auto file = RealFile();
  EXPECT_TRUE(file.counters.empty());
  const auto pings = file.All<MbesPing>();
  ASSERT_EQ(pings.size(), golden["packets"]["65"]);
  for (const auto& [expected, ping] : {std::pair{golden["pings"]["first"], pings.front()},
                                       std::pair{golden["pings"]["last"], pings.back()}}) {
    EXPECT_LE(std::chrono::abs(ping.time - TimeOf(expected)), Duration(1));
    EXPECT_EQ(ping.beams.size(), expected["beams"]);
    EXPECT_NEAR(ping.sound_speed_mps, expected["sound_speed_mps"].get<double>(), 1e-3);
    for (const auto& [key, beam] : expected["beam"].items()) {
      EXPECT_NEAR(ping.beams.at(std::stoul(key)).twtt_s, beam["twtt_s"].get<double>(), 1e-9);
      EXPECT_NEAR(
          ping.beams.at(std::stoul(key)).rx_angle_rad, beam["angle_rad"].get<double>(), 2e-7);
    }
  }
  std::vector<NavigationRecord> attitudes, positions;
  for (const NavigationRecord& n : file.All<NavigationRecord>())
    (n.attitude ? attitudes : positions).push_back(n);
  EXPECT_EQ(attitudes.size(), golden["packets"]["3"]);
  EXPECT_EQ(positions.size(), golden["packets"]["107"]);
  for (const auto& [expected, sample] : {std::pair{golden["attitude"]["first"], attitudes.front()},
                                         std::pair{golden["attitude"]["last"], attitudes.back()}}) {
    EXPECT_EQ(sample.time, TimeOf(expected));
    const Eigen::Vector3d rpy = RpyFromRotation(sample.attitude->q_ned_imu.toRotationMatrix());
    EXPECT_NEAR(Rad2Deg(rpy.x()), expected["roll_deg"].get<double>(), 1e-6);
    EXPECT_NEAR(Rad2Deg(rpy.y()), expected["pitch_deg"].get<double>(), 1e-6);
    EXPECT_NEAR(WrapAngle(rpy.z() - Deg2Rad(expected["heading_deg"].get<double>())), 0.0, 1e-7);
    EXPECT_NEAR(*sample.heave_m, -expected["heave_m"].get<double>(), 1e-7);  // up in the file
  }
  const auto& last = golden["position"]["last"];
  EXPECT_EQ(positions.back().time, TimeOf(last));
  EXPECT_NEAR(
      Rad2Deg(positions.back().position->latitude_rad), last["lat_deg"].get<double>(), 1e-11);
  EXPECT_NEAR(
      Rad2Deg(positions.back().position->longitude_rad), last["lon_deg"].get<double>(), 1e-11);
  EXPECT_NEAR(*positions.back().height_m, last["height_m"].get<double>(), 1e-9);
}

// The antenna rises as the heave falls: that heave points up in the file is seen in the file.
TEST(XtfFile, HeaveIsDown) {
  SKIP_WITHOUT(Shared(kRealFile));
  std::vector<double> heave, height;
  for (const NavigationRecord& n : RealFile().All<NavigationRecord>()) {
    if (n.heave_m) heave.push_back(*n.heave_m);
    if (n.height_m) height.push_back(*n.height_m);
  }
  double product = 0.0, heave2 = 0.0;
  for (std::size_t i = 20; i < std::min(heave.size(), height.size()); ++i) {
    product += (heave[i] - heave[i - 20]) * (height[i] - height[i - 20]);
    heave2 += (heave[i] - heave[i - 20]) * (heave[i] - heave[i - 20]);
  }
  EXPECT_NEAR(product / heave2, -1.0, 0.05);
}

// How the attitude of a ping is taken: that much later than its time, at each echo or once.
struct AttitudeRule {
  double later_s = 0.0;
  bool once = false;
};

// Slope of the bed across, of one ping.
std::optional<double> SlopeAcross(const MbesPing& ping, const Motion& motion, AttitudeRule rule) {
  const Time first = ping.time + FromSeconds(rule.later_s);
  if (!motion.Covers(first, LastEcho(ping) + FromSeconds(rule.later_s))) return std::nullopt;
  const double heading_rad = motion.RpyAt(first).z();
  const auto pose_at = [&](Time t) -> std::optional<Eigen::Isometry3d> {
    const Time at = rule.once ? first : first + (t - ping.time);
    return MakePose(Eigen::Vector3d::Zero(), motion.RotationAt(at, heading_rad));
  };
  const auto result = Georeference(ping, pose_at, {}, RayTracer::Constant(ping.sound_speed_mps));
  double n = 0.0, y = 0.0, z = 0.0, yy = 0.0, yz = 0.0;
  for (const Sounding& s : result->soundings) {
    n += 1.0;
    y += s.p_map.y();
    z += s.p_map.z();
    yy += s.p_map.y() * s.p_map.y();
    yz += s.p_map.y() * s.p_map.z();
  }
  return std::atan((n * yz - y * z) / (n * yy - y * y));
}

double SlopeChangeRmsDeg(const SurveyContents& file, AttitudeRule rule) {
  const Motion motion(file.All<NavigationRecord>(), "xtf_attitude");
  std::vector<double> slopes;
  for (const MbesPing& ping : file.All<MbesPing>())
    if (const auto slope = SlopeAcross(ping, motion, rule)) slopes.push_back(*slope);
  EXPECT_GT(slopes.size(), 900u);
  double sum = 0.0;
  for (std::size_t i = 1; i < slopes.size(); ++i)
    sum += (slopes[i] - slopes[i - 1]) * (slopes[i] - slopes[i - 1]);
  return Rad2Deg(std::sqrt(sum / static_cast<double>(slopes.size() - 1)));
}

// With one attitude for the whole ping, it fits best when it is taken 22 ms later. That is when the
// echoes come: with the attitude of each echo's own time nothing is left of it.
TEST(XtfFile, TheFlatBedKeepsItsSlopeFromPingToPing) {
  SKIP_WITHOUT(Shared(kRealFile));
  const auto file = RealFile();
  std::printf(
      "slope across changes from ping to ping, deg RMS\n"
      "attitude later by, ms   once a ping   at each echo\n");
  for (const int later_ms : {-22, -10, 0, 10, 22, 34})
    std::printf("%21d   %11.4f   %12.4f\n",
                later_ms,
                SlopeChangeRmsDeg(file, {1e-3 * later_ms, true}),
                SlopeChangeRmsDeg(file, {1e-3 * later_ms, false}));
  EXPECT_LE(SlopeChangeRmsDeg(file, {0.022, true}), 0.009);
  EXPECT_LE(SlopeChangeRmsDeg(file, {0.0, false}), 0.009);
  EXPECT_GT(SlopeChangeRmsDeg(file, {0.0, true}), 0.012);
}

// --- made here --------------------------------------------------------------------------------

ByteVector FileHeader(std::uint16_t navigation_units, std::uint16_t channels) {
  ByteWriter out;
  out.Le(std::uint8_t{123});
  out.Zeros(163);
  out.Le(navigation_units);
  out.Le(std::uint16_t{0});
  out.Le(channels);
  out.Zeros((channels > 6 ? 2048 : 1024) - out.size());
  return out.Release();
}

ByteVector Packet(std::uint8_t type, const ByteWriter& content, std::size_t padded_to = 64) {
  const std::size_t size = std::max(padded_to, 14 + content.size());
  ByteWriter out;
  out.Le(std::uint16_t{0xFACE});
  out.Le(type);
  out.Zeros(7);
  out.Le(static_cast<std::uint32_t>(size));
  out.Append(content.bytes());
  out.Zeros(size - out.size());
  return out.Release();
}

ByteVector PingPacket(std::uint8_t type = 65,
                      Time time = FromUtime(1'700'000'000'000'000),
                      const ByteVector& time_of_packet = {}) {
  MbesPing ping;
  ping.time = time;
  ping.sound_speed_mps = 1500.0;
  for (int i = 0; i < 12; ++i) {
    MbesBeam beam;
    beam.twtt_s = 0.05f;
    beam.rx_angle_rad = 0.1f * static_cast<float>(i);
    beam.flags = kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  ByteWriter content;
  content.Append(time_of_packet);
  content.Zeros(242 - content.size());
  content.Append(EncodeBth0(ping));
  return Packet(type, content, 1024);
}

ByteVector PositionPacket(std::uint8_t month = 2) {
  ByteWriter content;
  content.Le(std::uint16_t{2024});
  for (const std::uint8_t part :
       {month, std::uint8_t{29}, std::uint8_t{23}, std::uint8_t{59}, std::uint8_t{59}})
    content.Le(part);
  content.Le(std::uint16_t{9999});
  content.Le(-33.5);
  content.Le(151.25);
  content.Le(12.0);
  return Packet(107, content);
}

ByteVector Join(std::initializer_list<ByteVector> parts) {
  ByteVector all;
  for (const ByteVector& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(XtfFile, PositionsOfAGridAreNotTakenForDegrees) {
  const auto degrees = ReadSurvey<XtfFileReader>(Join({FileHeader(3, 1), PositionPacket()}));
  const NavigationRecord sample = degrees.All<NavigationRecord>().at(0);
  EXPECT_EQ(ToUtime(sample.time), 1'709'251'199'999'900);
  EXPECT_NEAR(sample.position->latitude_rad, Deg2Rad(-33.5), 1e-15);
  const auto metres = ReadSurvey<XtfFileReader>(Join({FileHeader(0, 1), PositionPacket()}));
  EXPECT_TRUE(metres.records.empty());
  EXPECT_EQ(metres.counters, (Counters{{"xtf_position_not_geographic", 1}}));
}

TEST(XtfFile, ALongHeaderUnknownPacketsAndImpossibleDates) {
  const auto file = ReadSurvey<XtfFileReader>(Join({FileHeader(3, 8),
                                                    Packet(0, {}),
                                                    Packet(42, {}),
                                                    Packet(42, {}),
                                                    PositionPacket(13),
                                                    PingPacket()}));
  EXPECT_EQ(file.All<MbesPing>().size(), 1u);
  EXPECT_EQ(file.counters,
            (Counters{{"xtf_ignored_42", 2}, {"xtf_ignored_sonar", 1}, {"xtf_malformed", 1}}));
}

TEST(XtfFile, ASonarWhoseClockIsNotSetHasTheTimeOfItsPackets) {
  // 2023-11-14 22:13:20.25
  const ByteVector packet_time{0xE7, 0x07, 11, 14, 22, 13, 20, 25};
  const Time right = FromUtime(1'700'000'000'250'000);
  const auto time_of = [&](Time of_sonar) {
    const auto file =
        ReadSurvey<XtfFileReader>(Join({FileHeader(3, 1), PingPacket(65, of_sonar, packet_time)}));
    EXPECT_EQ(file.counters.contains("stamps_wrong"),
              std::chrono::abs(of_sonar - right) > std::chrono::minutes(1));
    return file.All<MbesPing>().at(0).time;
  };
  EXPECT_EQ(time_of(right - std::chrono::days(100)), right);
  EXPECT_EQ(time_of(FromUtime(5'000'000)), right);
  const Time near = right + std::chrono::milliseconds(123);
  EXPECT_EQ(time_of(near), near);
}

TEST(XtfFile, TritonsPacketIsReadIfItHoldsADatagramOfTheSonar) {
  ByteVector other = PingPacket(68);
  other[256] = 'X';
  const auto file =
      ReadSurvey<XtfFileReader>(Join({FileHeader(3, 1), PingPacket(68), other, PingPacket(68)}));
  EXPECT_EQ(file.All<MbesPing>().size(), 2u);
  EXPECT_EQ(file.counters, (Counters{{"xtf_ignored_r2sonic", 1}}));
}

TEST(XtfFile, AnyPiecesAndAnyDamage) {
  ExpectRobust(Join({FileHeader(3, 1),
                     PingPacket(),
                     PositionPacket(),
                     PingPacket(),
                     PositionPacket(),
                     Packet(3, {}),
                     PingPacket()}),
               [] { return std::make_unique<XtfFileReader>(); });
}

}  // namespace
}  // namespace seastitch
