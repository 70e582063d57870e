#include "common/storage/event_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/eventlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "tests/support/files.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kEvents = 40;
constexpr std::size_t kDataSize = 100;
constexpr std::size_t kEventSize = 28 + 3 + kDataSize;  // channel "IMU"

std::vector<std::uint8_t> DataOf(int i) {
  return std::vector<std::uint8_t>(kDataSize, static_cast<std::uint8_t>(i));
}

class EventLogTest : public testing::Test {
 protected:
  std::filesystem::path path() const { return dir_.path() / "a.lcmlog"; }

  // Writes kEvents events and gives the file's bytes.
  std::string WriteLog() const {
    EventLogWriter writer(path());
    for (int i = 0; i < kEvents; ++i) writer.Write(1000 + i, "IMU", DataOf(i).data(), kDataSize);
    writer.Flush();
    return Content();
  }
  std::string Content() const { return TextOf(path()); }
  void SetContent(const std::string& bytes) const { dir_.Write("a.lcmlog", bytes); }

  // utime of every event; fails where an event is not one that was written.
  std::vector<int> ReadNumbers(std::int64_t* damaged = nullptr) const {
    EventLogReader reader(path());
    std::vector<int> numbers;
    while (const auto event = reader.Next()) {
      const int number = static_cast<int>(event->utime - 1000);
      EXPECT_EQ(event->channel, "IMU");
      EXPECT_EQ(event->data, DataOf(number));
      numbers.push_back(number);
    }
    if (damaged != nullptr) *damaged = reader.damaged_bytes();
    return numbers;
  }

  TemporaryDir dir_;
};

std::vector<int> AllBut(std::vector<int> missing) {
  std::vector<int> numbers;
  for (int i = 0; i < kEvents; ++i)
    if (std::find(missing.begin(), missing.end(), i) == missing.end()) numbers.push_back(i);
  return numbers;
}

TEST_F(EventLogTest, GivesBackEveryEvent) {
  WriteLog();
  std::int64_t damaged = -1;
  EXPECT_EQ(ReadNumbers(&damaged), AllBut({}));
  EXPECT_EQ(damaged, 0);
}

TEST_F(EventLogTest, KeepsEventsLargerThanItsBuffers) {
  const std::vector<std::uint8_t> large(3'000'000, 0xED);
  {
    EventLogWriter writer(path());
    for (int i = 0; i < 3; ++i) writer.Write(i, "BIG", large.data(), large.size());
    writer.Write(3, "EMPTY", nullptr, 0);
  }
  EventLogReader reader(path());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reader.Next()->data, large);
  EXPECT_TRUE(reader.Next()->data.empty());
  EXPECT_FALSE(reader.Next());
}

TEST_F(EventLogTest, IsWhatLcmItselfReads) {
  WriteLog();
  lcm_eventlog_t* log = lcm_eventlog_create(path().c_str(), "r");
  ASSERT_NE(log, nullptr);
  for (int i = 0; i < kEvents; ++i) {
    lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log);
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
    EXPECT_EQ(event->timestamp, 1000 + i);
    EXPECT_STREQ(event->channel, "IMU");
    EXPECT_EQ(event->datalen, static_cast<int>(kDataSize));
    lcm_eventlog_free_event(event);
  }
  EXPECT_EQ(lcm_eventlog_read_next_event(log), nullptr);
  lcm_eventlog_destroy(log);
}

TEST_F(EventLogTest, ReadsWhatLcmItselfWrites) {
  lcm_eventlog_t* log = lcm_eventlog_create(path().c_str(), "w");
  ASSERT_NE(log, nullptr);
  std::string channel = "IMU";
  for (int i = 0; i < kEvents; ++i) {
    std::vector<std::uint8_t> data = DataOf(i);
    lcm_eventlog_event_t event{};
    event.timestamp = 1000 + i;
    event.channellen = 3;
    event.datalen = static_cast<int>(data.size());
    event.channel = channel.data();
    event.data = data.data();
    ASSERT_EQ(lcm_eventlog_write_event(log, &event), 0);
  }
  lcm_eventlog_destroy(log);
  EXPECT_EQ(ReadNumbers(), AllBut({}));
}

TEST_F(EventLogTest, OfAnyTornLengthGivesEveryWholeEvent) {
  const std::string whole = WriteLog();
  for (std::size_t size = kEventSize; size < 2 * kEventSize + 40; size += 3) {
    SetContent(whole.substr(0, size));
    const std::size_t events = size / kEventSize;
    std::int64_t damaged = -1;
    EXPECT_EQ(ReadNumbers(&damaged).size(), events) << size;
    EXPECT_EQ(damaged, static_cast<std::int64_t>(size - events * kEventSize));
  }
}

// lcm-logger -a onto a torn log: LCM's reader never reaches what was appended. (Torn within the
// sync word, the event before has nothing behind it that vouches for it.)
TEST_F(EventLogTest, AppendedToATornOneIsReadOn) {
  const std::string whole = WriteLog();
  for (std::size_t cut = 4; cut < kEventSize; cut += 9) {
    SetContent(whole.substr(0, 20 * kEventSize + cut) + whole.substr(21 * kEventSize));
    EXPECT_EQ(ReadNumbers(), AllBut({20})) << cut;
  }
}

// An event counts as whole where another one follows it, so a wrong sync word takes the event
// before along; any other wrong bit of a header takes its own event at most.
TEST_F(EventLogTest, LosesAtMostTwoEventsToAFlippedBit) {
  const std::string whole = WriteLog();
  for (std::size_t byte = 0; byte < kEventSize; ++byte) {
    for (const int bit : {0, 3, 7}) {
      const bool in_time = byte >= 12 && byte < 20;  // not checkable
      const bool in_payload = byte >= 28;
      if (in_time || in_payload) continue;
      std::string bad = whole;
      bad[20 * kEventSize + byte] = static_cast<char>(bad[20 * kEventSize + byte] ^ (1 << bit));
      SetContent(bad);
      const std::vector<int> numbers = ReadNumbers();
      const bool in_sync = byte < 4;
      const bool in_number = byte >= 4 && byte < 12;
      EXPECT_EQ(numbers,
                in_sync     ? AllBut({19, 20})
                : in_number ? AllBut({})
                            : AllBut({20}))
          << byte << " bit " << bit;
    }
  }
}

TEST_F(EventLogTest, SkipsAHoleOfZerosAndOfNoise) {
  const std::string whole = WriteLog();
  std::mt19937 random(1);
  std::string noise(1'500'000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  for (const std::string& hole : {std::string(1'500'000, '\0'), noise, std::string(99, '\xED')}) {
    SetContent(whole.substr(0, 10 * kEventSize) + hole + whole.substr(10 * kEventSize));
    std::int64_t damaged = 0;
    // The event before the hole is followed by nothing known, and is not vouched for.
    EXPECT_EQ(ReadNumbers(&damaged), AllBut({9}));
    EXPECT_EQ(damaged, static_cast<std::int64_t>(hole.size() + kEventSize));
  }
}

// Small and large events, some of them damaged: what is not wanted makes no difference.
TEST_F(EventLogTest, GivesTheWantedPartsOfTheSameEvents) {
  std::mt19937 random(5);
  {
    EventLogWriter writer(path());
    for (int i = 0; i < 200; ++i) {
      const std::size_t size = random() % (i % 3 == 0 ? 60'000 : 300);
      std::vector<std::uint8_t> data(size);
      for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random());
      writer.Write(1000 + i, i % 3 == 0 ? "RAW" : "IMU", data.data(), size);
    }
  }
  const std::string whole = Content();
  for (int damages = 0; damages < 20; ++damages) {
    std::string bytes = whole;
    for (int k = 0; k < damages; ++k) bytes[random() % bytes.size()] ^= 0x10;
    if (damages % 4 == 3) bytes.resize(bytes.size() - random() % 1000);
    SetContent(bytes);
    EventLogReader all(path());
    EventLogReader parts(path(), [](const std::string& channel) {
      return channel == "RAW" ? std::size_t{16} : std::size_t{100'000};
    });
    while (const auto expected = all.Next()) {
      const auto event = parts.Next();
      ASSERT_TRUE(event);
      EXPECT_EQ(event->utime, expected->utime);
      EXPECT_EQ(event->channel, expected->channel);
      EXPECT_EQ(SizeInLog(*event), SizeInLog(*expected));
      EXPECT_EQ(parts.position(), all.position());
      std::vector<std::uint8_t> wanted = expected->data;
      if (event->channel == "RAW") wanted.resize(std::min<std::size_t>(16, wanted.size()));
      EXPECT_EQ(event->data, wanted);
    }
    EXPECT_FALSE(parts.Next());
    EXPECT_EQ(parts.damaged_bytes(), all.damaged_bytes());
    EXPECT_EQ(parts.tears(), all.tears());
  }
}

// Every 28 bytes a header that claims a gigabyte: no allocation, no reading of it, no hang.
TEST_F(EventLogTest, OfHostileLengthsIsRefusedQuickly) {
  std::string hostile;
  for (int i = 0; i < 40'000; ++i)
    hostile += std::string("\xED\xA1\xDA\x01", 4) + std::string(16, '\0') +
               std::string("\0\0\0\3\x0f\xff\xff\xff", 8);
  SetContent(hostile);
  EXPECT_THAT([this] { EventLogReader reader(path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("a.lcmlog: holds no LCM event")));
}

// Every 28 bytes a header whose event ends at one place, just beyond what was read at once: that
// place is not read anew as a whole for each of them.
TEST_F(EventLogTest, OfLengthsThatEndTogetherIsRefusedQuickly) {
  constexpr std::uint32_t kHeaders = 37'000, kEnd = (1 << 20) + 500;
  ByteWriter hostile;
  for (std::uint32_t i = 0; i < kHeaders; ++i) {
    hostile.Be(std::uint32_t{0xEDA1DA01});
    hostile.Be(std::uint64_t{0});
    hostile.Be(std::uint64_t{0});
    hostile.Be(std::uint32_t{3});
    hostile.Be(std::uint32_t{kEnd - 28 * i - 31});
  }
  const std::vector<std::uint8_t> headers = hostile.Release();
  SetContent(std::string(headers.begin(), headers.end()) + std::string(2 << 20, 'x'));
  const auto all = [](const std::string&) { return std::size_t{1} << 30; };
  EXPECT_THAT([&] { EventLogReader reader(path(), all); },
              ThrowsMessage<std::runtime_error>(HasSubstr("a.lcmlog: holds no LCM event")));
}

TEST_F(EventLogTest, OfNothingIsRefusedWithOneLine) {
  SetContent("");
  EXPECT_THAT([this] { EventLogReader reader(path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("a.lcmlog: holds no LCM event")));
  EXPECT_THAT([this] { EventLogReader reader(dir_.path() / "absent"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("absent: No such file")));
  EXPECT_THAT([this] { EventLogReader reader(dir_.path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("not a file")));
}

TEST_F(EventLogTest, RefusesToReplaceWhereAsked) {
  WriteLog();
  EXPECT_THROW(EventLogWriter(path(), IfExists::kRefuse), std::runtime_error);
  EXPECT_EQ(ReadNumbers().size(), static_cast<std::size_t>(kEvents)) << "untouched";
  EventLogWriter writer(path(), IfExists::kReplace);
  EXPECT_EQ(std::filesystem::file_size(path()), 0u);
}

TEST_F(EventLogTest, RefusesAnEventThatTheFormatCannotHold) {
  EventLogWriter writer(path());
  EXPECT_THROW(writer.Write(0, "", nullptr, 0), std::runtime_error);
  EXPECT_THROW(writer.Write(0, std::string(64, 'x'), nullptr, 0), std::runtime_error);
  EXPECT_THROW(writer.Write(0, std::string("A\0B", 3), nullptr, 0), std::runtime_error);
}

TEST_F(EventLogTest, GivesBackEveryNameThatLcmAllows) {
  const std::vector<std::string> names = {
      "TWO WORDS", "S\xC3\xB8lv\xC3\xA5g", " ", "\x01\xFF", std::string(63, '/')};
  {
    EventLogWriter writer(path());
    for (const std::string& name : names) writer.Write(5, name, "abc", 3);
  }
  EventLogReader reader(path());
  for (const std::string& name : names) EXPECT_EQ(reader.Next().value().channel, name);
  EXPECT_FALSE(reader.Next());
  EXPECT_EQ(reader.damaged_bytes(), 0);
}

// A disk that is full, played by a limit on the size of files.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

TEST_F(EventLogTest, EndsWithAWholeEventOnAFullDiskAndGoesOnWhenThereIsRoom) {
  EventLogWriter writer(path());
  {
    const FullDisk disk(10 * kEventSize + 50);
    for (int i = 0; i < 20; ++i) writer.Write(1000 + i, "IMU", DataOf(i).data(), kDataSize);
    EXPECT_THAT([&] { writer.Flush(); },
                ThrowsMessage<std::runtime_error>(HasSubstr("a.lcmlog: ")));
    EXPECT_EQ(std::filesystem::file_size(path()), 10 * kEventSize) << "the torn event is cut off";
    EXPECT_EQ(writer.bytes(), static_cast<std::int64_t>(10 * kEventSize));
    EXPECT_EQ(ReadNumbers().size(), 10u);
    EXPECT_THROW(writer.Sync(), std::runtime_error) << "still full";
    EXPECT_EQ(std::filesystem::file_size(path()), 10 * kEventSize);
  }
  for (int i = 20; i < kEvents; ++i) writer.Write(1000 + i, "IMU", DataOf(i).data(), kDataSize);
  writer.Sync();
  std::int64_t damaged = -1;
  EXPECT_EQ(ReadNumbers(&damaged), AllBut({})) << "nothing was lost meanwhile";
  EXPECT_EQ(damaged, 0);
}

TEST_F(EventLogTest, TakesNoMoreThanItsBufferOnAFullDisk) {
  EventLogWriter writer(path());
  const FullDisk disk(1000);
  const std::vector<std::uint8_t> data(10'000);
  int taken = 0;
  try {
    for (; taken < 1'000; ++taken) writer.Write(taken, "IMU", data.data(), data.size());
  } catch (const std::runtime_error&) {
    // The disk is full and the buffer too.
  }
  EXPECT_GT(taken, 10);
  EXPECT_LT(taken, 40);
  EXPECT_THROW(writer.Write(0, "IMU", data.data(), data.size()), std::runtime_error);
}

}  // namespace
}  // namespace seastitch
