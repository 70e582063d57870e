#include "common/runtime/health.hpp"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <memory>

namespace seastitch {
namespace {

const char* ToString(HealthState state) {
  switch (state) {
    case HealthState::kStarting: return "starting";
    case HealthState::kOk: return "ok";
    case HealthState::kDegraded: return "degraded";
    case HealthState::kLost: return "lost";
  }
  return "unknown";
}

}  // namespace

void Health::SetState(HealthState state, const std::string& text) {
  if (state != state_) {
    const bool bad = state == HealthState::kDegraded || state == HealthState::kLost;
    spdlog::log(bad ? spdlog::level::warn : spdlog::level::info,
                "{} -> {}: {}",
                ToString(state_),
                ToString(state),
                text);
  }
  state_ = state;
  text_ = text;
}

std::int64_t Health::counter(const std::string& name) const {
  const auto found = counters_.find(name);
  return found == counters_.end() ? 0 : found->second;
}

health_t Health::Snapshot(std::int64_t now_utime, double period_s) {
  health_t msg{};
  msg.utime = now_utime;
  msg.seq = seq_++;
  msg.process = process_;
  msg.state = static_cast<std::int8_t>(state_);
  msg.text = text_;
  for (const auto& [name, value] : counters_) {
    counter_t counter{};
    counter.name = name;
    counter.value = value;
    msg.counters.push_back(counter);
  }
  for (auto& [name, ticks] : ticks_) {
    msg.rate_names.push_back(name);
    msg.rate_hz.push_back(period_s > 0.0 ? static_cast<double>(ticks) / period_s : 0.0);
    ticks = 0;  // a stream that stops stays in the list, with 0 Hz
  }
  msg.num_counters = static_cast<std::int32_t>(msg.counters.size());
  msg.num_rates = static_cast<std::int32_t>(msg.rate_hz.size());
  return msg;
}

void Health::PublishEverySecond(Bus* bus, EventLoop* loop) {
  using Clock = std::chrono::steady_clock;
  const auto last = std::make_shared<Clock::time_point>(Clock::now());
  loop->Every(std::chrono::seconds(1), [this, bus, last] {
    const Clock::time_point now = Clock::now();
    const double period_s = std::chrono::duration<double>(now - *last).count();
    *last = now;
    bus->Publish("HEALTH", Snapshot(NowUtime(), period_s));
    sd_notifyf(0, "WATCHDOG=1\nSTATUS=%s: %s", ToString(state_), text_.c_str());
  });
}

std::int64_t NowUtime() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_epoch).count();
}

}  // namespace seastitch
