#include "tools/live/run_comparison.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

void Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

const std::string kHead = "utime_us,x_m,y_m,yaw_deg,sigma_x_m,sigma_y_m,sigma_yaw_deg\n";

void WriteProducts(const fs::path& products) {
  Write(products / "submaps" / "submap_0.pcd", "zero");
  Write(products / "submaps" / "submap_1.pcd", "one");
  Write(products / "graph.g2o",
        "VERTEX_SE2 0 1 2 3.14\nFIX 0\nEDGE_SE2 0 1 1 1 1\nEDGE_SE2 0 2 2 2 2\n");
  Write(products / "track.csv", kHead + "100,1,2,179.9,0.5,0.5,1\n200,3,4,5,2,2,9\n");
}

RunFolders RunIn(const fs::path& products) { return {products, products / "submaps"}; }

TEST(RunComparison, OfTheSameProductsFindsNothing) {
  const TemporaryDir dir;
  WriteProducts(dir / "live");
  WriteProducts(dir / "replay");
  const RunComparison c = CompareRuns(RunIn(dir / "live"), RunIn(dir / "replay"));
  EXPECT_EQ(c.submaps, 2U);
  EXPECT_THAT(c.submaps_apart, IsEmpty());
  EXPECT_EQ(c.edges, 2U);
  EXPECT_THAT(c.edges_apart, IsEmpty());
  EXPECT_EQ(c.poses_apart, 0.0);
  EXPECT_EQ(Text(c, "live", "replay"),
            "submaps: 2 of 2 have the same bytes\n"
            "edges of the graph: 2 of 2 have the same figures\n"
            "poses: at most 0.00 of the smallest stated sigma apart\n");
}

TEST(RunComparison, NamesEverySubmapAndEdgeThatDiffers) {
  const TemporaryDir dir;
  WriteProducts(dir / "live");
  WriteProducts(dir / "replay");
  Write(dir / "live/submaps/submap_1.pcd", "eins");
  Write(dir / "replay/submaps/submap_2.pcd", "two");
  Write(dir / "live/graph.g2o",
        "VERTEX_SE2 0 1.1 2 -3.14\nVERTEX_SE2 9 9 9 1\nEDGE_SE2 0 1 1 1 7\nEDGE_SE2 1 3 1 1 1\n");
  const RunComparison c = CompareRuns(RunIn(dir / "live"), RunIn(dir / "replay"));
  EXPECT_EQ(c.submaps, 3U);
  EXPECT_THAT(c.submaps_apart, ElementsAre("submap_1.pcd", "submap_2.pcd"));
  EXPECT_THAT(c.edges_apart, ElementsAre("0-1"));
  EXPECT_THAT(c.first_alone, ElementsAre("1-3"));
  EXPECT_THAT(c.second_alone, ElementsAre("0-2"));
  EXPECT_NEAR(c.poses_apart, 0.2, 1e-9) << "across the half circle";
  const std::string text = Text(c, "live", "replay");
  EXPECT_THAT(text, testing::HasSubstr("not the same: submap_1.pcd submap_2.pcd"));
  EXPECT_THAT(text, testing::HasSubstr("live alone: 1-3"));
  EXPECT_THAT(text, testing::HasSubstr("replay alone: 0-2"));
}

}  // namespace
}  // namespace seastitch
