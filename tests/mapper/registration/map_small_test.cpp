#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/storage/submap_file.hpp"
#include "mapper/registration/registration.hpp"
#include "tests/support/paths.hpp"

// The published toy survey: two legs of a simulated AUV, 0.03 to 0.14 m of relief, beam noise of
// 2 cm. Leg 2 fits leg 1 only 0.25 m off its published frames, along the track.
namespace seastitch {
namespace {

const std::filesystem::path kSubmaps = Shared("data/submaps");

std::vector<Pose2> ReadFrames(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<Pose2> frames;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    int id;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
    fields >> id >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w();
    frames.push_back(LevelPose(MakePose(p, q.normalized().toRotationMatrix())));
  }
  return frames;
}

struct SmallPair {
  int target;
  int source;
};

class MapSmall : public ::testing::TestWithParam<SmallPair> {};

TEST_P(MapSmall, IsRegisteredFromEveryCorruptedSeed) {
  if (!std::filesystem::exists(kSubmaps)) GTEST_SKIP() << "no " << kSubmaps;
  const auto load = [&](int id) {
    return ReadSubmapPcd(kSubmaps / "map_small" / ("submap_" + std::to_string(id) + "_frame.pdc"));
  };
  const auto& [target_id, source_id] = GetParam();
  const SubmapPcd target = load(target_id);
  const SubmapPcd source = load(source_id);
  const auto prepare = [](const SubmapPcd& s) {
    return RegistrationSubmap::Prepare(s.cloud, LevelFromBody(s.T_map_submap), {});
  };
  const RegistrationSubmap prepared_target = prepare(target);
  const RegistrationSubmap prepared_source = prepare(source);
  const Pose2 truth = Inverse(LevelPose(target.T_map_submap)) * LevelPose(source.T_map_submap);
  // 0.5 m and 0.01 rad an edge, the turns of every edge at the lever of half the chain.
  const double edges = source_id - target_id;
  const double sigma = std::hypot(0.5 * std::sqrt(edges), 0.01 * std::sqrt(edges) * 20.0);
  const Eigen::Matrix3d covariance =
      Eigen::Vector3d(sigma * sigma, sigma * sigma, 1e-4 * edges).asDiagonal();
  for (int seed = 1; seed <= 5; ++seed) {
    const std::vector<Pose2> frames =
        ReadFrames(kSubmaps / "map_small_seeds" / ("seed" + std::to_string(seed) + ".txt"));
    ASSERT_EQ(frames.size(), 9u);
    const Pose2 prior = Inverse(frames[static_cast<std::size_t>(target_id)]) *
                        frames[static_cast<std::size_t>(source_id)];
    const RegistrationResult result =
        Align(prepared_target,
              prepared_source,
              {prior,
               covariance,
               source.T_map_submap.translation().z() - target.T_map_submap.translation().z(),
               0.1});
    EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict) << seed;
    EXPECT_LT((result.T_target_source.Translation() - truth.Translation()).norm(), 0.35) << seed;
    EXPECT_LT(std::abs(WrapAngle(result.T_target_source.yaw - truth.yaw)), 0.008) << seed;
    EXPECT_LT(std::abs(result.z_offset_m), 0.03) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Pairs,
                         MapSmall,
                         ::testing::Values(SmallPair{1, 8}, SmallPair{3, 6}, SmallPair{4, 5}),
                         [](const auto& pair) {
                           return std::to_string(pair.param.target) + "To" +
                                  std::to_string(pair.param.source);
                         });

}  // namespace
}  // namespace seastitch
