#include "tools/info.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/convert/channels.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/durable_file.hpp"
#include "common/storage/event_log.hpp"
#include "tools/message_types.hpp"

namespace seastitch {
namespace {

// What is counted of a channel.
struct Figures {
  std::int64_t events = 0;
  std::int64_t bytes = 0;
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
  std::int64_t longest_gap_us = 0;
  std::int64_t clock_steps_back = 0;
  std::int64_t lost = 0;
  std::int64_t undecodable = 0;
  // One watch a sender: HEALTH and RAW_CAN have several.
  std::map<std::string, SequenceWatch> senders;
};

// Of numbers that a damaged log may hold: what does not fit is the largest or the smallest.
std::int64_t Difference(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b < 0 ? INT64_MAX : INT64_MIN;
}
std::int64_t Sum(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b < 0 ? INT64_MIN : INT64_MAX;
}

void CountSequence(const LogEvent& event, const Channel& channel, Figures* figures) {
  if (!channel.decodes(event.data)) {
    ++figures->undecodable;
    return;
  }
  if (const std::optional<MessagePlace> place = PlaceOf(event.data))
    figures->lost = Sum(figures->lost, figures->senders[place->sender].Add(place->seq));
}

void Count(const LogEvent& event, Figures* figures) {
  if (figures->events == 0) figures->first_utime = event.utime;
  if (figures->events > 0) {
    const std::int64_t gap = Difference(event.utime, figures->last_utime);
    figures->longest_gap_us = std::max(figures->longest_gap_us, gap);
    if (gap < 0) ++figures->clock_steps_back;
  }
  figures->last_utime = event.utime;
  figures->bytes += static_cast<std::int64_t>(event.data.size());
  ++figures->events;
  if (const Channel* channel = FindChannel(event.channel)) CountSequence(event, *channel, figures);
}

double RateHz(const Figures& c) {
  const double span_s = static_cast<double>(Difference(c.last_utime, c.first_utime)) * 1e-6;
  return span_s > 0.0 ? static_cast<double>(c.events - 1) / span_s : 0.0;
}

void PrintText(const std::map<std::string, Figures>& channels,
               const MessageTypes& types,
               std::int64_t damaged_bytes) {
  std::printf("%-16s %9s %10s %10s %10s %7s %7s\n",
              "channel",
              "events",
              "MB",
              "rate Hz",
              "gap s",
              "lost",
              "bad");
  std::int64_t first = INT64_MAX;
  std::int64_t last = INT64_MIN;
  std::int64_t steps = 0;
  for (const auto& [name, c] : channels) {
    std::printf("%-16s %9lld %10.3f %10.2f %10.3f %7lld %7lld\n",
                name.c_str(),
                static_cast<long long>(c.events),
                static_cast<double>(c.bytes) * 1e-6,
                RateHz(c),
                static_cast<double>(c.longest_gap_us) * 1e-6,
                static_cast<long long>(c.lost),
                static_cast<long long>(c.undecodable));
    first = std::min(first, c.first_utime);
    last = std::max(last, c.last_utime);
    steps += c.clock_steps_back;
  }
  std::printf("duration %.3f s, clock steps back %lld, damaged bytes %lld\n",
              static_cast<double>(Difference(last, first)) * 1e-6,
              static_cast<long long>(steps),
              static_cast<long long>(damaged_bytes));
  for (const MessageTypes::Unreadable& unreadable : types.UnreadableChannels())
    std::printf("%s\n", ToString(unreadable).c_str());
}

void PrintJson(const std::map<std::string, Figures>& channels,
               const MessageTypes& types,
               std::int64_t damaged_bytes) {
  nlohmann::ordered_json json;
  json["damaged_bytes"] = damaged_bytes;
  for (const auto& [name, c] : channels) {
    json["channels"][name] = {{"events", c.events},
                              {"bytes", c.bytes},
                              {"rate_hz", RateHz(c)},
                              {"first_utime", c.first_utime},
                              {"last_utime", c.last_utime},
                              {"longest_gap_s", static_cast<double>(c.longest_gap_us) * 1e-6},
                              {"clock_steps_back", c.clock_steps_back},
                              {"lost", c.lost},
                              {"undecodable", c.undecodable}};
  }
  json["unreadable"] = nlohmann::ordered_json::array();
  for (const MessageTypes::Unreadable& unreadable : types.UnreadableChannels())
    json["unreadable"].push_back({{"channel", unreadable.channel->name},
                                  {"fingerprint", FingerprintText(unreadable.fingerprint)},
                                  {"expected", unreadable.channel->type}});
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int RunInfo(const InfoOptions& options) {
  EventLogReader reader(options.log);
  std::optional<EventLogWriter> repaired;
  if (options.repair_to) {
    if (std::filesystem::exists(*options.repair_to)) {
      throw std::runtime_error(options.repair_to->string() + ": exists already");
    }
    repaired.emplace(*options.repair_to, IfExists::kRefuse);
  }
  std::map<std::string, Figures> channels;
  MessageTypes types;
  while (const std::optional<LogEvent> event = reader.Next()) {
    Count(*event, &channels[event->channel]);
    types.Add(*event);
    if (repaired)
      repaired->Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
  if (repaired) {
    repaired->Sync();
    SyncFolder(std::filesystem::absolute(*options.repair_to).parent_path());
  }
  if (options.json) {
    PrintJson(channels, types, reader.damaged_bytes());
  } else {
    PrintText(channels, types, reader.damaged_bytes());
  }
  return EXIT_SUCCESS;
}

}  // namespace seastitch
