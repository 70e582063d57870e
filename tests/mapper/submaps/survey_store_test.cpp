#include "mapper/submaps/survey_store.hpp"
#include "tests/support/files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace seastitch {
namespace {

namespace fs = std::filesystem;

class Store : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           (std::string("seastitch_store_") + test->name() + "_" + std::to_string(::getpid()));
    fs::remove_all(dir_);
  }
  void TearDown() override { fs::remove_all(dir_); }

  static std::shared_ptr<const Submap> Make(int id, std::size_t points = 1000) {
    auto submap = std::make_shared<Submap>();
    submap->id = SubmapId{id};
    submap->start = FromUtime(1'700'000'000'000'000 + id * 1'000'000);
    submap->frame_time = submap->start + FromSeconds(0.3);
    submap->end = submap->start + FromSeconds(0.7);
    submap->T_map_submap = MakePose({1.0 / 3.0 + id, -2.0, 12.5}, RotationFromRpy(0.1, -0.2, 3.0));
    submap->covariance_from_previous =
        Eigen::Matrix3d(Eigen::Vector3d(0.1, 0.2, 0.003).asDiagonal());
    submap->predicted_information =
        Eigen::Matrix3d(Eigen::Vector3d(10.0, 20.0, 300.0).asDiagonal());
    submap->trigger = SubmapTrigger::kTurn;
    submap->soundings_read = 4242;
    submap->soundings_used = 4000;
    submap->footprint = {{0.0, 0.0}, {1.0 / 7.0, 5.0}, {-3.0, 2.0}};
    for (std::size_t i = 0; i < points; ++i) {
      const auto t = static_cast<float>(i);
      submap->cloud.Add({0.1f * t, std::sin(t), 10.0f + 0.01f * t}, 1.0f + t);
    }
    return submap;
  }

  fs::path dir_;
};

TEST_F(Store, GivesBackWhatWasPutToTheLastBit) {
  SurveyStore store({dir_, /*max_cached_mb=*/0, 16});
  const auto submap = Make(3);
  ASSERT_TRUE(store.Put(submap));
  EXPECT_EQ(store.counters().cached_bytes, 0);
  const auto back = store.Get(SubmapId{3});
  ASSERT_NE(back, nullptr);
  EXPECT_NE(back, submap);  // from the disk
  EXPECT_EQ(back->cloud.points, submap->cloud.points);
  EXPECT_EQ(back->cloud.soundings, submap->cloud.soundings);
  EXPECT_EQ(back->T_map_submap.matrix(), submap->T_map_submap.matrix());
  EXPECT_EQ(back->frame_time, submap->frame_time);
  EXPECT_EQ(back->trigger, submap->trigger);
  EXPECT_EQ(back->footprint, submap->footprint);
}

TEST_F(Store, KeepsTheMostRecentlyUsedInMemory) {
  SurveyStore store({dir_, /*max_cached_mb=*/1, 16});
  std::vector<std::shared_ptr<const Submap>> put;
  for (int id = 0; id < 4; ++id) {  // 0.48 MB each: two fit
    put.push_back(Make(id, 30'000));
    store.Put(put.back());
    store.Get(SubmapId{0});
    EXPECT_LE(store.counters().cached_bytes, 1'000'000);
  }
  EXPECT_EQ(store.Get(SubmapId{0}), put[0]);  // the very same: never left
  EXPECT_EQ(store.Get(SubmapId{3}), put[3]);
  EXPECT_NE(store.Get(SubmapId{1}), put[1]);  // read anew
}

TEST_F(Store, WritesAnIndexThatAResumeNeeds) {
  SurveyStore store({dir_, 1, 16});
  const auto submap = Make(0);
  store.Put(submap);
  store.Put(Make(1));
  std::ifstream index(store.directory() / "index.jsonl");
  std::string line;
  std::vector<nlohmann::json> lines;
  while (std::getline(index, line)) lines.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_TRUE(fs::exists(store.directory() / lines[1]["file"].get<std::string>()));
  EXPECT_EQ(lines[0]["id"], 0);
  EXPECT_EQ(lines[0]["frame_utime"], ToUtime(submap->frame_time));
  EXPECT_EQ(lines[0]["p_map_submap_m"][0].get<double>(), 1.0 / 3.0);
  EXPECT_EQ(lines[0]["trigger"], "turn");
  EXPECT_EQ(lines[0]["footprint_m"][1][0].get<double>(), 1.0 / 7.0);
  EXPECT_EQ(lines[0]["covariance_from_previous"].size(), 9u);
}

TEST_F(Store, BeginsTheIndexOfADiveAnewAndLeavesOtherDivesAlone) {
  SurveyStore({dir_, 1, 16}).Put(Make(0));
  SurveyStore({dir_, 1, 16}).Put(Make(0));
  SurveyStore other({dir_, 1, 16});
  other.Put(Make(5));  // starts at another time
  std::string text = TextOf(dir_ / "1700000000000000" / "index.jsonl");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_TRUE(fs::exists(dir_ / "1700000005000000" / "index.jsonl"));
}

TEST_F(Store, RefusesAnIdTwiceAndKnowsNoOthers) {
  SurveyStore store({dir_, 1, 16});
  EXPECT_TRUE(store.Put(Make(0)));
  EXPECT_FALSE(store.Put(Make(0)));
  EXPECT_EQ(store.Get(SubmapId{7}), nullptr);
}

TEST_F(Store, GoesOnFromMemoryWithinItsBoundWhenTheDiskTakesNothing) {
  SurveyStore store({dir_, 1, /*max_unsaved_mb=*/1});
  fs::remove_all(dir_);
  std::ofstream(dir_) << "in the way";  // a file where the directory was: every write fails
  for (int id = 0; id < 4; ++id) EXPECT_TRUE(store.Put(Make(id, 30'000)));
  EXPECT_EQ(store.counters().write_errors, 4);
  EXPECT_EQ(store.counters().lost, 2);
  EXPECT_LE(store.counters().unsaved_bytes, 1'000'000);
  EXPECT_EQ(store.Get(SubmapId{0}), nullptr);
  EXPECT_NE(store.Get(SubmapId{3}), nullptr);
}

// A dive that begins at the surface begins with a frame for fixes, which is not stored.
TEST_F(Store, FindsTheFilesOfADiveThatBeganWithFixes) {
  SurveyStore(SurveyStoreParams{dir_}).Put(Make(1));
  Submap fixes = *Make(0, 0);
  fixes.trigger = SubmapTrigger::kFixes;
  SurveyStore store({dir_});
  store.Restore({std::make_shared<const Submap>(fixes), Make(1, 0)});
  EXPECT_EQ(store.counters().missing, 0);
  const auto found = store.Get(SubmapId{1});
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->cloud.size(), 1000u);
}

TEST_F(Store, CountsAFileThatIsGone) {
  SurveyStore store({dir_, /*max_cached_mb=*/0, 16});
  store.Put(Make(0));
  fs::remove_all(store.directory());
  EXPECT_EQ(store.Get(SubmapId{0}), nullptr);
  EXPECT_EQ(store.counters().read_errors, 1);
}

}  // namespace
}  // namespace seastitch
