#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "seastitch/health_t.hpp"

namespace seastitch {

enum class HealthState : std::int8_t { kStarting = 0, kOk = 1, kDegraded = 2, kLost = 3 };

// Counters, rates and state of one process: streams are counted here, not logged.
class Health {
 public:
  explicit Health(std::string process) : process_(std::move(process)) {}

  // Adds to a counter, such as "mbes_bad_checksum". Counters appear with their first count.
  void Count(const std::string& counter, std::int64_t n = 1) { counters_[counter] += n; }
  void Set(const std::string& counter, std::int64_t value) { counters_[counter] = value; }
  // One message or frame of a stream whose rate is to be told, such as "imu".
  void Tick(const std::string& stream) { ++ticks_[stream]; }
  // State and one line for people. Logs the change.
  void SetState(HealthState state, const std::string& text);

  std::int64_t counter(const std::string& name) const;
  HealthState state() const { return state_; }
  const std::string& text() const { return text_; }

  // The message, and the start of the next rate period.
  health_t Snapshot(std::int64_t now_utime, double period_s);

  // Publishes HEALTH on the bus once a second, and feeds systemd's watchdog.
  void PublishEverySecond(Bus* bus, EventLoop* loop);

 private:
  std::string process_;
  HealthState state_ = HealthState::kStarting;
  std::string text_ = "starting";
  std::map<std::string, std::int64_t> counters_;
  std::map<std::string, std::int64_t> ticks_;
  std::int64_t seq_ = 0;
};

// The system clock, microseconds. For health and for stamping what has no clock of its own.
std::int64_t NowUtime();

}  // namespace seastitch
