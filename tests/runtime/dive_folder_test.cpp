#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/config/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::int64_t kNow = 1'795'342'500 * kSecond;  // 2026-11-22T10:15:00Z

class DiveFolderTest : public testing::Test {
 protected:
  DiveFolder Start(const std::string& process, std::int64_t now_utime) const {
    DiveFolder dive({dives(), 1800.0}, process, now_utime);
    dive.Enter(now_utime);
    return dive;
  }
  fs::path dives() const { return dir_ / "dives"; }
  std::size_t NumDives() const {
    std::size_t dives_found = 0;
    for (const auto& entry : fs::directory_iterator(dives())) dives_found += entry.is_directory();
    return dives_found;
  }
  const TemporaryDir dir_;
};

// Damaged, cut off, emptied or gone: the dive is not continued, and is named.
TEST_F(DiveFolderTest, ADiveWhoseRecordCannotBeReadIsNamedAndAnotherBegins) {
  std::int64_t now = kNow;
  for (const std::string damage : {"{\"format\": 1, \"num", "", "gone"}) {
    const fs::path record = Start("logger", now).path() / "dive.json";
    if (damage == "gone")
      fs::remove(record);
    else
      std::ofstream(record) << damage;
    const DiveFolder mapper = Start("mapper", now + 5 * kSecond);
    EXPECT_FALSE(mapper.resumed());
    EXPECT_NE(mapper.path(), record.parent_path());
    EXPECT_THAT(mapper.damaged(), HasSubstr(record.string()));
    EXPECT_EQ(Start("logger", now + 6 * kSecond).damaged(), "") << "the new one can be read";
    now += 4000 * kSecond;
  }
}

// The computer lost its clock with the power that damaged the record: the folder's name lies ahead.
TEST_F(DiveFolderTest, ADamagedDiveFromTheFutureIsSetAsideOnce) {
  std::ofstream(Start("logger", kNow).path() / "dive.json") << "{";
  constexpr std::int64_t kYearsBefore = kNow - 100'000'000 * kSecond;
  const DiveFolder logger = Start("logger", kYearsBefore);
  EXPECT_FALSE(logger.damaged().empty());
  for (int restart = 1; restart < 4; ++restart) {
    const DiveFolder mapper = Start("mapper", kYearsBefore + restart * kSecond);
    EXPECT_EQ(mapper.path(), logger.path()) << "one dive for both";
    EXPECT_EQ(mapper.damaged(), "");
  }
}

TEST_F(DiveFolderTest, TheFirstBeginsADiveAndTheOthersJoinIt) {
  const DiveFolder logger = Start("logger", kNow);
  EXPECT_EQ(logger.path(), dives() / "DIVE_20261122T101500Z");
  EXPECT_FALSE(logger.resumed());
  for (const fs::path& part : {logger.log(), logger.raw(), logger.map(), logger.config()})
    EXPECT_TRUE(fs::is_directory(part)) << part;
  const DiveFolder mapper = Start("mapper", kNow + kSecond);
  EXPECT_EQ(mapper.path(), logger.path());
  EXPECT_TRUE(mapper.resumed());
  const DiveRecord record = ReadDiveRecord(logger.path());
  EXPECT_EQ(record.number, 1);
  EXPECT_EQ(record.start_utime, kNow);
  EXPECT_EQ(record.last_utime, kNow + kSecond);
  ASSERT_EQ(record.processes.size(), 2u);
  EXPECT_FALSE(record.processes.at("mapper").version.empty());
  EXPECT_EQ(record.processes.at("mapper").starts, 1);
}

TEST_F(DiveFolderTest, ARestartGoesOnUpToTheLimitAndNotBeyond) {
  const DiveFolder first = Start("logger", kNow);
  first.SignOfLife(kNow + 7'200 * kSecond);
  EXPECT_EQ(Start("logger", kNow + 9'000 * kSecond).path(), first.path());
  EXPECT_EQ(ReadDiveRecord(first.path()).processes.at("logger").starts, 2);
  const DiveFolder next = Start("logger", kNow + (9'000 + 1'801) * kSecond);
  EXPECT_NE(next.path(), first.path());
  EXPECT_EQ(ReadDiveRecord(next.path()).number, 2);
}

TEST_F(DiveFolderTest, AClockThatHasGoneBackCountsAsWithin) {
  const DiveFolder first = Start("logger", kNow);
  EXPECT_EQ(Start("logger", 0).path(), first.path()) << "a computer without a clock";
  // The clock as it was written last counts, not the highest that ever was.
  Start("mapper", kNow + 86'400 * kSecond).SignOfLife(kNow);
  EXPECT_NE(Start("logger", kNow + 3'600 * kSecond).path(), first.path());
}

TEST_F(DiveFolderTest, TheNewestIsKnownByItsNumberWhenTheClockGoesBackBetweenDives) {
  Start("logger", kNow);
  CloseNewestDive(dives());
  const DiveFolder second = Start("logger", 3 * kSecond);
  EXPECT_EQ(second.path().filename(), "DIVE_19700101T000003Z");
  EXPECT_EQ(NewestDive(dives()), second.path());
  EXPECT_EQ(Start("mapper", 5 * kSecond).path(), second.path());
}

TEST_F(DiveFolderTest, ANewDiveBeginsWhenToldAndTheOldOneStaysClosed) {
  EXPECT_EQ(CloseNewestDive(dir_.path()), std::nullopt);
  const DiveFolder first = Start("mapper", kNow);
  EXPECT_EQ(CloseNewestDive(dives()), first.path());
  EXPECT_EQ(CloseNewestDive(dives()), std::nullopt);
  first.SignOfLife(kNow + kSecond);  // the mapper still runs
  const DiveFolder second = Start("logger", kNow);
  EXPECT_EQ(second.path().filename(), "DIVE_20261122T101500Z_2") << "in the same second";
  EXPECT_EQ(Start("mapper", kNow + 2 * kSecond).path(), second.path());
}

TEST_F(DiveFolderTest, SaysHowAProcessEnded) {
  const DiveFolder logger = Start("logger", kNow);
  const DiveFolder mapper = Start("mapper", kNow);
  logger.End(kNow + kSecond);
  const DiveRecord record = ReadDiveRecord(logger.path());
  EXPECT_TRUE(record.processes.at("logger").stopped);
  EXPECT_FALSE(record.processes.at("mapper").stopped);
}

// Such as a second mapper, which is refused by the lock of the first.
TEST_F(DiveFolderTest, AProcessThatDoesNotEnterLeavesNoTrace) {
  const DiveFolder mapper = Start("mapper", kNow);
  mapper.End(kNow + kSecond);
  const DiveFolder second({dives(), 1800.0}, "mapper", kNow + 2 * kSecond);
  EXPECT_EQ(second.path(), mapper.path());
  const DiveRecord record = ReadDiveRecord(mapper.path());
  EXPECT_EQ(record.processes.at("mapper").starts, 1);
  EXPECT_TRUE(record.processes.at("mapper").stopped);
  EXPECT_EQ(record.last_utime, kNow + kSecond);
}

TEST_F(DiveFolderTest, ADiveThatCannotBeReadIsLeftAlone) {
  const DiveFolder first = Start("logger", kNow);
  for (const char* text : {"", "{", "[]", "{\"format\": 1}", "{\"format\": 2, \"number\": 1}"}) {
    fs::remove_all(dives() / "DIVE_torn");
    fs::create_directories(dives() / "DIVE_torn");
    std::ofstream(dives() / "DIVE_torn" / "dive.json") << text;
    EXPECT_EQ(Start("logger", kNow).path(), first.path()) << text;
    EXPECT_THAT([&] { ReadDiveRecord(dives() / "DIVE_torn"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("dive.json: is no record of a dive")));
  }
}

TEST_F(DiveFolderTest, ManyThatStartAtOnceShareOneDive) {
  constexpr int kProcesses = 12;
  std::vector<pid_t> children;
  for (int i = 0; i < kProcesses; ++i) {
    const pid_t pid = fork();
    if (pid == 0) {
      try {
        const DiveFolder dive = Start("process_" + std::to_string(i), kNow);
        for (int n = 0; n < 5; ++n) dive.SignOfLife(kNow + n * kSecond);
        _exit(0);
      } catch (const std::exception&) {
        _exit(1);
      }
    }
    children.push_back(pid);
  }
  for (const pid_t pid : children) {
    int status = -1;
    waitpid(pid, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(NumDives(), 1u);
  EXPECT_EQ(ReadDiveRecord(*NewestDive(dives())).processes.size(), std::size_t{kProcesses});
}

TEST_F(DiveFolderTest, ADiskThatIsNotMountedIsNotMadeUp) {
  const DiveParams params{dir_ / "disk" / "dives", 1800.0};
  EXPECT_THAT([&] { DiveFolder(params, "logger", kNow); },
              ThrowsMessage<std::runtime_error>(EndsWith("dives: No such file or directory")));
  EXPECT_FALSE(fs::exists(dir_ / "disk"));
  EXPECT_THAT([&] { CheckDivesDir(params, "l.yaml"); },
              ThrowsMessage<ConfigError>(testing::AllOf(HasSubstr("l.yaml: dives_dir: '"),
                                                        EndsWith("in a directory that is there"))));
  EXPECT_NO_THROW(CheckDivesDir({dives(), 1800.0}, "l.yaml"));
  EXPECT_THAT(
      [&] {
        CheckDivesDir({dir_.Write("file", ""), 1800.0}, "l.yaml");
      },
      ThrowsMessage<ConfigError>(EndsWith("is not a directory")));
}

// Such as a lock that belongs to root. An old dive must not be recorded to for that.
TEST_F(DiveFolderTest, TheLoggerJoinsAnOldDiveOfAFailedDiskOnly) {
  const DiveParams params{dives(), 1800.0};
  const fs::path old = Start("logger", kNow).path();
  fs::remove(dives() / ".lock");
  fs::create_directory(dives() / ".lock");
  constexpr std::int64_t kWeek = 7 * 86'400 * kSecond;
  EXPECT_THAT(
      [&] { DiveFolder(params, "logger", kNow + kWeek, DiveFolder::JoinNewest::kIfDiskFailed); },
      ThrowsMessage<ConfigError>(HasSubstr("dives: ")));
  EXPECT_EQ(DiveFolder(params, "mapper", kNow + kWeek).path(), old) << "NAV goes on";
}

TEST_F(DiveFolderTest, DivesDirIsRelativeToTheConfiguration) {
  for (const char* text : {"../dives", "../dives/", "./../dives//"}) {
    DiveParams params{text, 1800.0};
    ResolveDivesDir("/etc/seastitch/logger.yaml", &params);
    EXPECT_EQ(params.dives_dir, "/etc/dives") << text;
  }
}

TEST_F(DiveFolderTest, TheKeeperSaysWhenTheProcessStopsInOrder) {
  const DiveFolder dive = Start("logger", kNow);
  { const DiveKeeper keeper(dive); }  // as in a process that ends by an exception
  EXPECT_FALSE(ReadDiveRecord(dive.path()).processes.at("logger").stopped);
  DiveKeeper keeper(dive);
  keeper.End();
  EXPECT_TRUE(ReadDiveRecord(dive.path()).processes.at("logger").stopped);
}

}  // namespace
}  // namespace seastitch
