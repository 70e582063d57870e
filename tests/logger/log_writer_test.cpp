#include "tests/logger/logger_fixtures.hpp"
#include "tests/support/files.hpp"

namespace seastitch {
namespace {

int EventsIn(const std::filesystem::path& path) {
  EventLogReader reader(path);
  int events = 0;
  while (const auto event = reader.Next()) EXPECT_EQ(event->utime, events++);
  EXPECT_EQ(reader.damaged_bytes(), 0);
  return events;
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
  node.UpdateHealth(100.0);
  EXPECT_EQ(node.health().counter("foreign_FOREIGN"), 1);
  EXPECT_EQ(node.health().counter("lost_IMU"), 3);
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
  EXPECT_THAT(node.health().text(), HasSubstr("3 on the way here"));
  node.UpdateHealth(110.0);
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
