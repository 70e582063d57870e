#include "tests/logger/logger_fixtures.hpp"
#include "tests/support/files.hpp"

namespace seastitch {
namespace {

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

}  // namespace
}  // namespace seastitch
