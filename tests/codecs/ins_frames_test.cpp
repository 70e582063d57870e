// Binary protocols of INS: iXblue's standard binary (real frames), Kongsberg's KM binary.
#include <gtest/gtest.h>

#include <cmath>

#include "codecs/frame_stream.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/navigation/phins.hpp"
#include "common/core/pose.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

std::filesystem::path Golden(const std::string& name) { return Shared("vectors/survey/" + name); }

// Heading, roll, pitch as PHINS writes them.
Eigen::Vector3d HrpDeg(const Attitude& attitude) {
  const Eigen::Vector3d rpy = RpyFromRotation(attitude.q_ned_imu.toRotationMatrix()) * Rad2Deg(1.0);
  return {rpy.z() < 0.0 ? rpy.z() + 360.0 : rpy.z(), rpy.x(), -rpy.y()};
}

class RealPhins : public testing::TestWithParam<int> {};

TEST_P(RealPhins, FramesAreReadAsTheMakersOwnDecoderReadsThem) {
  const std::string name = "real_stdv" + std::to_string(GetParam()) + ".bin";
  SKIP_WITHOUT(Golden("phins/" + name));
  const auto golden = ReadJson(Golden("phins/real.json"))[name];
  const auto bytes = BytesOf(Golden("phins/" + name));
  const auto frame = DecodePhins(bytes);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->version, golden["version"]);
  EXPECT_EQ(frame->counter, golden["counter"]);
  EXPECT_EQ(frame->valid_at.count(), golden["validity_100us"].get<std::int64_t>() * 100);
  ASSERT_TRUE(frame->attitude && frame->position && frame->velocity && frame->midnight);
  const Eigen::Vector3d hrp_deg = HrpDeg(*frame->attitude);
  EXPECT_NEAR(
      std::remainder(hrp_deg.x() - golden["attitude"]["heading"].get<double>(), 360.0), 0.0, 1e-9);
  EXPECT_NEAR(hrp_deg.y(), golden["attitude"]["roll"], 1e-9);
  EXPECT_NEAR(hrp_deg.z(), golden["attitude"]["pitch"], 1e-9);
  EXPECT_NEAR(Rad2Deg(frame->attitude->sigma_rpy_rad.z()), golden["attitude_sd"]["heading"], 1e-9);
  EXPECT_NEAR(Rad2Deg(frame->position->latitude_rad), golden["position"]["lat"], 1e-12);
  EXPECT_NEAR(Rad2Deg(frame->position->longitude_rad), golden["position"]["lon"], 1e-12);
  EXPECT_EQ(frame->position->sigma_north_east_m.x(), golden["position_sd"]["n"]);
  EXPECT_EQ(*frame->altitude_m, golden["position"]["alt"]);
  EXPECT_EQ(frame->altitude_is_above_ellipsoid, golden["position"]["ref"] == 1);
  EXPECT_EQ(frame->velocity->v_ned_mps.x(), golden["speed_geo"]["north"]);
  EXPECT_EQ(frame->velocity->v_ned_mps.z(), -golden["speed_geo"]["up"].get<double>());
  EXPECT_EQ(frame->velocity->sigma_ned_mps.y(), golden["speed_geo_sd"]["e"]);
  const auto& date = golden["date"];
  EXPECT_EQ(
      *frame->midnight, *[&] {
        const std::chrono::sys_days day =
            std::chrono::year(date["y"].get<int>()) / date["m"].get<int>() / date["d"].get<int>();
        return std::optional(FromUtime(
            std::chrono::duration_cast<std::chrono::microseconds>(day.time_since_epoch()).count()));
      }());
  // Bits 26 and 27 of all four: attitude invalid, alignment.
  EXPECT_EQ(frame->status, InsStatus::kAligning);
}

TEST_P(RealPhins, NoCutAndNoFlippedByteIsRead) {
  const std::string name = "real_stdv" + std::to_string(GetParam()) + ".bin";
  SKIP_WITHOUT(Golden("phins/" + name));
  const auto bytes = BytesOf(Golden("phins/" + name));
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(DecodePhins(Bytes(bytes).first(n)));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_FALSE(DecodePhins(damaged)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, RealPhins, testing::Values(2, 3, 4, 5));

TEST(Phins, SyntheticFrameWithADepth) {
  SKIP_WITHOUT(Golden("phins/synthetic_v3.bin"));
  const auto golden = ReadJson(Golden("phins/synthetic_v3.json"));
  const auto frame = DecodePhins(BytesOf(Golden("phins/synthetic_v3.bin")));
  ASSERT_TRUE(frame && frame->attitude && frame->position && frame->sensor_depth);
  EXPECT_EQ(ToSeconds(frame->valid_at), golden["validity_s"]);
  EXPECT_TRUE(HrpDeg(*frame->attitude)
                  .isApprox(Eigen::Vector3d(golden["heading"].get<double>(),
                                            golden["roll"].get<double>(),
                                            golden["pitch_bow_down"].get<double>()),
                            1e-9));
  EXPECT_NEAR(Rad2Deg(frame->position->latitude_rad), golden["lat"], 1e-12);
  EXPECT_EQ(*frame->altitude_m, golden["altitude"]);
  EXPECT_TRUE(frame->altitude_is_above_ellipsoid);
  EXPECT_EQ(frame->velocity->v_ned_mps,
            Eigen::Vector3d(golden["vel_neu"][0].get<double>(),
                            golden["vel_neu"][1].get<double>(),
                            -golden["vel_neu"][2].get<double>()));
  EXPECT_EQ(frame->sensor_depth->value_m, golden["depth"]["m"]);
  EXPECT_EQ(frame->sensor_depth->sigma_m, golden["depth"]["std"]);
  EXPECT_NEAR(ToSeconds(frame->sensor_depth_at), golden["depth"]["validity_s"], 1e-9);
}

TEST(KmBinary, GoldenDatagram) {
  SKIP_WITHOUT(Golden("nav/synthetic_kmb.bin"));
  const auto golden = ReadJson(Golden("nav/kmb.json"));
  const auto bytes = BytesOf(Golden("nav/synthetic_kmb.bin"));
  const auto record = DecodeKmBinary(bytes);
  ASSERT_TRUE(record && record->position && record->attitude && record->velocity);
  EXPECT_EQ(ToUtime(record->time),
            golden["utc"][0].get<std::int64_t>() * 1'000'000 +
                golden["utc"][1].get<std::int64_t>() / 1000);
  EXPECT_NEAR(Rad2Deg(record->position->latitude_rad), golden["lat"], 1e-12);
  EXPECT_EQ(record->position->sigma_north_east_m, Eigen::Vector2d::Zero()) << "called invalid";
  const Eigen::Vector3d hrp_deg = HrpDeg(*record->attitude);
  EXPECT_NEAR(hrp_deg.x(), golden["heading"], 1e-9);
  EXPECT_NEAR(hrp_deg.y(), golden["roll"], 1e-9);
  EXPECT_NEAR(-hrp_deg.z(), golden["pitch"], 1e-9) << "bow up";
  EXPECT_EQ(record->velocity->v_ned_mps.y(), golden["vel_ned"][1]);
  EXPECT_EQ(*record->height_m, golden["height"]);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(DecodeKmBinary(Bytes(bytes).first(n)));
}

// --- out of a stream -----------------------------------------------------------------------------

TEST(FrameStream, FramesAmongNoiseInPiecesOfAnySize) {
  SKIP_WITHOUT(Golden("phins/synthetic_v3.bin"));
  const auto frame = BytesOf(Golden("phins/synthetic_v3.bin"));
  std::vector<std::uint8_t> stream{'I', 'X', 3, 'x', 'A'};
  stream.insert(stream.end(), frame.begin(), frame.end());
  stream.insert(stream.end(), frame.begin(), frame.begin() + 40);  // one is cut
  for (int i = 0; i < 30; ++i) stream.insert(stream.end(), frame.begin(), frame.end());
  for (std::size_t size = 1; size < stream.size(); size = 2 * size + 1) {
    FrameStream frames(SizeOfPhins);
    std::size_t found = 0;
    for (std::size_t at = 0; at < stream.size(); at += size) {
      const auto now = FromUtime(static_cast<std::int64_t>(at));
      for (const auto& one :
           frames.Add(Bytes(stream).subspan(at, std::min(size, stream.size() - at)), now)) {
        EXPECT_EQ(one.bytes, frame);
        EXPECT_LE(one.recv, now);
        ++found;
      }
    }
    EXPECT_EQ(found, 31u) << size;
    EXPECT_EQ(frames.skipped_bytes(), 45) << size;
  }
}

TEST(FrameStream, AFrameHasTheStampOfThePieceInWhichItBegan) {
  SKIP_WITHOUT(Golden("nav/synthetic_kmb.bin"));
  const auto frame = BytesOf(Golden("nav/synthetic_kmb.bin"));
  FrameStream frames(SizeOfKmBinary);
  EXPECT_TRUE(frames.Add(Bytes(frame).first(50), FromUtime(1)).empty());
  auto rest = std::vector<std::uint8_t>(frame.begin() + 50, frame.end());
  rest.insert(rest.end(), frame.begin(), frame.end());
  const auto both = frames.Add(rest, FromUtime(2));
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].recv, FromUtime(1));
  EXPECT_EQ(both[1].recv, FromUtime(2));
}

}  // namespace
}  // namespace seastitch
