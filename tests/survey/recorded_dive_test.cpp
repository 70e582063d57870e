#include "survey/read/recorded_dive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/health_t.hpp"
#include "survey/read/merged_logs.hpp"
#include "tests/support/files.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::Pair;

constexpr std::int64_t kSecond = 1'000'000;

class RecordedDive : public testing::Test {
 protected:
  // DEPTH with the numbers [from, to), one a second from `at_s` on.
  fs::path Depths(const std::string& name, std::int64_t from, std::int64_t to, std::int64_t at_s) {
    const fs::path path = dir_ / name;
    fs::create_directories(path.parent_path());
    EventLogWriter log(path);
    for (std::int64_t seq = from; seq < to; ++seq) {
      depth_t msg{};
      msg.utime = (1000 + seq) * kSecond;
      msg.seq = seq;
      log.Write((at_s + seq - from) * kSecond, "DEPTH", msg);
    }
    return path;
  }
  static void WriteConfig(EventLogWriter* log, const std::string& text, std::int64_t at_s) {
    for (const config_t& part :
         ToLcm({"mapper", "1.0", "mapper.yaml", text}, FromUtime(at_s * kSecond), 0))
      log->Write(at_s * kSecond, "CONFIG", part);
  }
  static RecordedLogs Look(const std::vector<fs::path>& logs) { return ScanLogs(logs, true); }
  static std::vector<std::int64_t> NumbersIn(const RecordedLogs& logs) {
    MergedLogs merged(logs, {}, true);
    std::vector<std::int64_t> numbers;
    while (const auto event = merged.Next()) {
      depth_t msg{};
      msg.decode(event->data.data(), 0, static_cast<int>(event->data.size()));
      numbers.push_back(msg.seq);
    }
    return numbers;
  }
  const TemporaryDir dir_;
};

TEST_F(RecordedDive, OrdersLogsByTheNumbersOfTheirMessages) {
  // The clock went back by a day between the second and the third.
  const fs::path third = Depths("a.lcmlog", 20, 30, 100);
  const fs::path first = Depths("b.lcmlog", 0, 10, 86'500);
  const fs::path second = Depths("c.lcmlog", 10, 20, 86'510);
  EXPECT_THAT(Look({third, first, second}).recorders,
              ElementsAre(ElementsAre(first, second, third)));
}

TEST_F(RecordedDive, ARareChannelDoesNotLeadPastTheLogBetween) {
  // HEALTH is in the first log and in the third; the clock went back before the third.
  const auto with_health = [this](const std::string& name, std::int64_t from, std::int64_t at_s) {
    const fs::path path = dir_ / name;
    EventLogWriter log(path);
    health_t health{};
    health.utime = (1000 + from) * kSecond;
    health.seq = from / 20;
    health.process = "mapper";
    log.Write(at_s * kSecond, "HEALTH", health);
    for (std::int64_t seq = from; seq < from + 10; ++seq) {
      depth_t msg{};
      msg.utime = (1000 + seq) * kSecond;
      msg.seq = seq;
      log.Write((at_s + seq - from) * kSecond, "DEPTH", msg);
    }
    return path;
  };
  const fs::path first = with_health("c.lcmlog", 0, 86'500);
  const fs::path second = Depths("b.lcmlog", 10, 20, 86'510);
  const fs::path third = with_health("a.lcmlog", 20, 100);
  EXPECT_THAT(Look({first, second, third}).recorders,
              ElementsAre(ElementsAre(first, second, third)));
}

TEST_F(RecordedDive, OrdersWhatBeganAnewByTheNumbersOfTheFiles) {
  // The power was cut: all senders began at 0, and the clock a year earlier.
  const fs::path first = Depths("log/000.lcmlog", 50, 60, 9'000'000);
  const fs::path second = Depths("log/001.lcmlog", 0, 10, 1'000);
  const fs::path third = Depths("log/002.lcmlog", 10, 20, 1'010);
  EXPECT_THAT(Look({third, second, first}).recorders,
              ElementsAre(ElementsAre(first, second, third)));
}

// As `cat later.lcmlog earlier.lcmlog > joined.lcmlog` makes it; the last log repeats nothing and
// is in order.
TEST_F(RecordedDive, TakesAFileApartThatWasJoinedInTheWrongOrder) {
  std::string joined;
  for (const auto& log :
       {Depths("c", 20, 30, 1'020), Depths("a", 0, 10, 1'000), Depths("b", 10, 20, 1'010)})
    joined += TextOf(log);
  const RecordedLogs logs = Look({dir_.Write("joined.lcmlog", joined)});
  ASSERT_EQ(logs.recorders.size(), 1U);
  EXPECT_EQ(logs.recorders[0].size(), 2U);
  std::vector<std::int64_t> all(30);
  std::iota(all.begin(), all.end(), std::int64_t{0});
  EXPECT_EQ(NumbersIn(logs), all);
}

// The recorder's clock steps back: its messages go on.
TEST_F(RecordedDive, AStepOfTheClockLeavesALogWhole) {
  std::string joined;
  for (const auto& log : {Depths("a", 0, 10, 2'000), Depths("b", 10, 20, 1'000)})
    joined += TextOf(log);
  const fs::path log = dir_.Write("joined.lcmlog", joined);
  EXPECT_THAT(Look({log}).recorders, ElementsAre(ElementsAre(log)));
}

TEST_F(RecordedDive, OrdersOtherLogsByTime) {
  const fs::path second = Depths("a.lcmlog", 0, 10, 2'000);
  const fs::path first = Depths("b.lcmlog", 50, 60, 1'000);
  EXPECT_THAT(Look({second, first}).recorders,
              ElementsAre(ElementsAre(first), ElementsAre(second)));
}

TEST_F(RecordedDive, TakesALogThatIsNamedTwiceOnce) {
  const fs::path log = Depths("a.lcmlog", 0, 10, 1'000);
  EXPECT_THAT(Look({log, dir_ / "." / "a.lcmlog"}).recorders, ElementsAre(ElementsAre(log)));
}

TEST_F(RecordedDive, MergesTwoRecordersAndLeavesOutWhatBothHave) {
  const fs::path ours = Depths("ours/000.lcmlog", 0, 6, 1'000);
  const fs::path theirs = Depths("theirs.lcmlog", 3, 10, 1'003);
  const RecordedLogs logs = Look({theirs, ours});
  EXPECT_THAT(logs.recorders, ElementsAre(ElementsAre(ours), ElementsAre(theirs)));
  EXPECT_THAT(NumbersIn(logs), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  MergedLogs merged(logs, {}, true);
  while (merged.Next()) {
  }
  EXPECT_THAT(merged.refused(), ElementsAre(Pair("doubled_DEPTH", 3)));
}

TEST_F(RecordedDive, PutsAConfigurationTogetherThatWasCutBetweenFiles) {
  const std::string text(120'000, 'x');
  const std::vector<config_t> parts =
      ToLcm({"mapper", "1.0", "mapper.yaml", text}, FromUtime(5 * kSecond), 0);
  ASSERT_EQ(parts.size(), 3u);
  const fs::path first = Depths("b.lcmlog", 0, 10, 0);
  const fs::path second = dir_ / "a.lcmlog";
  {
    EventLogWriter log(dir_ / "c.lcmlog");
    log.Write(0, "CONFIG", parts[0]);
  }
  {
    EventLogWriter log(second);
    log.Write(1, "CONFIG", parts[1]);
    log.Write(2, "CONFIG", parts[2]);
  }
  const RecordedLogs logs = Look({second, dir_ / "c.lcmlog"});
  ASSERT_EQ(logs.configuration.size(), 1u);
  EXPECT_EQ(logs.configuration[0].text, text);
}

TEST_F(RecordedDive, KnowsTheNewestOfAConfigurationThatChanged) {
  {
    EventLogWriter log(dir_ / "a.lcmlog");
    WriteConfig(&log, "wrong", 1);
    WriteConfig(&log, "wrong", 2);
    WriteConfig(&log, "mended", 3);
  }
  const RecordedLogs logs = Look({dir_ / "a.lcmlog"});
  EXPECT_EQ(logs.configuration.size(), 2u);
  EXPECT_EQ(logs.Newest().at("mapper.yaml").text, "mended");
  EXPECT_THAT(logs.Changed(), ElementsAre(Pair("mapper.yaml", 2)));
}

}  // namespace
}  // namespace seastitch
