// The example that registers two PCD files, on pairs whose truth is known.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <sstream>
#include <string>

#include "common/storage/submap_file.hpp"
#include "tests/mapper/registration/synthetic_pair.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

// Writes both submaps, the source with its frame off by `error`, and registers them.
CommandResult RegisterFiles(const SyntheticPair& pair, const Pose2& error) {
  const TemporaryDir dir;
  const std::string target = (dir.path() / "target.pcd").string();
  const std::string source = (dir.path() / "source.pcd").string();
  const Pose2 frame = LevelPose(pair.source.T_map_submap);
  const Pose2 moved{frame.x + error.x, frame.y + error.y, frame.yaw + error.yaw};
  WriteSubmapPcd(target, pair.target.cloud, pair.target.T_map_submap);
  WriteSubmapPcd(source, pair.source.cloud, WithLevelPose(pair.source.T_map_submap, moved));
  return RunCommand(Program("register_two_submaps") + " " + target + " " + source);
}

TEST(RegisterTwoSubmaps, PrintsAPoseWithinItsCovarianceOfTheTruth) {
  double chi2 = 0.0;
  const int pairs = 5;
  for (int seed = 1; seed <= pairs; ++seed) {
    const auto id = static_cast<std::uint64_t>(seed);
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(id, 0.6), {}, id);
    const CommandResult result = RegisterFiles(pair, {1.5, -1.0, Deg2Rad(1.0)});
    ASSERT_EQ(result.exit_code, 0) << result.output;
    std::istringstream out(result.output);
    std::string line;
    std::getline(out, line);
    EXPECT_EQ(line.rfind("accepted, overlap ", 0), 0u) << line;
    std::string word;
    Eigen::Vector3d pose;
    out >> word >> pose[0] >> word >> word >> pose[1] >> word >> word >> pose[2];
    std::getline(out, line);
    std::getline(out, line);
    Eigen::Matrix3d C;
    for (int i = 0; i < 9; ++i) out >> C(i / 3, i % 3);
    ASSERT_TRUE(out) << result.output;
    Eigen::Vector3d error = pose - pair.T_target_source.Vector();
    error[2] = WrapAngle(Deg2Rad(pose[2]) - pair.T_target_source.yaw);
    chi2 += error.dot(C.inverse() * error);
  }
  // 15 degrees of freedom: one honest run in a thousand lies beyond 37.7, one beneath 3.5.
  EXPECT_LT(chi2, 37.7);
  EXPECT_GT(chi2, 3.5);
}

TEST(RegisterTwoSubmaps, SaysWhyItHasNoPose) {
  const SyntheticPair flat = MakePair(SyntheticSeabed::Flat(), {}, 1);
  const CommandResult result = RegisterFiles(flat, {});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.output.rfind("degenerate", 0), 0u) << result.output;
}

TEST(RegisterTwoSubmaps, SaysInOneLineWhatItCannotRead) {
  for (const char* arguments : {"", " none.pcd none.pcd"}) {
    const CommandResult result = RunCommand(Program("register_two_submaps") + arguments);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }
}

}  // namespace
}  // namespace seastitch
