// docs/message-versions.md: every event of every log that a version recorded is read by today's
// code.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "common/storage/event_log.hpp"
#include "tests/convert/example_messages.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxLogBytes = 300'000;

// Puts together what comes in parts.
struct Assemblers {
  SubmapAssembler submaps;
  PoseGraphAssembler graphs;
  ConfigAssembler configs;
};

template <class Msg>
bool IsTaken(const Msg& msg, Assemblers* assemblers) {
  if constexpr (requires { FromLcm(msg); }) {
    return FromLcm(msg).has_value();
  } else if constexpr (requires { assemblers->submaps.Add(msg); }) {
    assemblers->submaps.Add(msg);
    return assemblers->submaps.malformed() + assemblers->submaps.incomplete() == 0;
  } else if constexpr (requires { assemblers->graphs.Add(msg); }) {
    assemblers->graphs.Add(msg);
    return assemblers->graphs.malformed() == 0;
  } else if constexpr (requires { assemblers->configs.Add(msg); }) {
    assemblers->configs.Add(msg);
    return assemblers->configs.malformed() == 0;
  } else {
    return true;  // HEALTH, raw bytes and requests have no converter
  }
}

// Whether today's code reads a message of each channel.
std::map<std::string, std::function<bool(Bytes)>> Readers(Assemblers* assemblers) {
  std::map<std::string, std::function<bool(Bytes)>> readers;
  examples::ForEach([&](const char* channel, const auto& example) {
    using Msg = std::decay_t<decltype(example)>;
    readers[channel] = [assemblers](Bytes bytes) {
      Msg msg{};
      const int size = static_cast<int>(bytes.size());
      return msg.decode(bytes.data(), 0, size) == size && IsTaken(msg, assemblers);
    };
  });
  return readers;
}

TEST(RecordedLogs, OfEveryVersionAreReadByTodaysCode) {
  int logs = 0;
  for (const auto& entry : fs::directory_iterator(SourceDir() / "tests/data/logs")) {
    ++logs;
    EXPECT_LT(entry.file_size(), kMaxLogBytes) << entry.path();
    EventLogReader log(entry.path());
    Assemblers assemblers;
    const auto readers = Readers(&assemblers);
    std::set<std::string> channels;
    while (const std::optional<LogEvent> event = log.Next()) {
      ASSERT_TRUE(readers.contains(event->channel)) << event->channel;
      EXPECT_TRUE(readers.at(event->channel)(event->data)) << entry.path() << " " << event->channel;
      EXPECT_TRUE(PlaceOf(event->data)) << event->channel;
      channels.insert(event->channel);
    }
    EXPECT_EQ(log.damaged_bytes(), 0) << entry.path();
    EXPECT_EQ(channels.size(), Channels().size()) << entry.path();
  }
  EXPECT_GT(logs, 0);
}

}  // namespace
}  // namespace seastitch
