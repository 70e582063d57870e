// Whatever comes, and wherever the power is cut: what is read back is what went in, in order, up to
// the cut.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "logger/log_writer.hpp"
#include "logger/recording.hpp"
#include "tests/support/property.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {

static bool operator==(const LogEvent& a, const LogEvent& b) {
  return a.utime == b.utime && a.channel == b.channel && a.data == b.data;
}

namespace {

namespace fs = std::filesystem;

LogEvent AnyEvent() {
  using Text = std::vector<std::uint8_t>;
  const auto length = *rc::gen::weightedOneOf<int>(
      {{20, rc::gen::inRange(1, 64)}, {1, rc::gen::just(0)}, {1, rc::gen::inRange(64, 80)}});
  // Bytes of a sync word among them, and now and then a zero.
  const auto byte = rc::gen::weightedOneOf<std::uint8_t>(
      {{8, rc::gen::arbitrary<std::uint8_t>()},
       {1, rc::gen::element<std::uint8_t>(0xED, 0xA1, 0xDA, 0x01)}});
  const Text name = *rc::gen::container<Text>(static_cast<std::size_t>(length), byte);
  LogEvent event;
  event.utime = *rc::gen::arbitrary<std::int64_t>();
  event.channel = std::string(name.begin(), name.end());
  if (*rc::gen::inRange(0, 3) == 0) event.channel = "RAW_" + event.channel;
  event.data = *rc::gen::container<Text>(static_cast<std::size_t>(*rc::gen::inRange(0, 400)), byte);
  return event;
}

std::vector<LogEvent> EventsIn(const fs::path& log) {
  std::vector<LogEvent> events;
  try {
    EventLogReader reader(log);
    while (auto event = reader.Next()) events.push_back(std::move(*event));
  } catch (const std::runtime_error&) {  // holds no whole event
  }
  return events;
}

std::vector<LogEvent> EventsOf(const std::vector<fs::path>& logs) {
  std::vector<LogEvent> all;
  for (const fs::path& log : logs)
    for (LogEvent& event : EventsIn(log)) all.push_back(std::move(event));
  return all;
}

std::vector<fs::path> LogsIn(const fs::path& folder) {
  std::vector<fs::path> logs;
  for (const auto& entry : fs::directory_iterator(folder)) logs.push_back(entry.path());
  std::sort(logs.begin(), logs.end());
  return logs;
}

void Repair(const fs::path& log, const fs::path& to) {
  EventLogWriter repaired(to);
  for (const LogEvent& event : EventsIn(log))
    repaired.Write(event.utime, event.channel, event.data.data(), event.data.size());
}

// Whole events in the first `bytes` of a log.
std::size_t WholeIn(const std::vector<LogEvent>& events, std::uintmax_t bytes) {
  std::uintmax_t end = 0;
  std::size_t whole = 0;
  for (; whole < events.size() && end + SizeInLog(events[whole]) <= bytes; ++whole)
    end += SizeInLog(events[whole]);
  return whole;
}

void CutAnywhere(const fs::path& folder, const std::vector<LogEvent>& written) {
  const std::vector<fs::path> logs = LogsIn(folder);
  if (logs.empty()) return;
  const fs::path& last = logs.back();
  const std::vector<fs::path> before(logs.begin(), logs.end() - 1);
  const std::size_t whole_before = EventsOf(before).size();
  const std::vector<LogEvent> in_last(written.begin() + static_cast<std::ptrdiff_t>(whole_before),
                                      written.end());
  const auto cut = *rc::gen::inRange<std::uintmax_t>(0, fs::file_size(last) + 1);
  fs::resize_file(last, cut);
  const std::size_t left = WholeIn(in_last, cut);
  const std::vector<LogEvent> expected(in_last.begin(),
                                       in_last.begin() + static_cast<std::ptrdiff_t>(left));
  RC_ASSERT(EventsIn(last) == expected);
  const fs::path repaired = folder / "repaired.lcmlog";
  Repair(last, repaired);
  RC_ASSERT(EventsIn(repaired) == expected);
  RC_ASSERT(fs::file_size(repaired) <= cut);
}

RC_GTEST_PROP(RecordingProperty, GivesBackWhatWentInUpToTheCut, ()) {
  const TemporaryDir dir;
  const DiveFolder dive({dir / "dives", 60.0}, "logger", 0);
  std::vector<LogEvent> log, raw;
  std::int64_t unloggable = 0;
  const std::int64_t split = *rc::gen::inRange(1, 20) == 1 ? 300'000 : 1'000'000'000;
  {
    LogWriter writer(
        std::make_unique<Recording>(dive, SplitParams{split, INT64_MAX}, QuotaParams{0, 0, false}),
        1'000'000'000,
        std::chrono::milliseconds(1));
    const int events = *rc::gen::inRange(1, 60);
    for (int i = 0; i < events; ++i) {
      const LogEvent event = AnyEvent();
      if (!IsLoggable(event.channel, event.data.size()))
        ++unloggable;
      else
        (event.channel.starts_with("RAW_") ? raw : log).push_back(event);
      writer.Add(event);
    }
    writer.Finish();
    RC_ASSERT(writer.status().events_unloggable == unloggable);
    RC_ASSERT(writer.status().events_dropped == 0);
  }
  RC_ASSERT(EventsOf(LogsIn(dive.log())) == log);
  RC_ASSERT(EventsOf(LogsIn(dive.raw())) == raw);
  CutAnywhere(dive.log(), log);
  CutAnywhere(dive.raw(), raw);
}

}  // namespace
}  // namespace seastitch
