#include "tests/mapper/restart/restart_fixture.hpp"

namespace seastitch {
namespace {

// The profile is sent once; the inertial unit is never switched on.
TEST_F(Restart, EndsAndKeepsTheProfileWhereNavigationNeverStarts) {
  {
    Process mapper(config_, &disk_);
    mapper.SendProfile();
    EXPECT_TRUE(mapper.node.IsBusy()) << "it waits for the decision which map goes on";
    mapper.node.Finish();
    ASSERT_FALSE(mapper.node.IsBusy()) << "the process would never end";
  }
  Process next(config_, &disk_);
  next.Drive(30.0, &vehicle_);
  EXPECT_EQ(next.node.health().counter("pings_without_profile"), 0);
  EXPECT_EQ(Maps(), std::set<std::string>{"map"});
}

TEST_F(Restart, EndsAndKeepsTheProfileWhereNavigationDoesNotComeBack) {
  Process(config_, &disk_).Drive(30.0, &vehicle_);
  {
    Process mapper(config_, &disk_);
    mapper.SendProfile();
    mapper.node.Finish();
    ASSERT_FALSE(mapper.node.IsBusy());
  }
  Process next(config_, &disk_);
  next.Drive(30.0, &vehicle_);
  EXPECT_EQ(next.node.health().counter("pings_without_profile"), 0);
  EXPECT_TRUE(next.updates.at(1).resumed);
}

// Before the first sample of navigation nothing can be written, and a program may send profiles
// all the time.
TEST_F(Restart, ProfilesBeforeNavigationDoNotPileUp) {
  config_.max_unsaved_mb = 1;
  Process mapper(config_, &disk_);
  for (int i = 0; i < 20'000; ++i) mapper.SendProfile();
  EXPECT_EQ(mapper.node.health().counter("journal_entries_dropped"), 0);
  mapper.Drive(30.0, &vehicle_);
  const FoundMap found = FindMap(config_.map_dir, ConfigurationOf(config_));
  ASSERT_TRUE(found.saved);
  EXPECT_LT(found.saved->journal.size(), 20U);
}

TEST_F(Restart, AJournalThatADiskDoesNotTakeIsBoundedAndItsEndIsNamed) {
  config_.max_unsaved_mb = 1;
  config_.map_resume_within_s = 1000.0;
  HangingDisk disk;
  {
    Process mapper(config_, &disk);
    mapper.Drive(30.0, &vehicle_);
    disk.hangs = true;
    mapper.Drive(200.0, &vehicle_);
    EXPECT_GT(mapper.node.health().counter("journal_entries_dropped"), 0);
    EXPECT_NE(mapper.Text().find("the journal has ended"), std::string::npos) << mapper.Text();
    disk.GoOn();
    mapper.Drive(30.0, &vehicle_);
    for (std::size_t i = 0; i < mapper.submaps.size(); ++i)
      EXPECT_EQ(mapper.submaps[i], static_cast<std::int32_t>(i));
  }
  const FoundMap found = FindMap(config_.map_dir, ConfigurationOf(config_));
  ASSERT_TRUE(found.saved);
  EXPECT_EQ(found.lost, "") << "the entries before its end are whole";
  Process next(config_, &disk_);
  next.Drive(1.0, &vehicle_);
  EXPECT_EQ(next.node.health().counter("journal_entries_unusable"), 0);
}

TEST_F(Restart, SaysThatNavigationDoesNotComeBack) {
  {
    Process first(config_, &disk_);
    first.Hear(5.0);
    EXPECT_EQ(first.node.health().state(), HealthState::kStarting) << "a dive that begins";
    first.Drive(30.0, &vehicle_);
  }
  Process mapper(config_, &disk_);
  mapper.Hear(2.0);
  EXPECT_EQ(mapper.node.health().state(), HealthState::kStarting);
  mapper.Hear(2.0);
  EXPECT_EQ(mapper.node.health().state(), HealthState::kLost);
  EXPECT_NE(mapper.Text().find("no NAV for two seconds"), std::string::npos) << mapper.Text();
  mapper.Drive(5.0, &vehicle_);
  EXPECT_EQ(mapper.Text().find("no NAV"), std::string::npos) << mapper.Text();
}

TEST_F(Restart, NamesSubmapsWhosePointsAreGone) {
  Process(config_, &disk_).Drive(40.0, &vehicle_);
  std::vector<fs::path> clouds;
  for (const auto& entry : fs::recursive_directory_iterator(config_.map_dir))
    if (entry.path().extension() == ".pcd") clouds.push_back(entry.path());
  ASSERT_GE(clouds.size(), 3U);
  fs::remove(clouds[0]);
  fs::remove(clouds[1]);
  Process mapper(config_, &disk_);
  mapper.Drive(10.0, &vehicle_);
  EXPECT_NE(mapper.Text().find("points of closed submaps are lost: 2 without a file"),
            std::string::npos)
      << mapper.Text();
}

// An entry that is whole but does not continue those before it, such as one of another journal.
TEST_F(Restart, NamesEntriesThatDoNotContinueTheJournal) {
  Process(config_, &disk_).Drive(30.0, &vehicle_);
  const FoundMap found = FindMap(config_.map_dir, ConfigurationOf(config_));
  MapJournal journal(found, ConfigurationOf(config_), 100);
  ASSERT_TRUE(journal.Append(vehicle_.time, Encode(found.saved->journal.back())));
  Process mapper(config_, &disk_);
  mapper.Drive(5.0, &vehicle_);
  EXPECT_NE(mapper.Text().find("1 entries do not continue those before"), std::string::npos)
      << mapper.Text();
}

// The journal cut at any byte, the checkpoints newer: whatever is lost, the mapper starts, says it,
// and uses no number twice.
TEST_F(Restart, GoesOnWithAJournalThatIsCutAnywhere) {
  std::set<std::pair<std::int32_t, std::int64_t>> starts;
  {
    Process mapper(config_, &disk_);
    mapper.Drive(40.0, &vehicle_);
    starts = mapper.starts;
  }
  const fs::path kept = dir_ / "kept";
  fs::copy(config_.map_dir, kept, fs::copy_options::recursive);
  const auto whole = fs::file_size(kept / "journal_000.lcmlog");
  std::mt19937 random(1);
  for (int cut = 0; cut < 12; ++cut) {
    const auto size = std::uniform_int_distribution<std::uintmax_t>(0, whole - 1)(random);
    SCOPED_TRACE(size);
    for (const std::string& map : Maps())
      if (map != "kept") fs::remove_all(dir_ / map);
    fs::copy(kept, config_.map_dir, fs::copy_options::recursive);
    fs::resize_file(config_.map_dir / "journal_000.lcmlog", size);
    PerfectVehicle vehicle = vehicle_;
    Process mapper(config_, &disk_);
    mapper.Drive(20.0, &vehicle);
    const std::string text = mapper.Text();
    EXPECT_TRUE(text.find("journal cannot be read") != std::string::npos ||
                text.find("another map begins") != std::string::npos)
        << text;
    EXPECT_GT(mapper.navs, 100);
    ASSERT_FALSE(mapper.starts.empty());
    if (Maps().contains("map-2")) continue;
    std::set<std::pair<std::int32_t, std::int64_t>> all = starts;
    all.insert(mapper.starts.begin(), mapper.starts.end());
    std::set<std::int32_t> numbers;
    for (const auto& [number, utime] : all)
      EXPECT_TRUE(numbers.insert(number).second)
          << "submap " << number << " was two different ones";
  }
}

TEST_F(Restart, FeedsTheWatchdogWhileItReadsTheJournal) {
  Process(config_, &disk_).Drive(60.0, &vehicle_);
  const std::size_t entries =
      FindMap(config_.map_dir, ConfigurationOf(config_)).saved->journal.size();
  Process mapper(config_, &disk_);
  NotifySocket watchdog;
  mapper.Drive(0.1, &vehicle_);
  EXPECT_GE(watchdog.Feedings(), static_cast<int>(std::min<std::size_t>(entries, 10)));
}

TEST_F(Restart, BeginsAnotherMapAndSaysWhy) {
  Process(config_, &disk_).Drive(30.0, &vehicle_);
  // Too late.
  vehicle_.Sleep(config_.map_resume_within_s + 10.0);
  {
    Process mapper(config_, &disk_);
    mapper.Drive(20.0, &vehicle_);
    EXPECT_NE(mapper.Text().find("its last checkpoint is 18"), std::string::npos) << mapper.Text();
    EXPECT_NE(mapper.Text().find("now in map-2"), std::string::npos) << mapper.Text();
    mapper.Drive(60.0, &vehicle_);
    EXPECT_EQ(mapper.Text().find("now in map-2"), std::string::npos) << mapper.Text();
    EXPECT_EQ(mapper.updates.front().version, 1);
  }
  // Of another configuration.
  config_.nav_rate_hz = 5.0;
  {
    Process mapper(config_, &disk_);
    mapper.Drive(20.0, &vehicle_);
    EXPECT_NE(mapper.Text().find("now in map-3"), std::string::npos) << mapper.Text();
  }
  EXPECT_EQ(Maps(), (std::set<std::string>{"map", "map-2", "map-3"}));
}

}  // namespace
}  // namespace seastitch
