#include "tools/info.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/runtime/bus.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/covariance_request_t.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "seastitch/sound_velocity_profile_t.hpp"
#include "seastitch/submap_points_t.hpp"
#include "seastitch/submap_t.hpp"

namespace seastitch {
namespace {

struct Channel {
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

template <class Msg>
std::string Sender(const Msg& msg) {
  if constexpr (requires { msg.process; }) return msg.process;
  if constexpr (
      requires { msg.source; } && requires { msg.part; })
    return msg.source;
  if constexpr (requires { msg.from; }) return msg.from;
  return {};
}

template <class Msg>
void CountSequence(const LogEvent& event, Channel* channel) {
  Msg msg{};
  const int size = static_cast<int>(event.data.size());
  if (msg.decode(event.data.data(), 0, size) != size) {
    ++channel->undecodable;
    return;
  }
  channel->lost = Sum(channel->lost, channel->senders[Sender(msg)].Add(msg.seq));
}

using Counter = void (*)(const LogEvent&, Channel*);
const std::map<std::string, Counter>& KnownChannels() {
  static const std::map<std::string, Counter> known{
      {"IMU", CountSequence<imu_t>},
      {"DVL", CountSequence<dvl_t>},
      {"DEPTH", CountSequence<depth_t>},
      {"MBES_PING", CountSequence<mbes_ping_t>},
      {"SVP", CountSequence<sound_velocity_profile_t>},
      {"POSITION_FIX", CountSequence<position_fix_t>},
      {"RAW_CAN", CountSequence<raw_bytes_t>},
      {"RAW_DVL", CountSequence<raw_bytes_t>},
      {"RAW_MBES", CountSequence<raw_bytes_t>},
      {"NAV", CountSequence<nav_t>},
      {"SUBMAP", CountSequence<submap_t>},
      {"SUBMAP_POINTS", CountSequence<submap_points_t>},
      {"GRAPH_UPDATE", CountSequence<graph_update_t>},
      {"GRAPH_REQUEST", CountSequence<graph_request_t>},
      {"POSE_GRAPH", CountSequence<pose_graph_t>},
      {"COVARIANCE_REQUEST", CountSequence<covariance_request_t>},
      {"COVARIANCES", CountSequence<covariances_t>},
      {"HEALTH", CountSequence<health_t>},
  };
  return known;
}

void Count(const LogEvent& event, Channel* channel) {
  if (channel->events == 0) channel->first_utime = event.utime;
  if (channel->events > 0) {
    const std::int64_t gap = Difference(event.utime, channel->last_utime);
    channel->longest_gap_us = std::max(channel->longest_gap_us, gap);
    if (gap < 0) ++channel->clock_steps_back;
  }
  channel->last_utime = event.utime;
  channel->bytes += static_cast<std::int64_t>(event.data.size());
  ++channel->events;
  if (const auto known = KnownChannels().find(event.channel); known != KnownChannels().end()) {
    known->second(event, channel);
  }
}

double RateHz(const Channel& c) {
  const double span_s = static_cast<double>(Difference(c.last_utime, c.first_utime)) * 1e-6;
  return span_s > 0.0 ? static_cast<double>(c.events - 1) / span_s : 0.0;
}

void PrintText(const std::map<std::string, Channel>& channels, std::int64_t damaged_bytes) {
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
}

void PrintJson(const std::map<std::string, Channel>& channels, std::int64_t damaged_bytes) {
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
    repaired.emplace(*options.repair_to);
  }
  std::map<std::string, Channel> channels;
  while (const std::optional<LogEvent> event = reader.Next()) {
    Count(*event, &channels[event->channel]);
    if (repaired)
      repaired->Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
  if (options.json) {
    PrintJson(channels, reader.damaged_bytes());
  } else {
    PrintText(channels, reader.damaged_bytes());
  }
  return EXIT_SUCCESS;
}

}  // namespace seastitch
