// The decoders that lcm-gen writes, after cmake/HardenLcmType.cmake: no byte of a message makes
// them throw, read past the end or allocate more than the message could hold.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "common/convert/convert.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/health_t.hpp"

namespace seastitch {
namespace {

template <class Msg>
std::vector<std::uint8_t> Encoded(const Msg& msg) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Msg>
int Decode(const std::vector<std::uint8_t>& bytes) {
  // A heap block of exactly this size, so that the address sanitizer sees a step past its end.
  const std::vector<std::uint8_t> exact(bytes);
  Msg msg{};
  return msg.decode(exact.data(), 0, static_cast<int>(exact.size()));
}

template <class Msg>
void ExpectNoMessageHurts(const Msg& good) {
  const std::vector<std::uint8_t> bytes = Encoded(good);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_LT(Decode<Msg>({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), 0);
  // Every aligned word once as each count that hurts: -1, the largest, and 2^30, which times four
  // is zero in 32 bits.
  for (std::size_t at = 8; at + 4 <= bytes.size(); ++at)
    for (const std::uint32_t count : {0xffffffffu, 0x7fffffffu, 0x40000000u, 0u}) {
      std::vector<std::uint8_t> bad = bytes;
      for (std::size_t i = 0; i < 4; ++i)
        bad[at + i] = static_cast<std::uint8_t>(count >> (24 - 8 * i));
      EXPECT_NO_THROW(Decode<Msg>(bad)) << Msg::getTypeName() << " at " << at;
    }
}

const Time kTime = FromUtime(1'700'000'000'000'000);
const covariance_request_t kRequest =
    ToLcm(CovarianceRequest{"mapper", 0, 1, {{SubmapId{0}, SubmapId{1}}}}, kTime);
const covariances_t kAnswer = ToLcm(
    PairCovariances{"mapper", 0, 1, {{SubmapId{0}, SubmapId{1}, Eigen::Matrix3d::Identity()}}},
    kTime,
    0);

TEST(HostileMessages, HurtNoDecoder) {
  ImuSample imu;
  imu.time = kTime;
  ExpectNoMessageHurts(ToLcm(imu, {}));
  MbesPing ping;
  ping.beams.resize(5);
  ExpectNoMessageHurts(ToLcm(ping, {}));
  ExpectNoMessageHurts(ToLcm(SoundVelocityProfile{kTime, {1, 2, 3}, {1500, 1500, 1500}}, {}));
  ExpectNoMessageHurts(ToLcm(PositionFix{kTime, 0, 0, Eigen::Matrix2d::Identity(), "gps"}, {}));
  Submap submap;
  submap.footprint = {{0, 0}, {1, 0}, {1, 1}};
  for (int i = 0; i < 5; ++i) submap.cloud.Add({1, 2, 3});
  ExpectNoMessageHurts(ToLcm(submap, 0, 0).announcement);
  ExpectNoMessageHurts(ToLcm(submap, 0, 0).chunks[0]);
  GraphUpdate update;
  update.vertices.resize(2);
  update.edges.resize(2);
  ExpectNoMessageHurts(ToLcm(update, kTime, 0));
  PoseGraph graph;
  graph.vertices.resize(2);
  graph.loop_edges.resize(2);
  ExpectNoMessageHurts(ToLcm(graph, 0, kTime, 0)[0]);
  ExpectNoMessageHurts(ToRawParts({1, 2, 3}, "can:can0", kTime, 0)[0]);
  health_t health{};
  health.process = "mapper";
  health.text = "ok";
  health.num_counters = health.num_rates = 2;
  health.counters.resize(2);
  health.rate_names = {"imu", "dvl"};
  health.rate_hz = {1.0, 2.0};
  ExpectNoMessageHurts(health);
  ExpectNoMessageHurts(graph_request_t{});
  ExpectNoMessageHurts(kRequest);
  ExpectNoMessageHurts(kAnswer);
}

// FromLcm and the assemblers behind the decoder: whatever decodes is judged, never trusted.
template <class Msg, class Judge>
void ExpectNoFlippedBitThrows(const Msg& good, Judge judge) {
  std::mt19937 random(3);
  const std::vector<std::uint8_t> bytes = Encoded(good);
  int decoded = 0;
  for (int i = 0; i < 5'000; ++i) {
    std::vector<std::uint8_t> bad = bytes;
    const std::size_t bit = 64 + random() % (8 * (bytes.size() - 8));
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    Msg msg{};
    if (msg.decode(bad.data(), 0, static_cast<int>(bad.size())) < 0) continue;
    ++decoded;
    EXPECT_NO_THROW(judge(msg)) << Msg::getTypeName() << ", bit " << bit;
  }
  EXPECT_GT(decoded, 1'000) << Msg::getTypeName();
}

TEST(HostileMessages, WithFlippedBitsNeverThrow) {
  const auto convert = [](const auto& msg) { FromLcm(msg); };
  MbesPing ping;
  ping.time = kTime;
  ping.sound_speed_mps = 1500.0;
  ping.beams.resize(5);
  ExpectNoFlippedBitThrows(ToLcm(ping, {}), convert);
  Submap submap;
  submap.id = SubmapId{0};
  submap.start = submap.end = submap.frame_time = kTime;
  for (int i = 0; i < 5; ++i) submap.cloud.Add({1, 2, 3});
  const SubmapMessages messages = ToLcm(submap, 0, 0);
  SubmapAssembler submaps;
  ExpectNoFlippedBitThrows(messages.announcement, [&](const submap_t& m) { submaps.Add(m); });
  ExpectNoFlippedBitThrows(messages.chunks[0], [&](const submap_points_t& m) {
    submaps.Add(messages.announcement);
    submaps.Add(m);
  });
  GraphUpdate update{1, {{SubmapId{0}, kTime, {}}}, {}};
  update.edges.resize(1);
  update.edges[0].from = SubmapId{0};
  update.edges[0].to = SubmapId{1};
  ExpectNoFlippedBitThrows(ToLcm(update, kTime, 0), convert);
  PoseGraph graph;
  graph.vertices.resize(1);
  graph.loop_edges = {{SubmapId{0}, SubmapId{1}, 1.0}};
  PoseGraphAssembler graphs;
  ExpectNoFlippedBitThrows(ToLcm(graph, 0, kTime, 0)[0],
                           [&](const pose_graph_t& m) { graphs.Add(m); });
  ExpectNoFlippedBitThrows(kRequest, convert);
  ExpectNoFlippedBitThrows(kAnswer, convert);
}

}  // namespace
}  // namespace seastitch
