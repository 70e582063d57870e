#include "mapper/input/process_clocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

namespace seastitch {
namespace {

constexpr double kLongestUptimeS = 1e9;
constexpr double kLongestBetweenHeartbeatsS = 1.5;
constexpr double kSilentS = 2.5;
constexpr double kHeardS = 3.0;  // heartbeats come once a second
// Smallest step: less is a clock that is slewed, or a process that was delayed between its clocks.
constexpr double kSmallestStepS = 0.5;
constexpr std::size_t kMostProcesses = 64;
// Heartbeats after which a process counts as heard.
constexpr int kEstablished = 2;

bool IsOwn(const std::string& process) {
  constexpr std::array<std::string_view, 7> kOwn{
      "imu-driver", "dvl-driver", "mbes-driver", "nav-driver", "mapper", "optimizer", "logger"};
  return std::find(kOwn.begin(), kOwn.end(), process) != kOwn.end();
}

bool IsStep(Duration d) { return std::abs(ToSeconds(d)) > kSmallestStepS; }

}  // namespace

void ProcessClocks::Add(const Heartbeat& heartbeat) {
  const double uptime_s = heartbeat.uptime_s;
  if (!(uptime_s >= 0.0 && uptime_s < kLongestUptimeS)) return;
  const auto known = processes_.find(heartbeat.process);
  if (known == processes_.end() && processes_.size() >= kMostProcesses) return;
  const bool is_first = known == processes_.end();
  Process& p = processes_[heartbeat.process];
  const double last_s = std::exchange(p.uptime_s, uptime_s);
  const bool restarted = !is_first && uptime_s < last_s;
  if (restarted) p.before_restart_s = last_s;
  const bool is_other = p.before_restart_s && uptime_s >= *p.before_restart_s &&
                        uptime_s - last_s > kLongestBetweenHeartbeatsS;
  if (is_first || restarted || is_other) {
    p.to_elapsed_s = elapsed_s_ - uptime_s;
    p.heartbeats = 0;
  }
  elapsed_s_ = std::max(elapsed_s_, uptime_s + p.to_elapsed_s);
  p.heard_s = elapsed_s_;
  stepped_ += StepSeenBy(&p, heartbeat);
}

// The step that this heartbeat confirms; 0 without one.
Duration ProcessClocks::StepSeenBy(Process* p, const Heartbeat& heartbeat) {
  const Duration clock =
      heartbeat.time.time_since_epoch() - FromSeconds(heartbeat.uptime_s) - stepped_;
  if (p->heartbeats == 0) p->clock = clock;
  p->heartbeats = std::min(p->heartbeats + 1, kEstablished);
  const Duration step = clock - p->clock;
  const bool is_same = suspected_ && suspected_->process == heartbeat.process;
  if (!IsStep(step)) {
    p->clock = clock;  // follows a clock that is slewed
    if (is_same) suspected_.reset();
    if (suspected_ && p->heartbeats == kEstablished) ++suspected_->against;
    return {};
  }
  if (!suspected_ || IsStep(step - suspected_->step)) {
    suspected_ = Suspected{step, heartbeat.process};
    return {};
  }
  if (is_same && suspected_->against > 0) {
    // A process on another computer.
    if (suspected_->against > 1) p->clock = clock;
    return {};
  }
  suspected_.reset();
  // Those that have just started may have begun on either side of the step.
  for (auto& [name, process] : processes_)
    if (process.heartbeats < kEstablished) process.heartbeats = 0;
  return step;
}

bool ProcessClocks::WouldFindStep(double now_s) const {
  return std::any_of(processes_.begin(), processes_.end(), [&](const auto& entry) {
    const Process& p = entry.second;
    return p.heartbeats == kEstablished && now_s - p.heard_s < kHeardS;
  });
}

// Others on the bus may end whenever they like.
std::vector<std::string> ProcessClocks::silent() const {
  std::vector<std::string> names;
  for (const auto& [name, process] : processes_)
    if (IsOwn(name) && elapsed_s_ - process.heard_s > kSilentS) names.push_back(name);
  return names;
}

}  // namespace seastitch
