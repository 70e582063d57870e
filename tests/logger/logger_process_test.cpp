// The real seastitch-logger on a udpm bus of its own.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/health.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using Clock = std::chrono::steady_clock;

// A port of this test process alone: others run beside it.
std::string BusUrl() {
  return "udpm://239.255.76.67:" + std::to_string(20'000 + getpid() % 40'000) + "?ttl=0";
}

// Started and ready, as systemd sees it; killed with its owner.
class LoggerProcess {
 public:
  LoggerProcess(const TemporaryDir& dir,
                const std::string& config,
                std::optional<rlim_t> max_file = std::nullopt) {
    const std::string config_file = dir.Write("logger.yaml", config);
    const std::string socket_path = (dir.path() / "notify").string();
    std::filesystem::remove(socket_path);
    notify_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket_path.c_str(), sizeof address.sun_path - 1);
    if (bind(notify_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("bind " + socket_path);
    const std::string bus_url = BusUrl();
    const std::string logger = Program("seastitch-logger");
    pid_ = fork();
    if (pid_ == 0) {
      setenv("NOTIFY_SOCKET", socket_path.c_str(), 1);
      if (max_file) {
        std::signal(SIGXFSZ, SIG_IGN);
        SetMaxFile(0, *max_file);
      }
      execl(logger.c_str(),
            "seastitch-logger",
            "--config",
            config_file.c_str(),
            "--lcm-url",
            bus_url.c_str(),
            nullptr);
      _exit(127);
    }
    AwaitReady();
  }
  ~LoggerProcess() {
    if (pid_ > 0) Stop(SIGKILL);
    close(notify_);
  }
  LoggerProcess(const LoggerProcess&) = delete;
  LoggerProcess& operator=(const LoggerProcess&) = delete;

  // Exit status as waitpid() gives it; -1 where it did not end.
  int Stop(int signal) {
    kill(pid_, signal);
    const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
    pollfd ended{pidfd, POLLIN, 0};
    const bool in_time = poll(&ended, 1, 20'000) == 1;
    close(pidfd);
    if (!in_time) kill(pid_, SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return in_time ? status : -1;
  }

  void AllowFileSize(rlim_t bytes) const { SetMaxFile(pid_, bytes); }

  // How often it fed the watchdog since the last call.
  int Feedings() const {
    int feedings = 0;
    std::array<char, 8192> buffer{};
    for (ssize_t size = 0;
         (size = recv(notify_, buffer.data(), buffer.size(), MSG_DONTWAIT)) >= 0;) {
      const std::string_view text(buffer.data(), static_cast<std::size_t>(size));
      if (text.find("WATCHDOG=1") != std::string_view::npos) ++feedings;
    }
    return feedings;
  }

 private:
  static void SetMaxFile(pid_t pid, rlim_t bytes) {
    rlimit limit{};
    prlimit(pid, RLIMIT_FSIZE, nullptr, &limit);
    limit.rlim_cur = bytes;
    prlimit(pid, RLIMIT_FSIZE, &limit, nullptr);
  }

  void AwaitReady() const {
    pollfd ready{notify_, POLLIN, 0};
    char message[256] = {};
    ASSERT_EQ(poll(&ready, 1, 20'000), 1) << "seastitch-logger does not start";
    ASSERT_GT(recv(notify_, message, sizeof message - 1, 0), 0);
    EXPECT_THAT(message, testing::HasSubstr("READY=1"));
  }

  int notify_ = -1;
  pid_t pid_ = -1;
};

constexpr std::size_t kPayload = 150;
constexpr std::size_t kEventSize = 227;  // in the log: header, channel, message

void PublishRaw(Bus* bus, std::int64_t seq) {
  raw_bytes_t msg{};
  msg.recv_utime = NowUtime();
  msg.seq = seq;
  msg.num_parts = 1;
  msg.size = kPayload;
  msg.data.assign(kPayload, static_cast<std::uint8_t>(seq));
  bus->Publish("RAW_TEST", msg);
}

std::vector<std::int64_t> NumbersIn(const std::filesystem::path& path) {
  EventLogReader reader(path);
  std::vector<std::int64_t> numbers;
  while (const auto event = reader.Next()) {
    if (event->channel != "RAW_TEST") continue;
    raw_bytes_t msg{};
    EXPECT_EQ(msg.decode(event->data.data(), 0, static_cast<int>(event->data.size())),
              event->data.size());
    numbers.push_back(msg.seq);
  }
  return numbers;
}

std::vector<std::int64_t> UpTo(std::int64_t n) {
  std::vector<std::int64_t> numbers;
  for (std::int64_t i = 0; i < n; ++i) numbers.push_back(i);
  return numbers;
}

class LoggerProcessTest : public testing::Test {
 protected:
  // The dive's first log of raw bytes.
  std::filesystem::path path() const { return PathIn(dir_ / "dives"); }
  static std::filesystem::path PathIn(const std::filesystem::path& dives_dir) {
    return NewestDive(dives_dir).value() / "raw" / "000.lcmlog";
  }
  std::string Config() const {
    return "dives_dir: " + (dir_ / "dives").string() + "\ndisk_min_free_mb: 0\n";
  }
  TemporaryDir dir_;
};

TEST_F(LoggerProcessTest, RefusesToRecordADiveThatAnotherRecords) {
  LoggerProcess logger(dir_, Config());
  const CommandResult second =
      RunCommand(Program("seastitch-logger") + " --config " + (dir_ / "logger.yaml").string() +
                 " --lcm-url " + "'" + BusUrl() + "'");
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.output.find("log: in use by process "), std::string::npos) << second.output;
  EXPECT_EQ(std::count(second.output.begin(), second.output.end(), '\n'), 1) << second.output;
  EXPECT_EQ(logger.Stop(SIGTERM), 0);
}

TEST_F(LoggerProcessTest, LosesNothingOfABurstThatIsFollowedBySigterm) {
  LoggerProcess logger(dir_, Config());
  Bus bus(BusUrl());
  for (int i = 0; i < 2'000; ++i) PublishRaw(&bus, i);
  EXPECT_EQ(logger.Stop(SIGTERM), 0);
  EXPECT_EQ(NumbersIn(path()), UpTo(2'000));
}

TEST_F(LoggerProcessTest, HasOnDiskWhatCameAHundredMillisecondsBeforeItWasKilled) {
  LoggerProcess logger(dir_, Config());
  Bus bus(BusUrl());
  for (int i = 0; i < 500; ++i) PublishRaw(&bus, i);
  // Flushing goes by the clock, not by traffic: 100 ms, and as much for a busy machine.
  const auto deadline = Clock::now() + std::chrono::seconds(10);
  const auto flushed = [&] {
    std::error_code not_yet;
    const auto size = std::filesystem::file_size(path(), not_yet);
    return (!not_yet && size >= 500 * kEventSize) || Clock::now() > deadline;
  };
  const auto published = Clock::now();
  while (!flushed()) usleep(1'000);
  RecordProperty("flushed_after_ms",
                 static_cast<int>((Clock::now() - published) / std::chrono::milliseconds(1)));
  for (int i = 500; i < 1'000; ++i) PublishRaw(&bus, i);
  logger.Stop(SIGKILL);
  const std::vector<std::int64_t> numbers = NumbersIn(path());
  ASSERT_GE(numbers.size(), 500u);
  EXPECT_EQ(numbers, UpTo(static_cast<std::int64_t>(numbers.size())));

  LoggerProcess next(dir_, Config());
  PublishRaw(&bus, 0);
  next.Stop(SIGTERM);
  EXPECT_EQ(NumbersIn(path().parent_path() / "001.lcmlog"), UpTo(1))
      << "a new file, not the torn one";
}

TEST_F(LoggerProcessTest, SaysInHealthThatTheDiskIsFullAndGoesOnWhenThereIsRoom) {
  LoggerProcess logger(dir_, Config(), 100'050);
  Bus bus(BusUrl());
  std::optional<health_t> health;
  bus.Subscribe<health_t>("HEALTH", 0, [&](const health_t& msg) { health = msg; });
  const auto filled = Clock::now();
  for (int i = 0; i < 2'000; ++i) PublishRaw(&bus, i);
  const auto deadline = Clock::now() + std::chrono::seconds(10);
  pollfd ready{bus.fd(), POLLIN, 0};
  while ((!health || health->state != health_t::STATE_DEGRADED) && Clock::now() < deadline)
    if (poll(&ready, 1, 100) > 0) bus.HandleReady();
  ASSERT_TRUE(health);
  RecordProperty("named_after_ms",
                 static_cast<int>((Clock::now() - filled) / std::chrono::milliseconds(1)));
  EXPECT_EQ(health->process, "logger");
  EXPECT_EQ(health->state, health_t::STATE_DEGRADED);
  EXPECT_THAT(health->text, testing::HasSubstr("the log cannot be written: "));
  EXPECT_LT(NumbersIn(path()).size(), 2'000u);
  logger.AllowFileSize(RLIM_INFINITY);
  EXPECT_EQ(logger.Stop(SIGTERM), 0);
  EXPECT_EQ(NumbersIn(path()), UpTo(2'000));
}

// A folder that is read-only while it is asked to be, for this test process alone. Needs root.
class ReadOnlyFolder {
 public:
  explicit ReadOnlyFolder(std::string folder) : folder_(std::move(folder)) {
    std::filesystem::create_directory(folder_);
    mounted_ = unshare(CLONE_NEWNS) == 0 && Mount("/", MS_REC | MS_PRIVATE) &&
               Mount(folder_.c_str(), MS_BIND);
  }
  ~ReadOnlyFolder() {
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  ReadOnlyFolder(const ReadOnlyFolder&) = delete;
  ReadOnlyFolder& operator=(const ReadOnlyFolder&) = delete;

  bool mounted() const { return mounted_; }
  bool Close() const { return Mount(folder_.c_str(), MS_REMOUNT | MS_BIND | MS_RDONLY); }
  bool Open() const { return Mount(folder_.c_str(), MS_REMOUNT | MS_BIND); }

 private:
  bool Mount(const char* where, unsigned long flags) const {
    return mount(folder_.c_str(), where, nullptr, flags, nullptr) == 0;
  }

  std::string folder_;
  bool mounted_ = false;
};

TEST_F(LoggerProcessTest, StartsOnADiskThatIsReadOnlySaysSoAndRecordsOnceItCan) {
  const ReadOnlyFolder disk((dir_ / "disk").string());
  if (!disk.mounted()) GTEST_SKIP() << "needs root";
  const std::filesystem::path dives_dir = dir_ / "disk" / "dives";
  const std::string config = "dives_dir: " + dives_dir.string() + "\ndisk_min_free_mb: 0\n";
  EXPECT_EQ(LoggerProcess(dir_, config).Stop(SIGTERM), 0);  // an earlier start of the dive
  ASSERT_TRUE(disk.Close());
  EXPECT_EQ(LoggerProcess(dir_, config).Stop(SIGTERM), 0) << "nothing to write, and no disk";

  LoggerProcess logger(dir_, config);
  Bus bus(BusUrl());
  std::optional<health_t> health;
  bus.Subscribe<health_t>("HEALTH", 0, [&](const health_t& msg) { health = msg; });
  const auto until = [&](const auto& reached) {
    const auto deadline = Clock::now() + std::chrono::seconds(30);
    pollfd ready{bus.fd(), POLLIN, 0};
    while ((!health || !reached(*health)) && Clock::now() < deadline)
      if (poll(&ready, 1, 100) > 0) bus.HandleReady();
    return health && reached(*health);
  };
  for (int i = 0; i < 100; ++i) PublishRaw(&bus, i);
  EXPECT_TRUE(until([](const health_t& msg) {
    return msg.text.find("Read-only file system") != std::string::npos;
  })) << health->text;
  EXPECT_EQ(health->state, health_t::STATE_DEGRADED);
  EXPECT_THAT(health->text, testing::HasSubstr("the log cannot be written: "));
  ASSERT_TRUE(disk.Open());
  EXPECT_TRUE(until([](const health_t& msg) { return msg.state == health_t::STATE_OK; }))
      << health->text;
  EXPECT_THAT(health->text, testing::HasSubstr("/001.lcmlog"));
  EXPECT_EQ(logger.Stop(SIGTERM), 0);
  EXPECT_EQ(NumbersIn(PathIn(dives_dir)), UpTo(100));
}

TEST_F(LoggerProcessTest, EndsWithOneLineWhereAReadOnlyDiskHasNoDive) {
  const ReadOnlyFolder disk((dir_ / "disk").string());
  if (!disk.mounted()) GTEST_SKIP() << "needs root";
  const std::string dives_dir = (dir_ / "disk" / "dives").string();
  const std::string config = dir_.Write("logger.yaml", "dives_dir: " + dives_dir + "\n");
  ASSERT_TRUE(disk.Close());
  const CommandResult ended = RunCommand("timeout 30 " + Program("seastitch-logger") +
                                         " --config " + config + " --lcm-url '" + BusUrl() + "'");
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_EQ(ended.output, "seastitch-logger: " + dives_dir + ": Read-only file system\n");
}

// A disk of its own that can be made to hang: a file system in a file, mounted for this test
// process alone. Needs root and loop devices.
class FreezableDisk {
 public:
  explicit FreezableDisk(const TemporaryDir& dir) : mount_point_((dir / "disk").string()) {
    const std::string image = (dir / "disk.img").string();
    std::filesystem::create_directory(mount_point_);
    mounted_ = unshare(CLONE_NEWNS) == 0 && Shell("mount --make-rprivate /") &&
               Shell("truncate -s 64M " + image) && Shell("mkfs.ext4 -q " + image) &&
               Shell("mount -o loop " + image + " " + mount_point_);
  }
  ~FreezableDisk() {
    if (mounted_) Shell("umount " + mount_point_);
  }
  FreezableDisk(const FreezableDisk&) = delete;
  FreezableDisk& operator=(const FreezableDisk&) = delete;

  bool mounted() const { return mounted_; }
  bool Freeze() const { return Shell("fsfreeze -f " + mount_point_); }
  bool Thaw() const { return Shell("fsfreeze -u " + mount_point_); }
  const std::string& path() const { return mount_point_; }

 private:
  static bool Shell(const std::string& command) {
    return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
  }

  std::string mount_point_;
  bool mounted_ = false;
};

TEST_F(LoggerProcessTest, ADiskThatHangsIsNamedFeedsTheWatchdogAndLosesNothing) {
  const FreezableDisk disk(dir_);
  if (!disk.mounted()) GTEST_SKIP() << "needs root and a loop device";
  const std::filesystem::path dives_dir = disk.path() + "/dives";
  LoggerProcess logger(
      dir_, "dives_dir: " + dives_dir.string() + "\nchannels: RAW_TEST\ndisk_min_free_mb: 0\n");
  // Before the logger is ended: while the disk hangs nothing can end it.
  const std::shared_ptr<void> thaw(nullptr, [&](void*) { disk.Thaw(); });
  Bus bus(BusUrl());
  std::optional<health_t> health;
  bus.Subscribe<health_t>("HEALTH", 0, [&](const health_t& msg) { health = msg; });
  int fed = 0;
  // Systemd reads what the logger sends it at once; a queue of ten that nobody reads would hold the
  // logger up.
  const auto until = [&](const auto& reached) {
    const auto deadline = Clock::now() + std::chrono::seconds(60);
    pollfd ready{bus.fd(), POLLIN, 0};
    while ((!health || !reached(*health)) && Clock::now() < deadline) {
      if (poll(&ready, 1, 100) > 0) bus.HandleReady();
      fed += logger.Feedings();
    }
    return health && reached(*health);
  };
  const auto is_ok = [](const health_t& msg) { return msg.state == health_t::STATE_OK; };
  // By name: on a busy machine a late loop may be reported beside it.
  const auto names_the_disk = [](const health_t& msg) {
    return std::any_of(msg.conditions.begin(), msg.conditions.end(), [](const auto& condition) {
      return condition.name == conditions::kDiskStalled.name;
    });
  };
  ASSERT_TRUE(until(is_ok)) << "no HEALTH that is ok";
  ASSERT_TRUE(disk.Freeze());
  const auto frozen = Clock::now();
  for (int i = 0; i < 100; ++i) PublishRaw(&bus, i);
  ASSERT_TRUE(until(names_the_disk)) << health->text;
  RecordProperty("named_after_ms",
                 static_cast<int>((Clock::now() - frozen) / std::chrono::milliseconds(1)));
  EXPECT_EQ(health->state, health_t::STATE_DEGRADED);
  fed = 0;
  EXPECT_TRUE(until([&](const health_t&) { return fed >= 3; }))
      << "to be killed would lose what waits";
  EXPECT_TRUE(names_the_disk(*health)) << health->text;
  ASSERT_TRUE(disk.Thaw());
  EXPECT_TRUE(until(is_ok)) << health->text;
  EXPECT_EQ(logger.Stop(SIGTERM), 0);
  EXPECT_EQ(NumbersIn(PathIn(dives_dir)), UpTo(100));
}

}  // namespace
}  // namespace seastitch
