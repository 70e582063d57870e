// The log of docs/message-versions.md: the first events of each channel of a log of the bench, and
// an example of every channel that it lacks.

#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "common/storage/event_log.hpp"
#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

constexpr int kEventsPerChannel = 5;

void WriteMessageLog(const std::string& bench_log, const std::string& out) {
  EventLogReader recorded(bench_log);
  EventLogWriter log(out);
  std::map<std::string, int> events;
  std::int64_t utime = 0;
  while (const std::optional<LogEvent> event = recorded.Next()) {
    if (++events[event->channel] > kEventsPerChannel) continue;
    utime = event->utime;
    log.Write(utime, event->channel, event->data.data(), event->data.size());
  }
  examples::ForEach([&](const char* channel, const auto& msg) {
    if (!events.contains(channel)) log.Write(utime, channel, msg);
  });
  log.Flush();
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: write_message_log BENCH_LOG OUT\n");
    return 64;
  }
  seastitch::WriteMessageLog(argv[1], argv[2]);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
