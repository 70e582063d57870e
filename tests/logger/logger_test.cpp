#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config.hpp"
#include "logger/config_archive.hpp"
#include "logger/foreign_channels.hpp"
#include "logger/gap_counter.hpp"
#include "logger/housekeeper.hpp"
#include "logger/log_series.hpp"
#include "logger/log_writer.hpp"
#include "logger/logger_config.hpp"
#include "logger/logger_node.hpp"
#include "seastitch/counter_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "seastitch/submap_t.hpp"
#include "tests/paths.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;

template <class Msg>
std::vector<std::uint8_t> Encoded(const Msg& msg) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Msg>
std::vector<std::uint8_t> Numbered(std::int64_t seq) {
  Msg msg{};
  msg.seq = seq;
  return Encoded(msg);
}

TEST(LoggerConfig, ShippedFileLoads) {
  EXPECT_EQ(LoadLoggerConfig(ConfigFile("logger.yaml")).max_queue_mb, 256);
}

TEST(LoggerConfig, TakesThePathFromTheFilesOwnDirectory) {
  const TemporaryDir dir;
  const auto dives_dir = [&](const std::string& text) {
    return LoadLoggerConfig(dir.Write("l.yaml", text)).dive.dives_dir;
  };
  EXPECT_EQ(dives_dir("dives_dir: dives"), dir / "dives");
  EXPECT_EQ(dives_dir("dives_dir: /d/a"), "/d/a");
}

TEST(LoggerConfig, RefusesWhatCannotWork) {
  const TemporaryDir dir;
  EXPECT_THAT([&] { LoadLoggerConfig(dir.Write("l.yaml", "max_queue_mb: 0")); },
              ThrowsMessage<ConfigError>(
                  HasSubstr("l.yaml: max_queue_mb: '0' is not a whole number from 1")));
  EXPECT_THAT(
      [&] { LoadLoggerConfig(dir.Write("l.yaml", "flush_interval_ms: 0")); },
      ThrowsMessage<ConfigError>(HasSubstr("flush_interval_ms: '0' is not a whole number from 1")));
  EXPECT_THAT([&] { LoadLoggerConfig(dir.Write("l.yaml", "dives_dir: ''")); },
              ThrowsMessage<ConfigError>(HasSubstr("is not the name of a directory")));
  EXPECT_THAT(
      [&] { LoadLoggerConfig(dir.Write("l.yaml", "file: a")); },
      ThrowsMessage<ConfigError>(EndsWith(
          "l.yaml: file: was removed, logs go into a folder of each dive: name dives_dir")));
  EXPECT_THAT([&] { LoadLoggerConfig(dir.Write("l.yaml", "files: a")); },
              ThrowsMessage<ConfigError>(HasSubstr("files: unknown key")));
}

LogEvent Event(std::int64_t utime, std::size_t size) {
  return {utime, "C", std::vector<std::uint8_t>(size, 7)};
}

int EventsIn(const std::filesystem::path& path) {
  EventLogReader reader(path);
  int events = 0;
  while (const auto event = reader.Next()) EXPECT_EQ(event->utime, events++);
  EXPECT_EQ(reader.damaged_bytes(), 0);
  return events;
}

std::vector<std::string> NamesIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

TEST(LogSeries, BeginsAfterEveryLogThatIsThere) {
  const TemporaryDir dir;
  const auto next = [&] {
    LogSeries series(dir.path(), {});
    series.Open();
    return series.file().filename();
  };
  EXPECT_EQ(next(), "000.lcmlog");
  dir.Write("007.lcmlog.repaired", "");
  dir.Write("x1.lcmlog", "");
  dir.Write("-5.lcmlog", "");
  dir.Write("99999999999.lcmlog", "");
  EXPECT_EQ(next(), "001.lcmlog");
  dir.Write("999.lcmlog", "");
  EXPECT_EQ(next(), "1000.lcmlog");
  LogSeries missing(dir / "dives/dive/missing", {});
  EXPECT_THAT([&] { missing.Open(); },
              ThrowsMessage<std::runtime_error>(EndsWith("missing: No such file or directory")));
}

TEST(LogSeries, BeginsTheNextLogBySize) {
  const TemporaryDir dir;
  LogSeries series(dir.path(), {.max_bytes = 2'000'000});
  for (int i = 0; i < 10'000; ++i) series.Write(Event(i, 900));
  series.Flush();
  const std::vector<std::string> names = NamesIn(dir.path());
  ASSERT_EQ(names.size(), 5u);
  std::int64_t events = 0;
  std::int64_t bytes = 0;
  for (const std::string& name : names) {
    EventLogReader reader(dir / name);
    while (const auto event = reader.Next()) EXPECT_EQ(event->utime, events++) << name;
    bytes += static_cast<std::int64_t>(std::filesystem::file_size(dir / name));
    EXPECT_LE(std::filesystem::file_size(dir / name), 2'300'000u);
  }
  EXPECT_EQ(events, 10'000);
  EXPECT_EQ(series.events(), events);
  EXPECT_EQ(series.bytes(), bytes);
}

TEST(LogSeries, BeginsTheNextLogByTimeWhicheverWayTheClockGoes) {
  const TemporaryDir dir;
  LogSeries series(dir.path(), {.max_us = 10});
  for (const std::int64_t utime : {0L, 9L, 10L, 12L, -5L, INT64_MAX, INT64_MIN})
    series.Write(Event(utime, 1));
  EXPECT_EQ(NamesIn(dir.path()).size(), 5u);
}

LogEvent ConfigEvent(const std::string& name, const std::string& text) {
  return {0, "CONFIG", Encoded(ToLcm({"mapper", "1", name, text}, FromUtime(1'000'000), 0).at(0))};
}

std::string TextOf(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ConfigArchive, KeepsEveryVersionOfAFile) {
  const TemporaryDir dir;
  ConfigArchive archive(dir.path());
  for (const char* text : {"first", "first", "second", "third"}) {
    archive.Add(ConfigEvent("mapper.yaml", text));
    archive.Save();
  }
  EXPECT_THAT(NamesIn(dir.path()),
              testing::ElementsAre("mapper.1.yaml", "mapper.2.yaml", "mapper.yaml"));
  EXPECT_EQ(TextOf(dir / "mapper.1.yaml"), "first");
  EXPECT_EQ(TextOf(dir / "mapper.2.yaml"), "second");
  EXPECT_EQ(TextOf(dir / "mapper.yaml"), "third");
}

TEST(ConfigArchive, WritesNowhereElse) {
  const TemporaryDir dir;
  std::filesystem::create_directory(dir / "config");
  ConfigArchive archive(dir / "config");
  for (const char* name : {"../out.yaml", "/tmp/out.yaml", ".hidden", "a b", "", "a\nb"})
    archive.Add(ConfigEvent(name, "text"));
  archive.Add({0, "CONFIG", {1, 2, 3}});
  archive.Save();
  EXPECT_EQ(NamesIn(dir.path()), std::vector<std::string>{"config"});
  EXPECT_TRUE(std::filesystem::is_empty(dir / "config"));
}

TEST(ConfigArchive, TriesAgainWhereTheDiskRefuses) {
  const TemporaryDir dir;
  ConfigArchive archive(dir / "config");
  archive.Add(ConfigEvent("mapper.yaml", "text"));
  archive.Save();
  EXPECT_EQ(archive.errors(), 1);
  std::filesystem::create_directory(dir / "config");
  archive.Save();
  EXPECT_EQ(TextOf(dir / "config" / "mapper.yaml"), "text");
}

// Two dives, each with three raw logs and two logs of 1 kB.
class HousekeeperTest : public testing::Test {
 protected:
  HousekeeperTest() {
    for (int i = 0; i < 2; ++i) {
      const DiveFolder dive({dir_ / "dives", 60.0}, "logger", i * 3'600'000'000LL);
      for (const char* log : {"raw/000", "raw/001", "raw/002", "log/000", "log/001"})
        std::ofstream(dive.path() / (std::string(log) + ".lcmlog")) << std::string(1'000, 'x');
      std::ofstream(dive.path() / "raw" / "notes.txt") << std::string(1'000, 'x');
      dives_.push_back(dive.path());
    }
  }
  // What is left of the newer dive and of the older.
  std::vector<std::string> Left(std::size_t dive) const {
    std::vector<std::string> left;
    for (const char* part : {"raw", "log"})
      for (const std::string& name : NamesIn(dives_[dive] / part))
        if (name.ends_with(".lcmlog")) left.push_back(std::string(part) + "/" + name.substr(0, 3));
    return left;
  }
  std::vector<std::filesystem::path> Open() const {
    return {dives_[1] / "raw/002.lcmlog", dives_[1] / "log/001.lcmlog"};
  }
  const TemporaryDir dir_;
  std::vector<std::filesystem::path> dives_;
};

TEST_F(HousekeeperTest, DeletesNothingWithinTheLimits) {
  Housekeeper housekeeper(dives_[1], {.max_dive_bytes = 5'000, .min_free_bytes = 0});
  housekeeper.Tidy(Open());
  EXPECT_EQ(housekeeper.files_deleted(), 0);
  EXPECT_FALSE(housekeeper.short_of_space());
}

TEST_F(HousekeeperTest, KeepsADiveWithinItsLimitByItsOldestRawLogs) {
  Housekeeper housekeeper(dives_[1], {.max_dive_bytes = 3'500, .min_free_bytes = 0});
  for (int i = 0; i < 5; ++i) housekeeper.Tidy(Open());
  EXPECT_THAT(Left(0), testing::SizeIs(5));
  EXPECT_THAT(Left(1), testing::ElementsAre("raw/002", "log/000", "log/001"));
  EXPECT_EQ(housekeeper.files_deleted(), 2);
  EXPECT_EQ(housekeeper.bytes_deleted(), 2'000);
  EXPECT_FALSE(housekeeper.short_of_space());
}

TEST_F(HousekeeperTest, SaysWhereNothingMayBeDeleted) {
  Housekeeper housekeeper(dives_[1], {.max_dive_bytes = 500, .min_free_bytes = 0});
  for (int i = 0; i < 5; ++i) housekeeper.Tidy(Open());
  EXPECT_THAT(Left(1), testing::ElementsAre("raw/002", "log/000", "log/001"));
  EXPECT_TRUE(housekeeper.short_of_space());
}

TEST_F(HousekeeperTest, MakesRoomOnTheDiskFromTheOldestDiveOnAndNeverTouchesAnOpenLog) {
  Housekeeper housekeeper(dives_[1], {.min_free_bytes = INT64_MAX});
  housekeeper.Tidy(Open());
  EXPECT_THAT(Left(0), testing::ElementsAre("raw/001", "raw/002", "log/000", "log/001"));
  for (int i = 0; i < 20; ++i) housekeeper.Tidy(Open());
  EXPECT_THAT(Left(0), testing::ElementsAre("log/000", "log/001"));
  EXPECT_THAT(Left(1), testing::ElementsAre("raw/002", "log/000", "log/001"));
  EXPECT_TRUE(housekeeper.short_of_space());
  Housekeeper logs_too(dives_[1], {.min_free_bytes = INT64_MAX, .delete_logs = true});
  for (int i = 0; i < 20; ++i) logs_too.Tidy(Open());
  EXPECT_TRUE(Left(0).empty());
  EXPECT_THAT(Left(1), testing::ElementsAre("raw/002", "log/001"));
  EXPECT_TRUE(std::filesystem::exists(dives_[0] / "raw" / "notes.txt"));
}

TEST_F(HousekeeperTest, MakesRoomOnTheDiskWhereTheDiveHasNothingLeftToDelete) {
  Housekeeper housekeeper(dives_[1], {.max_dive_bytes = 500, .min_free_bytes = INT64_MAX});
  for (int i = 0; i < 20; ++i) housekeeper.Tidy(Open());
  EXPECT_THAT(Left(0), testing::ElementsAre("log/000", "log/001"));
  EXPECT_THAT(Left(1), testing::ElementsAre("raw/002", "log/000", "log/001"));
}

TEST_F(HousekeeperTest, DeletesNothingThatASymbolicLinkLeadsTo) {
  namespace fs = std::filesystem;
  const fs::path archive = dir_ / "archive";
  fs::rename(dives_[0], archive);
  fs::create_directory_symlink(archive, dives_[0]);
  fs::rename(dives_[1] / "raw", dir_ / "raw");
  fs::create_directory_symlink(dir_ / "raw", dives_[1] / "raw");
  Housekeeper housekeeper(dives_[1], {.min_free_bytes = INT64_MAX});
  for (int i = 0; i < 20; ++i) housekeeper.Tidy(Open());
  EXPECT_THAT(Left(0), testing::SizeIs(5));
  EXPECT_THAT(Left(1), testing::SizeIs(5));
  EXPECT_TRUE(housekeeper.short_of_space());
}

TEST(ForeignChannels, TellsHowOftenAndHowLongSilent) {
  ForeignChannels foreign;
  const std::vector<std::uint8_t> theirs(20, 1);
  for (const std::int64_t utime : {0, 100, 1'100, 1'200, 900})
    EXPECT_TRUE(foreign.Add("THEIRS", theirs, utime));
  EXPECT_FALSE(foreign.Add("IMU_2", Numbered<imu_t>(1), 0));
  ASSERT_EQ(foreign.figures().size(), 1u);
  EXPECT_EQ(foreign.figures().at("THEIRS").events, 5);
  EXPECT_EQ(foreign.figures().at("THEIRS").longest_gap_us, 1'000);
  for (int i = 0; i < 1'000; ++i) foreign.Add("C" + std::to_string(i), theirs, 0);
  EXPECT_LE(foreign.figures().size(), 50u);
  EXPECT_FALSE(foreign.Add("C999", theirs, 0));  // HEALTH has no room for it
}

TEST(GapCounter, FindsTheNumberInEveryKindOfMessage) {
  const auto lost_of = [](auto encode) {
    GapCounter gaps;
    gaps.Add("C", encode(5));
    gaps.Add("C", encode(6));
    return gaps.Add("C", encode(10));
  };
  EXPECT_EQ(lost_of(Numbered<imu_t>), 3);
  EXPECT_EQ(lost_of(Numbered<nav_t>), 3);
  EXPECT_EQ(lost_of(Numbered<raw_bytes_t>), 3);
  EXPECT_EQ(lost_of(Numbered<submap_t>), 3);
  EXPECT_EQ(lost_of(Numbered<health_t>), 3);
}

TEST(GapCounter, KeepsChannelsAndSendersApart) {
  GapCounter gaps;
  gaps.Add("IMU", Numbered<imu_t>(0));
  gaps.Add("IMU_2", Numbered<imu_t>(100));
  EXPECT_EQ(gaps.Add("IMU", Numbered<imu_t>(1)), 0);
  EXPECT_EQ(gaps.Add("IMU_2", Numbered<imu_t>(103)), 2);
  for (const std::int64_t seq : {0, 1, 2})
    for (const char* process : {"mapper", "optimizer"}) {
      health_t msg{};
      msg.process = process;
      msg.seq = seq + (process[0] == 'm' ? 0 : 50);
      EXPECT_EQ(gaps.Add("HEALTH", Encoded(msg)), 0);
    }
  // Both drivers of one bus.
  for (const std::int64_t seq : {0, 1, 5})
    for (const char* source : {"can:can0#imu-driver", "can:can0#dvl-driver"}) {
      raw_bytes_t msg{};
      msg.source = source;
      msg.seq = seq + (source[9] == 'i' ? 0 : 900);
      EXPECT_EQ(gaps.Add("RAW_CAN", Encoded(msg)), seq == 5 ? 3 : 0) << source << seq;
    }
  EXPECT_THAT(gaps.lost(),
              testing::ElementsAre(testing::Pair("IMU_2", 2), testing::Pair("RAW_CAN", 6)));
  EXPECT_EQ(gaps.total(), 8);
}

TEST(GapCounter, IsNotFooledByForeignOrDamagedMessages) {
  GapCounter gaps;
  const std::vector<std::uint8_t> whole = Numbered<health_t>(7);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_EQ(gaps.Add("HEALTH", Bytes(whole).first(size)), 0);
  counter_t foreign{};
  foreign.value = 1'000'000;
  EXPECT_EQ(gaps.Add("X", Encoded(foreign)), 0);
  EXPECT_EQ(gaps.Add("IMU", Numbered<imu_t>(-5)), 0);
  EXPECT_EQ(gaps.total(), 0);
}

TEST(GapCounter, IsBoundedWhateverChannelsThereAre) {
  GapCounter gaps;
  for (int i = 0; i < 10'000; ++i)
    for (const std::int64_t seq : {0, 2}) gaps.Add("C" + std::to_string(i), Numbered<imu_t>(seq));
  EXPECT_LE(gaps.lost().size(), 200u);
}

constexpr auto kInterval = std::chrono::milliseconds(1);

// One log, without a dive around it.
class OneLog : public EventSink {
 public:
  explicit OneLog(const std::filesystem::path& path) : log_(path) {}
  void Write(const LogEvent& event) override {
    log_.Write(event.utime, event.channel, event.data.data(), event.data.size());
  }
  void Flush() override { log_.Flush(); }
  std::function<void()> Syncer() override { return log_.Syncer(); }
  Figures figures() const override {
    return {.events = log_.events(), .bytes = log_.bytes(), .file = {}};
  }

 private:
  EventLogWriter log_;
};

TEST(LogWriter, WritesAllThatIsQueuedBeforeItEnds) {
  const TemporaryDir dir;
  const auto path = dir.path() / "a.lcmlog";
  LogWriter writer(std::make_unique<OneLog>(path), 100'000'000, std::chrono::hours(1));
  for (int i = 0; i < 20'000; ++i) writer.Add(Event(i, 200));
  writer.Finish();
  EXPECT_EQ(EventsIn(path), 20'000);
  EXPECT_EQ(writer.status().events_written, 20'000);
  EXPECT_EQ(writer.status().events_dropped, 0);
  EXPECT_EQ(writer.status().queued_bytes, 0);
}

TEST(LogWriter, CountsWhatTheQueueHasNoRoomFor) {
  const TemporaryDir dir;
  const auto path = dir.path() / "a.lcmlog";
  LogWriter writer(std::make_unique<OneLog>(path), 10'000, std::chrono::hours(1));
  for (int i = 0; i < 100; ++i) writer.Add(Event(i, 1'000));
  EXPECT_LE(writer.status().queued_bytes, 10'000);
  const std::int64_t dropped = writer.status().events_dropped;
  EXPECT_GT(dropped, 80);
  writer.Finish();
  EXPECT_EQ(EventsIn(path), 100 - dropped);
}

TEST(LogWriter, SkipsAndCountsWhatNoLogCanHoldAndRecordsTheRest) {
  const TemporaryDir dir;
  const auto path = dir.path() / "a.lcmlog";
  LogWriter writer(std::make_unique<OneLog>(path), 100'000'000, kInterval);
  writer.Add(Event(0, 200));
  writer.Add({0, "", {1}});
  writer.Add({0, std::string(64, 'x'), {1}});
  for (int i = 1; i < 100; ++i) writer.Add(Event(i, 200));
  writer.Finish();
  EXPECT_EQ(EventsIn(path), 100);
  EXPECT_EQ(writer.status().events_unloggable, 2);
  EXPECT_EQ(writer.status().events_dropped, 0);
  EXPECT_EQ(writer.status().error, "");
}

TEST(LogWriter, OutlastsAFullDiskWithoutLosingWhatItTook) {
  std::signal(SIGXFSZ, SIG_IGN);
  const TemporaryDir dir;
  const auto path = dir.path() / "a.lcmlog";
  rlimit unlimited{};
  getrlimit(RLIMIT_FSIZE, &unlimited);
  rlimit full = unlimited;
  full.rlim_cur = 100'050;
  LogWriter writer(std::make_unique<OneLog>(path), 100'000'000, kInterval);
  setrlimit(RLIMIT_FSIZE, &full);
  for (int i = 0; i < 5'000; ++i) writer.Add(Event(i, 200));
  while (writer.status().error.empty()) std::this_thread::yield();
  EXPECT_THAT(writer.status().error, HasSubstr("a.lcmlog: "));
  // While it tries again, a part of an event stands at the end for a moment.
  const auto ends_with_a_whole_event = [&] { return std::filesystem::file_size(path) % 229 == 0; };
  for (int i = 0; i < 1000 && !ends_with_a_whole_event(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(ends_with_a_whole_event());
  setrlimit(RLIMIT_FSIZE, &unlimited);
  while (!writer.status().error.empty()) std::this_thread::yield();
  writer.Finish();
  EXPECT_EQ(EventsIn(path), 5'000);
  EXPECT_EQ(writer.status().events_dropped, 0);
}

TEST(LogWriter, CountsWhatAFullDiskKeptToTheEnd) {
  std::signal(SIGXFSZ, SIG_IGN);
  const TemporaryDir dir;
  const auto path = dir.path() / "a.lcmlog";
  rlimit unlimited{};
  getrlimit(RLIMIT_FSIZE, &unlimited);
  rlimit full = unlimited;
  full.rlim_cur = 100'050;
  LogWriter writer(std::make_unique<OneLog>(path), 100'000'000, kInterval);
  setrlimit(RLIMIT_FSIZE, &full);
  for (int i = 0; i < 5'000; ++i) writer.Add(Event(i, 200));
  writer.Finish();
  setrlimit(RLIMIT_FSIZE, &unlimited);
  const LogWriter::Status status = writer.status();
  EXPECT_EQ(status.events_written, EventsIn(path));
  EXPECT_EQ(status.events_written + status.events_dropped, 5'000);
}

// A pipe that nobody reads takes 64 kB and then blocks, as a disk that hangs does.
TEST(LogWriter, KnowsHowLongTheOldestEventHasWaitedForADiskThatHangs) {
  std::signal(SIGPIPE, SIG_IGN);
  const TemporaryDir dir;
  const std::string pipe = (dir / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  LogWriter writer(std::make_unique<OneLog>(pipe), 100'000'000, kInterval);
  EXPECT_EQ(writer.status().oldest_s, 0.0);
  for (int i = 0; i < 5'000; ++i) writer.Add(Event(i, 200));
  double age_s = 0.0;
  for (int i = 0; age_s < 0.3 && i < 10'000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const double before_s = std::exchange(age_s, writer.status().oldest_s);
    EXPECT_GE(age_s, before_s) << "the oldest, not the newest";
    writer.Add(Event(5'000 + i, 200));
  }
  EXPECT_GE(age_s, 0.3);
  close(reader);  // the write fails
  writer.Finish();
}

TEST(LogWriter, NothingIsOldOnceItIsWritten) {
  const TemporaryDir dir;
  LogWriter writer(std::make_unique<OneLog>(dir / "a.lcmlog"), 100'000'000, std::chrono::hours(1));
  writer.Add(Event(0, 200));
  while (writer.status().oldest_s == 0.0) std::this_thread::yield();
  writer.Finish();
  EXPECT_EQ(writer.status().oldest_s, 0.0);
}

TEST(LoggerNode, RecordsEveryChannelAndTellsWhatWasLost) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  Bus bus("memq://");
  LoggerNode node({}, dive, &bus);
  for (const std::int64_t seq : {0, 1, 5}) {
    imu_t msg{};
    msg.seq = seq;
    bus.Publish("IMU", msg);
  }
  bus.PublishBytes("FOREIGN", "x", 1);
  bus.HandleAll();
  node.UpdateHealth();
  EXPECT_EQ(node.health().counter("foreign_FOREIGN"), 1);
  EXPECT_EQ(node.health().counter("lost_IMU"), 3);
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
  EXPECT_THAT(node.health().text(), HasSubstr("3 on the way here"));
  for (int second = 0; second < 10; ++second) node.UpdateHealth();
  EXPECT_EQ(node.health().state(), HealthState::kOk) << "an old loss is counted, not told for ever";
  node.Finish();
  EventLogReader reader(dive.log() / "000.lcmlog");
  std::vector<std::string> channels;
  while (const auto event = reader.Next()) channels.push_back(event->channel);
  EXPECT_THAT(channels, testing::ElementsAre("IMU", "IMU", "IMU", "FOREIGN"));
}

TEST(LoggerNode, PutsRawBytesAndConfigurationIntoTheirFolders) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  Bus bus("memq://");
  LoggerNode node({}, dive, &bus);
  EXPECT_TRUE(std::filesystem::is_empty(dive.raw()));
  bus.PublishBytes("RAW_CAN", "x", 1);
  bus.PublishBytes("IMU", "x", 1);
  for (const config_t& part :
       ToLcm({"mapper", "1", "mapper.yaml", "a: 1\n"}, FromUtime(1'000'000), 0))
    bus.Publish("CONFIG", part);
  bus.HandleAll();
  node.Finish();
  const auto channels_in = [](const std::filesystem::path& log) {
    EventLogReader reader(log);
    std::vector<std::string> channels;
    while (const auto event = reader.Next()) channels.push_back(event->channel);
    return channels;
  };
  EXPECT_THAT(channels_in(dive.log() / "000.lcmlog"), testing::ElementsAre("IMU", "CONFIG"));
  EXPECT_THAT(channels_in(dive.raw() / "000.lcmlog"), testing::ElementsAre("RAW_CAN"));
  EXPECT_EQ(TextOf(dive.config() / "mapper.yaml"), "a: 1\n");
}

TEST(LoggerNode, AsksForTheConfigurationWithEveryLogThatItBegins) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  Bus bus("memq://");
  int requests = 0;
  bus.SubscribeBytes(
      "CONFIG_REQUEST", 0, [&](const std::string&, const void*, int) { ++requests; });
  LoggerConfig config;
  config.file_max_mb = 1;
  config.channels = "BIG";
  LoggerNode node(config, dive, &bus);
  const std::string bytes(200'000, 'x');
  for (int i = 0; i < 10; ++i) bus.PublishBytes("BIG", bytes.data(), bytes.size());
  bus.HandleAll();
  node.Finish();
  node.UpdateHealth();
  bus.HandleAll();
  EXPECT_EQ(node.file(), dive.log() / "001.lcmlog");
  EXPECT_EQ(requests, 1);
}

TEST(LoggerNode, NeverTouchesALogThatIsThere) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  std::ofstream(dive.log() / "000.lcmlog") << "somebody's dive";
  for (const char* name : {"001.lcmlog", "002.lcmlog"}) {
    Bus bus("memq://");
    LoggerNode node({}, dive, &bus);
    EXPECT_EQ(node.file().filename(), name);
  }
  EXPECT_EQ(std::filesystem::file_size(dive.log() / "000.lcmlog"), 15u);
}

TEST(LoggerNode, SaysWhereItCannotRecord) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  std::filesystem::remove_all(dir / "dives");
  Bus bus("memq://");
  EXPECT_THAT([&] { LoggerNode({}, dive, &bus); },
              ThrowsMessage<std::runtime_error>(EndsWith("/log: No such file or directory")));
}

// A dive that somebody spoils while it is recorded.
class SpoiltDive : public testing::Test {
 protected:
  void Send(const char* channel, int count) {
    for (int i = 0; i < count; ++i) bus.PublishBytes(channel, "x", 1);
    bus.HandleAll();
  }
  bool Says(const ConditionKind& kind) {
    node.UpdateHealth();
    const health_t health = node.health().Snapshot(0, 1.0);
    return std::any_of(health.conditions.begin(), health.conditions.end(), [&](const auto& c) {
      return c.name == kind.name;
    });
  }
  // Within the three seconds in which it has to be said.
  bool Eventually(const std::function<bool()>& happens) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(3);
    while (std::chrono::steady_clock::now() < deadline) {
      if (happens()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
  // Of the channels that the test sends on.
  static int Events(const std::filesystem::path& log) {
    EventLogReader reader(log);
    int events = 0;
    while (const auto event = reader.Next())
      events += event->channel == "A" || event->channel == "RAW_CAN" ? 1 : 0;
    return events;
  }

  const TemporaryDir dir;
  const DiveFolder dive{{dir / "dives", 60.0}, "logger", 0};
  Bus bus{"memq://"};
  LoggerNode node{{}, dive, &bus};
};

TEST_F(SpoiltDive, ADeletedDiveIsNamedAndBegunAnew) {
  Send("A", 3);
  ASSERT_TRUE(Eventually([&] { return std::filesystem::file_size(node.file()) > 0; }));
  std::filesystem::remove_all(dive.path());
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogVanished); }));
  Send("A", 5);
  node.Finish();
  EXPECT_EQ(Events(dive.log() / "000.lcmlog"), 5);
}

TEST_F(SpoiltDive, WithoutTheFolderOfTheDivesItWaits) {
  std::filesystem::rename(dir / "dives", dir / "elsewhere");
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogVanished); }));
  Send("A", 5);
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogNotWriting); }));
  EXPECT_FALSE(std::filesystem::exists(dir / "dives"));
  std::filesystem::rename(dir / "elsewhere", dir / "dives");
  node.Finish();
  EXPECT_EQ(Events(dive.log() / "001.lcmlog"), 5);
}

// As where the data disk is gone, and its mount point is a folder of the root disk.
TEST_F(SpoiltDive, AnotherDiskInItsPlaceIsNotWrittenTo) {
  struct stat own {
  }, other{};
  const std::filesystem::path elsewhere = std::filesystem::path("/dev/shm") / dir.path().filename();
  std::error_code error;
  std::filesystem::create_directory(elsewhere, error);
  if (error || stat(dir.path().c_str(), &own) != 0 || stat(elsewhere.c_str(), &other) != 0 ||
      own.st_dev == other.st_dev)
    GTEST_SKIP() << "needs /dev/shm on a file system of its own";
  std::filesystem::rename(dir / "dives", dir / "away");
  std::filesystem::create_directory_symlink(elsewhere, dir / "dives");
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogVanished); }));
  Send("A", 5);
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogNotWriting); }));
  EXPECT_TRUE(std::filesystem::is_empty(elsewhere));
  node.Finish();
  std::filesystem::remove(dir / "dives");
  std::filesystem::remove_all(elsewhere);
}

TEST_F(SpoiltDive, RawBytesThatCannotBeWrittenHoldUpNoOthers) {
  std::filesystem::remove(dive.raw());
  std::ofstream(dive.raw()) << "no folder";
  Send("RAW_CAN", 2);
  Send("A", 5);
  EXPECT_TRUE(Eventually([&] { return Says(conditions::kLogNotWriting); }));
  EXPECT_TRUE(Eventually([&] { return Events(dive.log() / "000.lcmlog") == 5; }));
  std::filesystem::remove(dive.raw());
  node.Finish();
  EXPECT_EQ(Events(dive.raw() / "000.lcmlog"), 2);
}

}  // namespace
}  // namespace seastitch
