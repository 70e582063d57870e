// A mapper's process, but for the process: what goes to the disk before it goes to the bus, and
// which map it goes on with.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper_node.hpp"
#include "seastitch/health_t.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/runtime/notify_socket.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// A disk that hangs until it is told to go on.
class HangingDisk : public Worker {
 public:
  bool Post(Job job) override {
    if (!hangs) return job()(), true;
    jobs_.push_back(std::move(job));
    return jobs_.size() < 3;
  }
  std::size_t queue_depth() const override { return jobs_.size(); }
  void GoOn() {
    hangs = false;
    for (; !jobs_.empty(); jobs_.pop_front()) jobs_.front()()();
  }
  bool hangs = false;

 private:
  std::deque<Job> jobs_;
};

// A mapper from its start to its end, with a bus of its own.
struct Process {
  Process(const MapperConfig& config, Worker* disk)
      : node(config, &bus, &worker, disk, FindMap(config.map_dir, ConfigurationOf(config))) {
    bus.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [this](const graph_update_t& m) {
      if (auto update = FromLcm(m)) updates.push_back(*update);
    });
    bus.Subscribe<submap_t>("SUBMAP", 0, [this](const submap_t& m) {
      submaps.push_back(m.id);
      starts.insert({m.id, m.utime});
      assembler.Add(m);
    });
    bus.Subscribe<submap_points_t>("SUBMAP_POINTS", 0, [this](const submap_points_t& m) {
      if (const auto submap = assembler.Add(m)) whole.insert(submap->id.value);
    });
    bus.Subscribe<nav_t>("NAV", 0, [this](const nav_t&) { ++navs; });
  }
  void Drive(double duration_s, PerfectVehicle* vehicle) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle->Step(1.5, 0.0))
        std::visit([this](const auto& s) { Send(s); }, sample);
      bus.HandleAll();
    }
  }
  // What an INS would say of the same.
  void DriveGiven(double duration_s, PerfectVehicle* vehicle) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle->Step(1.5, 0.0))
        if (const auto* ping = std::get_if<MbesPing>(&sample)) Send(*ping);
      const Eigen::Isometry3d T = vehicle->TrueAt(vehicle->time);
      NavigationSample ins;
      ins.time = vehicle->time;
      ins.position = InsPosition{T.translation().x() / 6335439.3, T.translation().y() / 6378137.0};
      ins.depth = InsVertical{PerfectVehicle::kDepthM, 0.0};
      ins.attitude = Attitude{Eigen::Quaterniond(T.linear())};
      ins.velocity = InsVelocity{{1.5, 0.0, 0.0}};
      bus.Publish("INS", ToLcm(ins, {ins.time, seq[0]++}));
      bus.HandleAll();
    }
  }
  void Send(const ImuSample& s) { Publish("IMU", s, &seq[0]); }
  void Send(const DvlSample& s) { Publish("DVL", s, &seq[1]); }
  void Send(const DepthSample& s) { Publish("DEPTH", s, &seq[2]); }
  void Send(const MbesPing& p) { Publish("MBES_PING", p, &seq[3]); }
  template <class Sample>
  void Publish(const char* channel, Sample sample, std::int64_t* number) {
    sample.time += FromSeconds(clock_s);
    bus.Publish(channel, ToLcm(sample, {sample.time, (*number)++}));
  }
  std::string Text() { return node.health().Snapshot(0, 1.0).text; }
  void SendProfile() {
    SoundVelocityProfile profile{FromUtime(1'700'000'000'000'000), {0.0, 100.0}, {1500.0, 1502.0}};
    bus.Publish("SVP", ToLcm(profile, {profile.time, profiles++}));
    bus.HandleAll();
  }
  // HEALTH of a process, for so long.
  void Hear(double duration_s) {
    health_t msg{};
    msg.process = "logger";
    for (const double end_s = uptime_s + duration_s; uptime_s < end_s; uptime_s += 1.0) {
      msg.utime = ToUtime(FromUtime(1'700'000'000'000'000) + FromSeconds(uptime_s + clock_s));
      msg.uptime_s = uptime_s;
      bus.Publish("HEALTH", msg);
      bus.HandleAll();
    }
  }

  Bus bus{"memq://"};
  InlineWorker worker;
  MapperNode node;
  std::array<std::int64_t, 4> seq{};
  std::int64_t profiles = 0;
  double uptime_s = 100.0;
  double clock_s = 0.0;  // the computer's, ahead of the vehicle's time
  std::vector<GraphUpdate> updates;
  std::vector<std::int32_t> submaps;                       // announced
  std::set<std::pair<std::int32_t, std::int64_t>> starts;  // the same, with their first ping's time
  std::set<std::int32_t> whole;                            // with all their points
  SubmapAssembler assembler;
  int navs = 0;
};

class Restart : public testing::Test {
 protected:
  Restart() {
    config_.map_dir = dir_ / "map";
    config_.submap.max_duration_s = 8.0;
    fs::create_directory(config_.map_dir);
  }
  std::set<std::string> Maps() const {
    std::set<std::string> maps;
    for (const auto& entry : fs::directory_iterator(dir_.path()))
      maps.insert(entry.path().filename().string());
    return maps;
  }

  TemporaryDir dir_;
  MapperConfig config_;
  InlineWorker disk_;
  PerfectVehicle vehicle_;
};

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
