// The real mapper, killed with -9 in a dive that goes on, and started again.

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "seastitch/sound_velocity_profile_t.hpp"
#include "seastitch/submap_t.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/live/child_process.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;

// A vehicle's computer, on a bus of its own: mapper and optimizer, and a short survey that
// lcm-logplayer plays to them.
class Vehicle {
 public:
  ~Vehicle() {
    if (is_mounted_) umount2(dives_.c_str(), MNT_DETACH);
  }
  Vehicle() : log_((dir_ / "short.lcmlog").string()) {
    fs::copy(ConfigFile(""), dir_ / "config", fs::copy_options::recursive);
    bus_.Subscribe<submap_t>("SUBMAP", 0, [this](const submap_t& m) { submaps.insert(m.id); });
    bus_.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [this](const graph_update_t& m) {
      graph_ids.insert(m.graph_id);
      resumed += m.is_resumed ? 1 : 0;
      const auto found = updates.find(m.version);
      if (found != updates.end() && found->second.num_edges != m.num_edges) ++changed;
      updates[m.version] = m;
    });
    bus_.Subscribe<pose_graph_t>("POSE_GRAPH", 0, [this](const pose_graph_t& m) {
      solved_version = m.graph_version;
      solved = static_cast<std::size_t>(m.num_vertices);
    });
    bus_.Subscribe<nav_t>("NAV", 0, [this](const nav_t& m) {
      ++navs;
      nav_utime = m.utime;
    });
    bus_.Subscribe<health_t>("HEALTH", 0, [this](const health_t& m) {
      if (m.process == "mapper") {
        ++mapper_health;
        mapper_text += m.text + "\n";
      }
    });
  }
  std::string MakeLog() {
    const CommandResult made = RunCommand(Program("seastitch") + " bench --survey " +
                                          ConfigFile("bench/short.yaml") + " --log " + log_);
    return made.exit_code == 0 ? "" : made.output;
  }
  std::unique_ptr<ChildProcess> Start(const std::string& name) {
    return std::make_unique<ChildProcess>(
        name,
        std::vector<std::string>{Program("seastitch-" + name),
                                 "--config",
                                 (dir_ / "config" / (name + ".yaml")).string(),
                                 "--lcm-url",
                                 kUrl},
        dir_ / (name + std::to_string(started_++) + ".txt"));
  }
  std::unique_ptr<ChildProcess> Play(int speed) {
    return std::make_unique<ChildProcess>(
        "lcm-logplayer",
        std::vector<std::string>{"/usr/bin/lcm-logplayer",
                                 "--speed=" + std::to_string(speed),
                                 "--lcm-url=" + kUrl,
                                 log_},
        dir_ / "player.txt");
  }
  void SendProfile() {
    sound_velocity_profile_t profile{};
    profile.utime = profile.recv_utime = 1'700'000'000'000'000;
    profile.num_samples = 2;
    profile.depth_m = {0.0, 100.0};
    profile.speed_mps = {1500.0, 1502.0};
    bus_.Publish("SVP", profile);
  }
  // What an inertial unit at rest measures.
  void SendImu(std::int64_t utime, std::int64_t seq) {
    imu_t imu{};
    imu.utime = imu.recv_utime = utime;
    imu.seq = seq;
    imu.specific_force_mps2[2] = -9.81;
    bus_.Publish("IMU", imu);
  }
  bool ListenUntil(const std::function<bool()>& done, milliseconds patience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!done() && std::chrono::steady_clock::now() < deadline) {
      bus_.HandleAll();
      usleep(5'000);
    }
    return done();
  }
  void Listen(milliseconds time) {
    ListenUntil([] { return false; }, time);
  }
  // The dives go to a disk of their own, of 64 MB, that only this test sees. False: not allowed.
  bool MountDisk() {
    fs::create_directory(dives_);
    return unshare(CLONE_NEWNS) == 0 &&
           mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 && Mount(0) &&
           (is_mounted_ = true);
  }
  bool MakeReadOnly() { return Mount(MS_REMOUNT | MS_RDONLY); }
  // To the last byte.
  void FillDisk() const {
    std::ofstream file(dives_ / "filler", std::ios::binary);
    for (const std::size_t size : {std::size_t{1} << 20, std::size_t{1}})
      while (file.write(std::string(size, 'x').data(), static_cast<std::streamsize>(size)).flush())
        ;
  }
  fs::path Dive() const { return NewestDive(dives_).value(); }
  std::set<std::string> Maps() const {
    std::set<std::string> maps;
    for (const auto& entry : fs::directory_iterator(Dive()))
      if (entry.path().filename().string().starts_with("map"))
        maps.insert(entry.path().filename().string());
    return maps;
  }

  std::set<std::int32_t> submaps;
  std::map<std::int64_t, graph_update_t> updates;
  std::set<std::int64_t> graph_ids;
  int resumed = 0;
  int changed = 0;
  std::int64_t solved_version = 0;
  std::size_t solved = 0;
  std::int64_t navs = 0;
  std::int64_t nav_utime = 0;
  int mapper_health = 0;
  std::string mapper_text;

 private:
  // A port of this test process alone: others run beside it.
  inline static const std::string kUrl =
      "udpm://239.255.76.67:" + std::to_string(20'000 + getpid() % 40'000) +
      "?ttl=0&recv_buf_size=4194304";
  TemporaryDir dir_;
  const std::string log_;
  Bus bus_{kUrl};
  int started_ = 0;
  const fs::path dives_ = dir_ / "dives";
  bool is_mounted_ = false;

  bool Mount(unsigned long flags) const {
    return mount("tmpfs", dives_.c_str(), "tmpfs", flags, "size=64m") == 0;
  }
};

TEST(KilledMapper, GoesOnInTheSameGraphAndLosesNoClosedSubmap) {
  Vehicle vehicle;
  ASSERT_EQ(vehicle.MakeLog(), "");
  const auto optimizer = vehicle.Start("optimizer");
  auto mapper = vehicle.Start("mapper");
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
  const auto player = vehicle.Play(8);
  std::mt19937 random(5);
  int kills = 0;
  for (const int first_submaps : {1, 3}) {
    // Not before the mapper that was started again has sent its graph.
    ASSERT_TRUE(vehicle.ListenUntil(
        [&] {
          return vehicle.updates.size() >= static_cast<std::size_t>(first_submaps) &&
                 vehicle.resumed >= kills;
        },
        seconds(120)));
    ++kills;
    vehicle.Listen(milliseconds(std::uniform_int_distribution(0, 1000)(random)));
    mapper.reset();  // SIGKILL
    vehicle.Listen(milliseconds(200));
    mapper = vehicle.Start("mapper");
    const std::int64_t navs = vehicle.navs;
    EXPECT_TRUE(vehicle.ListenUntil([&] { return vehicle.navs > navs; }, seconds(20)));
  }
  ASSERT_TRUE(vehicle.ListenUntil([&] { return player->ExitCode().has_value(); }, seconds(240)));
  EXPECT_EQ(mapper->Stop(seconds(30)), 0);
  EXPECT_TRUE(vehicle.ListenUntil(
      [&] { return vehicle.solved_version == vehicle.updates.rbegin()->first; }, seconds(20)));

  std::set<std::int32_t> vertices;
  std::int64_t version = 0;
  for (const auto& [number, update] : vehicle.updates) {
    EXPECT_EQ(number, ++version) << "versions have no hole";
    for (const auto& vertex : update.vertices)
      EXPECT_TRUE(vertices.insert(vertex.id).second) << vertex.id;
  }
  EXPECT_EQ(vehicle.changed, 0) << "a version that was sent is never another";
  EXPECT_EQ(vehicle.graph_ids.size(), 1U);
  EXPECT_GE(vehicle.resumed, 2);
  EXPECT_EQ(vertices, vehicle.submaps);
  EXPECT_EQ(vehicle.solved, vertices.size());
  EXPECT_EQ(vehicle.Maps(), std::set<std::string>{"map"});
}

// Switched off on deck: a profile came, and no inertial unit.
TEST(StoppedMapper, EndsThoughNavigationNeverStarted) {
  Vehicle vehicle;
  auto mapper = vehicle.Start("mapper");
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
  vehicle.SendProfile();
  vehicle.Listen(milliseconds(500));
  EXPECT_EQ(mapper->Stop(seconds(10)), 0);
  EXPECT_TRUE(ReadDiveRecord(vehicle.Dive()).processes["mapper"].stopped);
  EXPECT_TRUE(fs::exists(vehicle.Dive() / "map" / "journal_000.lcmlog"));
}

// Journal or checkpoint cut at a random byte, as by a power cut: the real mapper starts, says what
// it lost, and ends in order.
TEST(CutMap, IsStartedFromAndTheLossIsNamed) {
  Vehicle vehicle;
  ASSERT_EQ(vehicle.MakeLog(), "");
  auto mapper = vehicle.Start("mapper");
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
  auto player = vehicle.Play(12);
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.updates.size() >= 2; }, seconds(120)));
  mapper.reset();  // SIGKILL
  player.reset();
  vehicle.Listen(milliseconds(200));
  const fs::path map = vehicle.Dive() / "map";
  const fs::path kept = vehicle.Dive() / "kept";
  fs::rename(map, kept);
  std::mt19937 random(1);
  for (int cut = 0; cut < 20; ++cut) {
    const bool is_journal = cut % 4 != 0;
    const std::string name =
        is_journal ? "journal_000.lcmlog" : "checkpoint_" + std::to_string(cut % 8 / 4);
    // The kill itself may have left a checkpoint empty.
    const std::uintmax_t whole = std::max<std::uintmax_t>(fs::file_size(kept / name), 1);
    const auto size = std::uniform_int_distribution<std::uintmax_t>(0, whole - 1)(random);
    SCOPED_TRACE(name + " cut to " + std::to_string(size) + " bytes");
    for (const std::string& of_before : vehicle.Maps()) fs::remove_all(vehicle.Dive() / of_before);
    fs::copy(kept, map, fs::copy_options::recursive);
    fs::resize_file(map / name, size);
    vehicle.mapper_text.clear();
    vehicle.mapper_health = 0;
    mapper = vehicle.Start("mapper");
    ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
    const auto says = [&](const char* what) {
      return vehicle.mapper_text.find(what) != std::string::npos;
    };
    const std::int64_t resumed_utime = vehicle.nav_utime + 1'000'000;
    const std::int64_t navs = vehicle.navs;
    std::int64_t sent = 0;
    const auto started = [&] {
      vehicle.SendImu(resumed_utime + 20'000 * sent, sent);
      ++sent;
      return says("journal cannot be read") || says("another map begins") ||
             (!is_journal && vehicle.navs > navs);
    };
    EXPECT_TRUE(vehicle.ListenUntil(started, seconds(5))) << vehicle.mapper_text;
    EXPECT_EQ(mapper->Stop(seconds(10)), 0);
  }
}

TEST(KilledMapper, BeginsAnotherMapWhereTheLogIsPlayedAgain) {
  Vehicle vehicle;
  ASSERT_EQ(vehicle.MakeLog(), "");
  for (const int maps : {1, 2}) {
    auto mapper = vehicle.Start("mapper");
    vehicle.mapper_health = 0;
    vehicle.updates.clear();
    ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
    auto player = vehicle.Play(12);
    ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.updates.size() >= 2; }, seconds(120)));
    player.reset();
    vehicle.Listen(seconds(2));
    mapper.reset();
    EXPECT_EQ(vehicle.Maps().size(), static_cast<std::size_t>(maps));
  }
  EXPECT_EQ(vehicle.Maps(), (std::set<std::string>{"map", "map-2"}));
  EXPECT_NE(vehicle.mapper_text.find("another map begins beside it"), std::string::npos)
      << vehicle.mapper_text;
}

// What makes a mapper crash may be in the map: kill -9 in place of that.
TEST(KilledMapper, BeginsAnotherMapWhereThisOneEndsItAgainAndAgain) {
  Vehicle vehicle;
  ASSERT_EQ(vehicle.MakeLog(), "");
  auto mapper = vehicle.Start("mapper");
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.mapper_health > 0; }, seconds(20)));
  const auto player = vehicle.Play(4);
  ASSERT_TRUE(vehicle.ListenUntil([&] { return vehicle.updates.size() >= 1; }, seconds(120)));
  const auto kill_and_start = [&] {
    mapper.reset();
    vehicle.Listen(milliseconds(200));
    mapper = vehicle.Start("mapper");
    const std::int64_t navs = vehicle.navs;
    EXPECT_TRUE(vehicle.ListenUntil([&] { return vehicle.navs > navs; }, seconds(20)));
  };
  for (int i = 0; i < 3; ++i) {
    kill_and_start();
    EXPECT_EQ(vehicle.mapper_text.find("ended soon after"), std::string::npos)
        << vehicle.mapper_text;
  }
  kill_and_start();
  EXPECT_TRUE(vehicle.ListenUntil(
      [&] {
        return vehicle.mapper_text.find(
                   "the last 3 mappers ended soon after they had gone on in "
                   "it; now in map-2") != std::string::npos;
      },
      seconds(10)))
      << vehicle.mapper_text;
  EXPECT_TRUE(vehicle.ListenUntil([&] { return vehicle.Maps().size() == 2; }, seconds(20)));
}

// A disk that fails in a dive: the kernel mounts it read-only, or it is full.
class FailedDisk : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (!vehicle_.MountDisk()) GTEST_SKIP() << "needs root to mount a disk";
    ASSERT_EQ(vehicle_.MakeLog(), "");
    optimizer_ = vehicle_.Start("optimizer");
    mapper_ = vehicle_.Start("mapper");
    ASSERT_TRUE(vehicle_.ListenUntil([&] { return vehicle_.mapper_health > 0; }, seconds(20)));
    player_ = vehicle_.Play(8);
    ASSERT_TRUE(vehicle_.ListenUntil([&] { return vehicle_.updates.size() >= 1; }, seconds(120)));
    vehicle_.Listen(seconds(1));
    mapper_.reset();
    if (GetParam())
      ASSERT_TRUE(vehicle_.MakeReadOnly());
    else
      vehicle_.FillDisk();
    vehicle_.mapper_text.clear();
  }
  // The mapper is at work again, and the graph grows.
  void ExpectToGoOn() {
    const std::int64_t navs = vehicle_.navs;
    mapper_ = vehicle_.Start("mapper");
    EXPECT_TRUE(vehicle_.ListenUntil([&] { return vehicle_.navs > navs; }, seconds(20)));
    vehicle_.updates.clear();
    EXPECT_TRUE(vehicle_.ListenUntil([&] { return vehicle_.updates.size() >= 2; }, seconds(120)));
    EXPECT_NE(vehicle_.mapper_text.find("the survey folder cannot be written"), std::string::npos)
        << vehicle_.mapper_text;
  }

  Vehicle vehicle_;
  std::unique_ptr<ChildProcess> optimizer_;
  std::unique_ptr<ChildProcess> mapper_;
  std::unique_ptr<ChildProcess> player_;
};
INSTANTIATE_TEST_SUITE_P(ReadOnly, FailedDisk, testing::Values(true));
INSTANTIATE_TEST_SUITE_P(Full, FailedDisk, testing::Values(false));

TEST_P(FailedDisk, AMapperThatIsStartedAgainGoesOnInTheSameGraph) {
  ExpectToGoOn();
  EXPECT_EQ(vehicle_.graph_ids.size(), 1U);
  EXPECT_GE(vehicle_.resumed, 1);
}

TEST_P(FailedDisk, AnotherMapIsMadeInMemory) {
  player_.reset();
  player_ = vehicle_.Play(8);  // from the beginning
  vehicle_.graph_ids.clear();
  ExpectToGoOn();
  EXPECT_NE(vehicle_.mapper_text.find("another map begins beside it"), std::string::npos)
      << vehicle_.mapper_text;
}

}  // namespace
}  // namespace seastitch
