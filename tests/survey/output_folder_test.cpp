#include "survey/replay/output_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "tests/support/files.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::ThrowsMessage;

void Write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(OutputFolder, AppearsWhole) {
  const TemporaryDir dir;
  OutputFolder out(dir / "map");
  Write(out.path() / "elevation.tif", "new");
  EXPECT_FALSE(fs::exists(dir / "map"));
  out.Publish();
  EXPECT_EQ(TextOf(dir / "map" / "elevation.tif"), "new");
}

// A mistyped path makes no folders.
TEST(OutputFolder, LiesInAFolderThatExists) {
  const TemporaryDir dir;
  EXPECT_THROW(OutputFolder(dir / "deep" / "map"), std::runtime_error);
  EXPECT_FALSE(fs::exists(dir / "deep"));
}

TEST(OutputFolder, ThatIsNotPublishedLeavesNothing) {
  const TemporaryDir dir;
  {
    OutputFolder out(dir / "map");
    Write(out.path() / "elevation.tif", "new");
  }
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

TEST(OutputFolder, ReplacesFilesOfTheSameNameAndKeepsTheOthers) {
  const TemporaryDir dir;
  Write(dir / "map" / "elevation.tif", "old");
  Write(dir / "map" / "report.json", "old");
  Write(dir / "map" / "notes.txt", "mine");
  Write(dir / "map" / "submaps" / "submap_9.pcd", "old");
  {
    OutputFolder out(dir / "map");
    Write(out.path() / "elevation.tif", "new");
    Write(out.path() / "report.json", "{}");
    Write(out.path() / "submaps" / "submap_1.pcd", "new");
    EXPECT_EQ(TextOf(dir / "map" / "elevation.tif"), "old");
    out.Publish();
  }
  EXPECT_EQ(TextOf(dir / "map" / "elevation.tif"), "new");
  EXPECT_EQ(TextOf(dir / "map" / "report.json"), "{}");
  EXPECT_EQ(TextOf(dir / "map" / "notes.txt"), "mine");
  EXPECT_FALSE(fs::exists(dir / "map" / "submaps" / "submap_9.pcd"));
  EXPECT_TRUE(fs::exists(dir / "map" / "submaps" / "submap_1.pcd"));
  EXPECT_FALSE(fs::exists(dir / "map" / ".partial"));
}

// A track alone after a map: the old map is not beside the new report.
TEST(OutputFolder, RemovesOldProductsThatAreNotMadeAgain) {
  const TemporaryDir dir;
  for (const char* const name :
       {"elevation.tif", "report.json", "submaps/submap_9.pcd", "mine.tif"})
    Write(dir / "map" / name, "old");
  {
    OutputFolder out(dir / "map");
    Write(out.path() / "track.csv", "new");
    Write(out.path() / "report.json", "{}");
    EXPECT_EQ(TextOf(dir / "map" / "elevation.tif"), "old");
    out.Publish();
  }
  EXPECT_FALSE(fs::exists(dir / "map" / "elevation.tif"));
  EXPECT_FALSE(fs::exists(dir / "map" / "submaps"));
  EXPECT_EQ(TextOf(dir / "map" / "mine.tif"), "old");
  EXPECT_EQ(TextOf(dir / "map" / "track.csv"), "new");
}

TEST(OutputFolder, LeavesAFolderAloneThatHoldsAnotherFileAndNoMap) {
  const TemporaryDir dir;
  Write(dir / "map" / "elevation.tif", "mine");
  EXPECT_THROW(OutputFolder(dir / "map"), std::runtime_error);
  EXPECT_EQ(TextOf(dir / "map" / "elevation.tif"), "mine");
}

TEST(OutputFolder, RemovesTheProductsOfOlderVersions) {
  const TemporaryDir dir;
  for (const char* const name : {"depth.tif", "consistency_dead_reckoned.png", "report.json"})
    Write(dir / "map" / name, "old");
  OutputFolder out(dir / "map");
  Write(out.path() / "report.json", "{}");
  out.Publish();
  EXPECT_FALSE(fs::exists(dir / "map" / "depth.tif"));
  EXPECT_FALSE(fs::exists(dir / "map" / "consistency_dead_reckoned.png"));
}

TEST(OutputFolder, LeavesFoldersAloneThatNoReplayMade) {
  const TemporaryDir dir;
  Write(dir / "home" / "config" / "mapper.yaml", "mine");
  EXPECT_THAT([&] { OutputFolder out(dir / "home"); },
              ThrowsMessage<std::runtime_error>(testing::HasSubstr("holds config and no map")));
  EXPECT_EQ(TextOf(dir / "home" / "config" / "mapper.yaml"), "mine");
  EXPECT_FALSE(fs::exists(dir / "home" / ".partial"));
}

TEST(OutputFolder, RemovesWhatAKilledCommandLeft) {
  const TemporaryDir dir;
  Write(dir / "map.partial" / "submaps" / "submap_9.pcd", "old");
  OutputFolder out(dir / "map");
  EXPECT_TRUE(fs::is_empty(out.path()));
}

TEST(OutputFolder, TakesOneCommandAtATime) {
  const TemporaryDir dir;
  const OutputFolder out(dir / "map");
  EXPECT_THAT([&] { OutputFolder second(dir / "map" / ""); },
              ThrowsMessage<std::runtime_error>(EndsWith("map: another command is writing there")));
  EXPECT_TRUE(fs::exists(out.path()));
}

TEST(OutputFolder, IsNoFile) {
  const TemporaryDir dir;
  Write(dir / "map", "a file");
  EXPECT_THAT([&] { OutputFolder out(dir / "map"); },
              ThrowsMessage<std::runtime_error>(EndsWith("map: is not a folder")));
}

}  // namespace
}  // namespace seastitch
