#include "common/runtime/process/self_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/health/health_values.hpp"

namespace seastitch {
namespace {

// Delay of the event loop [s] that HEALTH reports: HEALTH and the watchdog wait as long, and 40
// pings at 40 Hz.
constexpr double kLateS = 1.0;

std::int64_t Milliseconds(double seconds) { return std::llround(1e3 * seconds); }

std::string Seconds(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f s", seconds);
  return text;
}

}  // namespace

SelfWatch::Report SelfWatch::Check(const Bus& bus, double now_s, double late_s) {
  Report report;
  CheckBus(bus, now_s, &report);
  CheckSockets(now_s, &report);
  CheckLoop(now_s, late_s, &report);
  CheckAges(&report);
  return report;
}

void SelfWatch::CheckBus(const Bus& bus, double now_s, Report* report) {
  for (const auto& [channel, count] : bus.undecodable()) {
    if (count == 0) continue;
    report->counters["undecodable_" + channel] = count;
    FaultEvents<double>& events =
        undecodable_.try_emplace(channel, conditions::kUndecodableMessages).first->second;
    events.Follow(count, now_s);
    if (events.Holds(now_s))
      report->conditions.push_back(
          {&conditions::kUndecodableMessages, std::to_string(count) + " on " + channel});
  }
  report->counters["bus_decode_errors"] = bus.decode_errors();
  report->counters["bus_publish_errors"] = bus.publish_errors();
  unsent_.Follow(bus.publish_errors(), now_s);
  if (unsent_.Holds(now_s))
    report->conditions.push_back(
        {&conditions::kMessagesNotSent, std::to_string(bus.publish_errors())});
}

void SelfWatch::CheckSockets(double now_s, Report* report) {
  std::int64_t all = 0;
  for (const auto& [name, socket] : sockets_.Read()) {
    report->counters["socket_drops_" + name] = socket.drops;
    report->counters["socket_buffer_bytes_" + name] = socket.buffer_bytes;
    all += socket.drops;
    FaultEvents<double>& events = drops_.try_emplace(name, conditions::kSocketDrops).first->second;
    events.Follow(socket.drops, now_s);
    if (events.Holds(now_s))
      report->conditions.push_back({&conditions::kSocketDrops,
                                    std::to_string(socket.drops) + " on " + name +
                                        ", whose buffer has " +
                                        std::to_string(socket.buffer_bytes) + " bytes"});
  }
  report->counters[NameOf(HealthValue::kSocketDrops)] = all;
}

void SelfWatch::CheckLoop(double now_s, double late_s, Report* report) {
  report->counters["loop_late_ms"] = Milliseconds(late_s);
  if (late_s > kLateS) {
    late_.Add(now_s);
    longest_late_s_ = std::max(longest_late_s_, late_s);
  }
  if (late_.Holds(now_s))
    report->conditions.push_back({&conditions::kLoopLate, Seconds(longest_late_s_)});
  else
    longest_late_s_ = 0.0;
}

void SelfWatch::CheckAges(Report* report) const {
  for (const Age& age : ages_) {
    const double age_s = age.age_s();
    report->counters[age.name + "_age_ms"] = Milliseconds(age_s);
    if (age_s > age.limit_s)
      report->conditions.push_back({age.kind, age.name + " for " + Seconds(age_s)});
  }
}

}  // namespace seastitch
