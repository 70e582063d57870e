#include "drivers/can/nmea2000.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/core/pose.hpp"
#include "drivers/dvl/dvl_nmea2000.hpp"
#include "drivers/imu/imu_nmea2000.hpp"
#include "drivers/socket/candump.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000;

Time At(int ms) { return FromUtime(kStart + 1000 * std::int64_t{ms}); }

CanFrame Frame(const std::string& id_hex, const std::string& data_hex) {
  CanFrame frame;
  frame.extended = true;
  frame.id = static_cast<std::uint32_t>(std::stoul(id_hex, nullptr, 16));
  frame.SetData(FromHex(data_hex));
  return frame;
}

std::vector<CandumpLine> Candump(const std::string& name) {
  std::vector<CandumpLine> lines;
  std::ifstream in(Shared("vectors/nmea2000/" + name));
  for (std::string line; std::getline(in, line);)
    if (const auto parsed = ParseCandumpLine(line)) lines.push_back(*parsed);
  return lines;
}

DvlSample Moving(int i) {
  DvlSample sample;
  sample.bottom_lock = true;
  sample.v_dvl_mps = {1.5 + 0.001 * i, -0.25, 0.0};
  sample.altitude_m = 12.34;
  return sample;
}

ImuSample Turning(int i) {
  ImuSample sample;
  sample.attitude.emplace().q_ned_imu = RotationFromRpy(0.1, -0.05, -3.0 + 0.01 * i);
  sample.angular_rate_radps =
      sample.attitude->q_ned_imu.inverse() * Eigen::Vector3d(0.0, 0.0, 0.02 * i);
  return sample;
}

TEST(Nmea2000, IdsHavePriorityGroupAndSource) {
  const N2kMessage broadcast = ReadN2kId(0x09FE1223);
  EXPECT_EQ(broadcast.priority, 2);
  EXPECT_EQ(broadcast.pgn, 130578u);
  EXPECT_EQ(broadcast.source, 0x23);
  EXPECT_EQ(ReadN2kId(0x0DEDCC00).pgn, 126208u);  // to address 0xCC
  EXPECT_TRUE(Passes({N2kFilter(130578)}, Frame("09FE1223", "00")));
  EXPECT_TRUE(Passes({N2kFilter(130578)}, Frame("1DFE1299", "00")));
  EXPECT_FALSE(Passes({N2kFilter(130578)}, Frame("09FE1123", "00")));
  EXPECT_TRUE(Passes({N2kFilter(126208)}, Frame("0DEDCC00", "00")));
}

TEST(Nmea2000, GoldenPayloadsBecomeTheGoldenFramesAndBack) {
  SKIP_WITHOUT(Shared("vectors/nmea2000"));
  int fast_packets = 0;
  for (const auto& vector : ReadJson(Shared("vectors/nmea2000/n2k_vectors.json"))) {
    N2kMessage message{
        vector["pgn"], vector["source"], vector["priority"], FromHex(vector["payload"])};
    const bool fast = vector["frames"].size() > 1;
    const int sequence = FromHex(vector["frames"][0])[0] >> 5;
    const std::vector<CanFrame> frames = EncodeN2k(message, fast, sequence);
    ASSERT_EQ(frames.size(), vector["frames"].size());
    N2kFastPackets packets;
    std::optional<N2kMessage> joined;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_EQ(frames[i], Frame(vector["can_id"], vector["frames"][i]));
      if (fast) joined = packets.Add(frames[i], At(0));
    }
    if (!fast) continue;
    ++fast_packets;
    ASSERT_TRUE(joined);
    EXPECT_EQ(joined->data, message.data);
    EXPECT_EQ(joined->pgn, message.pgn);
    EXPECT_TRUE(packets.counters().empty());
  }
  EXPECT_GE(fast_packets, 3);
}

TEST(Nmea2000, AnyPayloadComesBackAndALostFrameIsCounted) {
  EXPECT_TRUE(rc::check([] {
    N2kMessage message{130578, 7, 2, {}};
    message.data.resize(*rc::gen::inRange<std::size_t>(0, 224));
    for (std::uint8_t& byte : message.data) byte = *rc::gen::arbitrary<std::uint8_t>();
    std::vector<CanFrame> frames = EncodeN2k(message, true, *rc::gen::inRange(0, 8));
    N2kFastPackets packets;
    std::optional<N2kMessage> joined;
    for (const CanFrame& frame : frames) joined = packets.Add(frame, At(0));
    RC_ASSERT(joined.has_value());
    RC_ASSERT(joined->data == message.data);

    const auto lost = *rc::gen::inRange<std::size_t>(0, frames.size());
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(lost));
    for (const CanFrame& frame : frames) RC_ASSERT(!packets.Add(frame, At(1)).has_value());
    joined.reset();
    for (const CanFrame& frame : EncodeN2k(message, true, 0)) joined = packets.Add(frame, At(2));
    RC_ASSERT(joined.has_value());
  }));
}

TEST(Nmea2000, APacketThatStallsOrIsCutIsDropped) {
  const N2kMessage message{130578, 7, 2, std::vector<std::uint8_t>(20, 1)};
  const std::vector<CanFrame> frames = EncodeN2k(message, true, 3);
  N2kFastPackets packets;
  packets.Add(frames[0], At(0));
  packets.Add(frames[1], At(0));
  EXPECT_FALSE(packets.Add(frames[2], At(600)));
  for (const CanFrame& frame : frames) {
    for (std::uint8_t n = 0; n < 8; ++n) {
      CanFrame cut = frame;
      cut.length = n;
      N2kFastPackets fresh;
      fresh.Add(frames[0], At(0));
      EXPECT_FALSE(fresh.Add(cut, At(0)));
    }
  }
  EXPECT_EQ(packets.counters(), (Counters{{"n2k_fast_packet_incomplete", 1}}));
}

TEST(DvlNmea2000, GoldenSpeedAndDepth) {
  SKIP_WITHOUT(Shared("vectors/nmea2000"));
  DvlN2kParams params;
  params.max_depth_age_s = 1.0;
  params.clock.latency_s = 0.15;
  DvlN2kDecoder decoder(params);
  std::vector<DvlSample> samples;
  std::vector<CandumpLine> lines = Candump("n2k_vectors.candump.log");
  lines.insert(lines.begin(), lines[5]);  // the depth once more, before the speeds
  for (const CandumpLine& line : lines)
    if (const DvlOutput output = decoder.Add(line.frame, line.time); output.dvl)
      samples.push_back(*output.dvl);
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_TRUE(samples[0].bottom_lock);
  EXPECT_LT((samples[0].v_dvl_mps - Eigen::Vector3d(1.234, -0.567, 0.0)).norm(), 1e-12);
  EXPECT_EQ(samples[0].sigma_v_mps, Eigen::Vector3d(0.05, 0.05, 1.0));
  EXPECT_EQ(ToUtime(samples[0].time), kStart + 1000 - 150'000);
  EXPECT_NEAR(samples[0].altitude_m.value(), 37.42, 1e-12);
  EXPECT_FALSE(samples[1].bottom_lock);  // water track only
  EXPECT_TRUE(decoder.counters().empty());
}

TEST(DvlNmea2000, RealPayloads) {
  SKIP_WITHOUT(Shared("vectors/nmea2000"));
  int speeds = 0;
  for (const auto& real : ReadJson(Shared("vectors/nmea2000/real_payloads.json"))) {
    if (real["pgn"] != kPgnVesselSpeed) continue;
    DvlN2kDecoder decoder({});
    DvlOutput output;
    for (const CanFrame& frame :
         EncodeN2k({kPgnVesselSpeed, 14, 2, FromHex(real["payload"])}, true))
      output = decoder.Add(frame, At(0));
    ASSERT_TRUE(output.dvl);
    ++speeds;
    const auto& expected = real["expected"];
    const bool ground = expected.contains("Longitudinal Speed, Ground-referenced") &&
                        expected.contains("Transverse Speed, Ground-referenced");
    ASSERT_EQ(output.dvl->bottom_lock, ground);
    if (!ground) continue;
    EXPECT_NEAR(output.dvl->v_dvl_mps.x(),
                expected["Longitudinal Speed, Ground-referenced"].get<double>(),
                1e-12);
    EXPECT_NEAR(output.dvl->v_dvl_mps.y(),
                expected["Transverse Speed, Ground-referenced"].get<double>(),
                1e-12);
  }
  EXPECT_GE(speeds, 3);
}

TEST(DvlNmea2000, SpeedsComeBackAndAnOldDepthIsLeftOut) {
  DvlN2kDecoder decoder({});
  for (int i = 0; i < 20; ++i) {
    std::optional<DvlSample> given;
    for (const CanFrame& frame : EncodeDvlN2k(Moving(i), 9, i))
      if (const DvlOutput output = decoder.Add(frame, At(250 * i)); output.dvl) given = output.dvl;
    ASSERT_TRUE(given);
    EXPECT_LT((given->v_dvl_mps - Moving(i).v_dvl_mps).norm(), 1e-9);
    EXPECT_NEAR(given->altitude_m.value(), 12.34, 1e-9);
  }
  DvlSample without = Moving(0);
  without.altitude_m.reset();
  std::optional<DvlSample> given;
  for (const CanFrame& frame : EncodeDvlN2k(without, 9, 0))
    if (const DvlOutput output = decoder.Add(frame, At(6000)); output.dvl) given = output.dvl;
  ASSERT_TRUE(given);
  EXPECT_FALSE(given->altitude_m);
  EXPECT_TRUE(decoder.counters().empty());
}

TEST(DvlNmea2000, AnotherDeviceOnTheBusIsNotTheLog) {
  DvlN2kParams params;
  params.source = 9;
  DvlN2kDecoder decoder(params);
  for (const CanFrame& frame : EncodeDvlN2k(Moving(0), 10, 0))
    EXPECT_FALSE(decoder.Add(frame, At(0)).dvl);
}

TEST(ImuNmea2000, GoldenAttitudeAndRateOfTurn) {
  SKIP_WITHOUT(Shared("vectors/nmea2000"));
  ImuN2kParams params;
  params.max_epoch_s = 0.2;  // the golden frames are 50 ms apart
  ImuN2kDecoder decoder(params);
  std::optional<ImuSample> sample;
  for (const CandumpLine& line : Candump("n2k_vectors.candump.log"))
    if (const auto given = decoder.Add(line.frame, line.time)) sample = given;
  ASSERT_TRUE(sample);
  const Eigen::Quaterniond q(RotationFromRpy(-0.0873, 0.0524, -3.1));
  EXPECT_LT(sample->attitude->q_ned_imu.angularDistance(q), 1e-9);
  EXPECT_LT((q * sample->angular_rate_radps - Eigen::Vector3d(0, 0, -0.0125)).norm(), 1e-7);
  EXPECT_LT((q * sample->specific_force_mps2 - Eigen::Vector3d(0, 0, -9.80665)).norm(), 1e-12);
}

TEST(ImuNmea2000, ARealBusGivesEveryPairOfGroups) {
  SKIP_WITHOUT(Shared("vectors/nmea2000"));
  ImuN2kParams params;
  params.source = 0xCC;
  ImuN2kDecoder decoder(params);
  std::vector<ImuSample> samples;
  for (const CandumpLine& line : Candump("real_candump_canboat.log"))
    if (const auto given = decoder.Add(line.frame, line.time)) samples.push_back(*given);
  ASSERT_EQ(samples.size(), 19u);  // as canboat counts them
  const Eigen::Quaterniond first(RotationFromRpy(0.1279, -0.2054, 2.3154));
  EXPECT_LT(samples[0].attitude->q_ned_imu.angularDistance(first), 1e-9);
  EXPECT_NEAR((first * samples[0].angular_rate_radps).z(), 0.00180662, 1e-8);
  EXPECT_TRUE(decoder.counters().empty());
}

TEST(ImuNmea2000, MeasurementsComeBackAndAMissingGroupNeverMixesTwo) {
  EXPECT_TRUE(rc::check([] {
    ImuN2kDecoder decoder({});
    int lost = 0;
    int given = 0;
    for (int i = 0; i < 50; ++i) {
      const auto frames = EncodeImuN2k(Turning(i), 9, static_cast<std::uint8_t>(i));
      const bool drop_rate = *rc::gen::weightedElement<bool>({{6, false}, {1, true}});
      const bool drop_attitude = *rc::gen::weightedElement<bool>({{6, false}, {1, true}});
      lost += drop_rate || drop_attitude ? 1 : 0;
      std::optional<ImuSample> sample;
      for (std::size_t k = 0; k < 2; ++k) {
        if (k == 0 ? drop_rate : drop_attitude) continue;
        if (const auto out = decoder.Add(frames[k], At(10 * i))) sample = out;
      }
      RC_ASSERT(sample.has_value() == !(drop_rate || drop_attitude));
      if (!sample) continue;
      ++given;
      RC_ASSERT(sample->attitude->q_ned_imu.angularDistance(Turning(i).attitude->q_ned_imu) < 2e-4);
      RC_ASSERT((sample->angular_rate_radps - Turning(i).angular_rate_radps).norm() < 1e-5);
    }
    RC_ASSERT(given == 50 - lost);
  }));
}

TEST(ImuNmea2000, EveryTruncationIsRefusedAndCounted) {
  for (const CanFrame& frame : EncodeImuN2k(Turning(1), 9, 1)) {
    const std::uint8_t needed = ReadN2kId(frame.id).pgn == kPgnRateOfTurn ? 5 : 7;
    for (std::uint8_t n = 0; n < needed; ++n) {
      CanFrame cut = frame;
      cut.length = n;
      ImuN2kDecoder decoder({});
      EXPECT_FALSE(decoder.Add(cut, At(0)));
      EXPECT_EQ(decoder.counters(), (Counters{{"imu_frame_malformed", 1}}));
    }
  }
}

}  // namespace
}  // namespace seastitch
