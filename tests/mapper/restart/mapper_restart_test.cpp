// A mapper's process, but for the process: what goes to the disk before it goes to the bus, and
// which map it goes on with.

#include "tests/mapper/restart/restart_fixture.hpp"

namespace seastitch {
namespace {

TEST_F(Restart, WhatIsSentIsOnTheDiskAndNavigationNeverWaitsForIt) {
  HangingDisk disk;
  Process mapper(config_, &disk);
  mapper.Drive(30.0, &vehicle_);
  ASSERT_FALSE(mapper.updates.empty());
  disk.hangs = true;
  const std::size_t sent = mapper.updates.size();
  const std::size_t announced = mapper.submaps.size();
  const int navs = mapper.navs;
  mapper.Drive(30.0, &vehicle_);
  EXPECT_EQ(mapper.updates.size(), sent);
  EXPECT_EQ(mapper.submaps.size(), announced);
  EXPECT_NEAR(mapper.navs - navs, 300, 3);
  disk.GoOn();
  mapper.Drive(1.0, &vehicle_);
  EXPECT_GT(mapper.updates.size(), sent + 1);
  std::int64_t version = 0;
  for (const GraphUpdate& update : mapper.updates) EXPECT_EQ(update.version, ++version);
  const FoundMap found = FindMap(config_.map_dir, ConfigurationOf(config_));
  ASSERT_TRUE(found.saved);
  std::int64_t on_disk = 0;
  for (const JournalEntry& entry : found.saved->journal)
    if (const auto* growth = std::get_if<GraphGrowth>(&entry))
      on_disk += static_cast<std::int64_t>(growth->steps.size());
  EXPECT_GE(on_disk, version);
  EXPECT_GT(mapper.submaps.size(), announced + 1);
  const std::set<std::int32_t> once(mapper.submaps.begin(), mapper.submaps.end());
  EXPECT_EQ(once.size(), mapper.submaps.size());
}

// A mapper may be killed after a submap was written and before it was announced.
TEST_F(Restart, AnnouncesTheLastSubmapAgain) {
  auto before = std::make_unique<Process>(config_, &disk_);
  before->Drive(30.0, &vehicle_);
  ASSERT_GT(before->submaps.size(), 1u);
  const std::int32_t last = before->submaps.back();
  before.reset();
  Process after(config_, &disk_);
  after.Drive(30.0, &vehicle_);
  ASSERT_GT(after.submaps.size(), 1u);
  EXPECT_EQ(after.submaps[0], last);
  EXPECT_EQ(after.submaps[1], last + 1);
}

// Killed while the disk hangs: what closed meanwhile is on no disk, and its number is free.
TEST_F(Restart, GivesNoSubmapTheNumberOfAnotherThatWasAnnounced) {
  std::set<std::pair<std::int32_t, std::int64_t>> starts;
  {
    HangingDisk disk;
    Process mapper(config_, &disk);
    mapper.Drive(30.0, &vehicle_);
    disk.hangs = true;
    mapper.Drive(30.0, &vehicle_);
    starts = mapper.starts;
  }
  ASSERT_GT(starts.size(), 1U);
  vehicle_.Sleep(5.0);
  Process mapper(config_, &disk_);
  mapper.Drive(40.0, &vehicle_);
  ASSERT_GT(mapper.starts.size(), 2U);
  starts.insert(mapper.starts.begin(), mapper.starts.end());
  std::set<std::int32_t> numbers;
  for (const auto& [number, utime] : starts)
    EXPECT_TRUE(numbers.insert(number).second) << "submap " << number << " was two different ones";
}

// The points that wait for the disk are bounded; the order of the announcements is kept.
TEST_F(Restart, AnnouncesInOrderAfterADiskHungForLong) {
  HangingDisk disk;
  Process mapper(config_, &disk);
  mapper.Drive(10.0, &vehicle_);
  disk.hangs = true;
  mapper.Drive(400.0, &vehicle_);
  const std::int64_t not_stored = mapper.node.health().counter("submaps_not_stored");
  EXPECT_GT(not_stored, 0);
  disk.GoOn();
  mapper.node.Finish();
  mapper.bus.HandleAll();
  for (std::size_t i = 0; i < mapper.submaps.size(); ++i)
    EXPECT_EQ(mapper.submaps[i], static_cast<std::int32_t>(i));
  EXPECT_EQ(mapper.whole.size() + static_cast<std::size_t>(not_stored), mapper.submaps.size());
}

TEST_F(Restart, ADiskThatTakesNothingStopsNeitherSubmapsNorGraph) {
  fs::remove_all(config_.map_dir);
  config_.map_dir = dir_.Write("full", "no folder") + "/map";
  Process mapper(config_, &disk_);
  mapper.Drive(60.0, &vehicle_);
  mapper.node.Finish();
  mapper.bus.HandleAll();
  EXPECT_GT(mapper.submaps.size(), 3U);
  EXPECT_EQ(mapper.whole.size(), mapper.submaps.size());
  EXPECT_GE(mapper.updates.size(), mapper.submaps.size());
  EXPECT_NE(mapper.Text().find("cannot be written"), std::string::npos) << mapper.Text();
}

// The end of a dive: what the disk takes last is sent too.
TEST_F(Restart, SendsTheLastSubmapOnceASlowDiskHasIt) {
  HangingDisk disk;
  Process mapper(config_, &disk);
  mapper.Drive(30.0, &vehicle_);
  disk.hangs = true;
  mapper.node.Finish();
  mapper.bus.HandleAll();
  const std::size_t announced = mapper.submaps.size();
  disk.GoOn();
  ASSERT_FALSE(mapper.node.IsBusy());
  mapper.node.SendAll([] {});
  mapper.bus.HandleAll();
  EXPECT_GT(mapper.submaps.size(), announced);
  EXPECT_EQ(mapper.whole.size(), mapper.submaps.size());
  EXPECT_TRUE(mapper.updates.back().final);
}

TEST_F(Restart, GoesOnThoughTheFirstStampIsWild) {
  std::int64_t version = 0;
  std::int64_t graph_id = 0;
  {
    Process mapper(config_, &disk_);
    mapper.Drive(30.0, &vehicle_);
    version = mapper.updates.back().version;
    graph_id = mapper.updates.back().graph_id;
  }
  vehicle_.Sleep(5.0);
  Process mapper(config_, &disk_);
  ImuSample wild;
  wild.time = vehicle_.time - FromSeconds(1e6);
  mapper.Send(wild);
  mapper.Drive(30.0, &vehicle_);
  ASSERT_GT(mapper.updates.size(), 1U);
  EXPECT_EQ(mapper.updates[0].version, version) << "the last may not have been sent";
  EXPECT_EQ(mapper.updates[1].version, version + 1);
  EXPECT_TRUE(mapper.updates[1].resumed);
  EXPECT_EQ(mapper.updates[1].graph_id, graph_id);
  EXPECT_EQ(Maps(), std::set<std::string>{"map"});
}

TEST_F(Restart, GoesOnWithTheNavigationOfAnInsToo) {
  config_.navigation_source = NavigationSource::kGiven;
  std::int64_t version = 0;
  {
    Process mapper(config_, &disk_);
    mapper.DriveGiven(40.0, &vehicle_);
    ASSERT_FALSE(mapper.updates.empty());
    version = mapper.updates.back().version;
  }
  vehicle_.Sleep(5.0);
  Process mapper(config_, &disk_);
  mapper.DriveGiven(40.0, &vehicle_);
  ASSERT_GT(mapper.updates.size(), 1U);
  EXPECT_EQ(mapper.updates[1].version, version + 1);
  EXPECT_TRUE(mapper.updates[1].resumed);
  for (const GraphEdge& edge : mapper.updates[1].edges)
    EXPECT_TRUE(edge.kind != EdgeKind::kDeadReckoning || edge.information(0, 0) > 1e-2);
  EXPECT_EQ(Maps(), std::set<std::string>{"map"});
}

// The computer's clock goes back while the mapper is away.
TEST_F(Restart, GoesOnAcrossAStepOfTheClock) {
  std::int64_t version = 0;
  std::array<std::int64_t, 4> seq{};
  {
    Process mapper(config_, &disk_);
    mapper.Drive(30.0, &vehicle_);
    version = mapper.updates.back().version;
    seq = mapper.seq;
  }
  vehicle_.Sleep(5.0);
  Process mapper(config_, &disk_);
  for (std::size_t i = 0; i < seq.size(); ++i)  // the drivers went on
    mapper.seq[i] = seq[i] + seq[i] / 6;
  mapper.clock_s = -600.0;
  mapper.Drive(30.0, &vehicle_);
  ASSERT_GT(mapper.updates.size(), 1U);
  EXPECT_EQ(mapper.updates[1].version, version + 1);
  EXPECT_TRUE(mapper.updates[1].resumed);
  EXPECT_EQ(Maps(), std::set<std::string>{"map"});
  EXPECT_NE(mapper.Text().find("the computer's clock by -600."), std::string::npos)
      << mapper.Text();
  EXPECT_GT(mapper.navs, 250);
}

}  // namespace
}  // namespace seastitch
