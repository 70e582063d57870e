#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "common/convert/convert.hpp"

namespace seastitch {
namespace {

Submap MakeSubmap(int points) {
  Submap submap;
  submap.id = SubmapId{3};
  submap.start = FromUtime(1'700'000'000'000'000);
  submap.frame_time = submap.start + Duration(5);
  submap.end = submap.start + Duration(9);
  submap.T_map_submap = MakePose({10.0, 20.0, 30.0}, RotationFromRpy(0.02, -0.03, 1.0));
  submap.covariance_from_previous = Eigen::Matrix3d(Eigen::Vector3d(1.0, 2.0, 0.1).asDiagonal());
  submap.heading_sigma_rad = 0.02;
  submap.predicted_information = Eigen::Matrix3d(Eigen::Vector3d(50.0, 60.0, 9000.0).asDiagonal());
  submap.trigger = SubmapTrigger::kTurn;
  submap.soundings_read = 100'000;
  submap.soundings_used = 90'000;
  submap.footprint = {{0.0, 0.0}, {30.0, 0.0}, {30.0, 40.0}};
  for (int i = 0; i < points; ++i)
    submap.cloud.Add({0.1f * static_cast<float>(i), -1.5f, 8.0f}, 1.0f + static_cast<float>(i % 7));
  return submap;
}

std::optional<Submap> Assemble(const SubmapMessages& messages, SubmapAssembler* assembler) {
  std::optional<Submap> whole = assembler->Add(messages.announcement);
  for (const submap_points_t& chunk : messages.chunks) {
    EXPECT_FALSE(whole) << "complete too early";
    whole = assembler->Add(chunk);
  }
  return whole;
}

TEST(SubmapAssembler, GivesBackTheSubmapWhateverItsSize) {
  for (const int points : {0, 1, kMaxPointsPerChunk, kMaxPointsPerChunk + 1, 20'000}) {
    const Submap submap = MakeSubmap(points);
    const SubmapMessages messages = ToLcm(submap, 0, 0);
    for (const submap_points_t& chunk : messages.chunks) EXPECT_LT(chunk.getEncodedSize(), 60'000);
    SubmapAssembler assembler;
    const auto back = Assemble(messages, &assembler);
    ASSERT_TRUE(back) << points;
    EXPECT_EQ(back->id, submap.id);
    EXPECT_EQ(back->start, submap.start);
    EXPECT_EQ(back->frame_time, submap.frame_time);
    EXPECT_EQ(back->end, submap.end);
    EXPECT_TRUE(back->T_map_submap.isApprox(submap.T_map_submap, 1e-14));
    EXPECT_EQ(back->covariance_from_previous, submap.covariance_from_previous);
    EXPECT_EQ(back->heading_sigma_rad, submap.heading_sigma_rad);
    EXPECT_EQ(back->predicted_information, submap.predicted_information);
    EXPECT_EQ(back->trigger, submap.trigger);
    EXPECT_EQ(back->soundings_read, submap.soundings_read);
    EXPECT_EQ(back->soundings_used, submap.soundings_used);
    EXPECT_EQ(back->footprint, submap.footprint);
    EXPECT_EQ(back->cloud.points, submap.cloud.points);
    EXPECT_EQ(back->cloud.soundings, submap.cloud.soundings);
    EXPECT_EQ(assembler.malformed() + assembler.incomplete(), 0);
  }
}

TEST(SubmapAssembler, NeverGivesASubmapWithAHole) {
  const SubmapMessages messages = ToLcm(MakeSubmap(20'000), 0, 0);
  for (std::size_t lost = 0; lost < messages.chunks.size(); ++lost) {
    SubmapMessages damaged = messages;
    damaged.chunks.erase(damaged.chunks.begin() + static_cast<std::ptrdiff_t>(lost));
    SubmapAssembler assembler;
    EXPECT_FALSE(Assemble(damaged, &assembler));
    EXPECT_TRUE(Assemble(messages, &assembler)) << "the next one is whole";
    EXPECT_EQ(assembler.incomplete(), 1);
  }
}

TEST(SubmapAssembler, NeverGivesASubmapWithAChangedPoint) {
  const SubmapMessages messages = ToLcm(MakeSubmap(7'000), 0, 0);
  const std::vector<std::function<void(submap_points_t&)>> changes{
      [](submap_points_t& m) { m.x_m[17] += 0.001f; },
      [](submap_points_t& m) { m.soundings[17] += 1.0f; },
      [](submap_points_t& m) { std::swap(m.y_m[0], m.z_m[0]); }};
  for (const auto& change : changes) {
    SubmapMessages damaged = messages;
    change(damaged.chunks[1]);
    SubmapAssembler assembler;
    EXPECT_FALSE(Assemble(damaged, &assembler));
    EXPECT_EQ(assembler.incomplete(), 1);
  }
}

// The bytes that every implementation must hash: FNV-1a of (1, 2, 3, 4) as big-endian float32.
TEST(SubmapAssembler, HashesThePointsAsTheContractSays) {
  Submap submap = MakeSubmap(0);
  submap.cloud.Add({1.0f, 2.0f, 3.0f}, 4.0f);
  const std::uint8_t bytes[] = {
      0x3f, 0x80, 0, 0, 0x40, 0, 0, 0, 0x40, 0x40, 0, 0, 0x40, 0x80, 0, 0};
  std::uint64_t hash = 14695981039346656037u;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211u;
  EXPECT_EQ(static_cast<std::uint64_t>(ToLcm(submap, 0, 0).announcement.points_hash), hash);
}

TEST(SubmapAssembler, CountsChunksOfNobody) {
  const SubmapMessages messages = ToLcm(MakeSubmap(10), 0, 0);
  SubmapAssembler assembler;
  EXPECT_FALSE(assembler.Add(messages.chunks[0]));
  EXPECT_EQ(assembler.malformed(), 1);
  assembler.Add(messages.announcement);
  submap_points_t other = messages.chunks[0];
  other.submap_id = 99;
  EXPECT_FALSE(assembler.Add(other));
  EXPECT_EQ(assembler.malformed(), 2);
  EXPECT_TRUE(assembler.Add(messages.chunks[0])) << "the open submap is not hurt by it";
}

TEST(SubmapAssembler, AnAnnouncementEndsTheOneBefore) {
  const SubmapMessages messages = ToLcm(MakeSubmap(10), 0, 0);
  SubmapAssembler assembler;
  assembler.Add(messages.announcement);
  EXPECT_TRUE(Assemble(messages, &assembler));
  EXPECT_EQ(assembler.incomplete(), 1);
}

TEST(SubmapAssembler, RefusesEachDamagedAnnouncement) {
  const submap_t good = ToLcm(MakeSubmap(10), 0, 0).announcement;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, std::function<void(submap_t&)>>> damages{
      {"id negative", [](submap_t& m) { m.id = -1; }},
      {"too many points", [](submap_t& m) { m.num_points = kMaxSubmapPoints + 1; }},
      {"points negative", [](submap_t& m) { m.num_points = -1; }},
      {"chunks do not fit points", [](submap_t& m) { m.num_chunks = 2; }},
      {"trigger unknown", [](submap_t& m) { m.trigger = 7; }},
      {"ends before it starts", [](submap_t& m) { m.end_utime = m.utime - 1; }},
      {"frame outside", [](submap_t& m) { m.frame_utime = m.end_utime + 1; }},
      {"pose NaN", [](submap_t& m) { m.p_map_submap_m[0] = kNan; }},
      {"quaternion off", [](submap_t& m) { m.q_map_submap[0] += 0.1; }},
      {"heading sigma NaN", [](submap_t& m) { m.heading_sigma_rad = kNan; }},
      {"covariance NaN", [](submap_t& m) { m.covariance_from_previous[0][1] = kNan; }},
      {"information negative", [](submap_t& m) { m.predicted_information[1][1] = -1.0; }},
      {"footprint NaN", [](submap_t& m) { m.footprint_x_m[1] = kNan; }},
      {"footprint short", [](submap_t& m) { m.footprint_y_m.pop_back(); }},
      {"soundings negative", [](submap_t& m) { m.soundings_read = -1; }}};
  for (const auto& [name, damage] : damages) {
    submap_t bad = good;
    damage(bad);
    SubmapAssembler assembler;
    EXPECT_FALSE(assembler.Add(bad)) << name;
    EXPECT_EQ(assembler.malformed(), 1) << name;
  }
}

TEST(SubmapAssembler, RefusesAPointThatIsNone) {
  SubmapMessages messages = ToLcm(MakeSubmap(10), 0, 0);
  messages.chunks[0].z_m[4] = std::numeric_limits<float>::quiet_NaN();
  SubmapAssembler assembler;
  EXPECT_FALSE(Assemble(messages, &assembler));
  EXPECT_EQ(assembler.malformed(), 1);
}

TEST(ToLcm, KeepsEveryCornerOfAFootprintThatFits) {
  Submap submap = MakeSubmap(1);
  submap.footprint.clear();
  for (int i = 0; i < kMaxFootprintCorners; ++i) submap.footprint.emplace_back(i, -i);
  const submap_t msg = ToLcm(submap, 0, 0).announcement;
  EXPECT_EQ(msg.num_corners, 3000);
  EXPECT_LT(msg.getEncodedSize(), 60'000);
}

TEST(ToLcm, ThinsAFootprintThatWouldNotFitOneDatagram) {
  Submap submap = MakeSubmap(1);
  submap.footprint.clear();
  for (int i = 0; i < 10'000; ++i) submap.footprint.emplace_back(i, -i);
  const submap_t msg = ToLcm(submap, 0, 0).announcement;
  EXPECT_LE(msg.num_corners, kMaxFootprintCorners);
  EXPECT_GE(msg.num_corners, kMaxFootprintCorners / 2);
  EXPECT_LT(msg.getEncodedSize(), 60'000);
}

}  // namespace
}  // namespace seastitch
