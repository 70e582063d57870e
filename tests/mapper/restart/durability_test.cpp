// What a submap's or a checkpoint's writer says is on the disk is there after a power cut: file and
// folder are flushed.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mapper/restart/map_store.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/support/temporary_dir.hpp"

namespace {

// Paths that this program flushed, in order.
std::vector<std::string> flushed;

}  // namespace

// Takes the place of the C library's, and calls it.
extern "C" int fsync(int fd) {
  static const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fsync"));
  std::error_code error;
  const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), error);
  flushed.push_back(path.string());
  return real(fd);
}

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::ptrdiff_t LastFlush(const fs::path& path) {
  const auto last = std::find(flushed.rbegin(), flushed.rend(), path.string());
  return flushed.rend() - last - 1;  // -1: never
}

TEST(Durability, ASubmapIsSavedWithItsFolder) {
  const TemporaryDir dir;
  SurveyStore store({dir.path()});
  for (int id = 0; id < 2; ++id) {
    flushed.clear();
    store.Put(std::make_shared<const Submap>(ImportedSubmap(id, 0.0)));
    const fs::path folder = store.directory();
    const std::string file = "submap_00000" + std::to_string(id) + ".pcd.part";
    EXPECT_GE(LastFlush(folder / file), 0) << "before it is renamed";
    EXPECT_GT(LastFlush(folder), LastFlush(folder / "index.jsonl"));
    if (id == 0) {
      EXPECT_GE(LastFlush(dir.path()), 0) << "the folder is new";
    }
  }
}

TEST(Durability, ANewCheckpointIsInItsFolder) {
  const TemporaryDir dir;
  FoundMap map;
  map.folder = dir.path();
  MapJournal journal(map, "", 1);
  for (int slot = 0; slot < 2; ++slot) {
    flushed.clear();
    ASSERT_TRUE(journal.WriteCheckpoint(FromUtime(1), {1, 2, 3}));
    const auto file = LastFlush(dir / ("checkpoint_" + std::to_string(slot)));
    EXPECT_GE(file, 0);
    EXPECT_GT(LastFlush(dir.path()), file);
  }
}

}  // namespace
}  // namespace seastitch
