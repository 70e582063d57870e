#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/fault_events.hpp"
#include "common/core/health/health_values.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/process/self_watch.hpp"
#include "seastitch/health_t.hpp"

namespace seastitch {

enum class HealthState : std::int8_t { kStarting = 0, kOk = 1, kDegraded = 2, kLost = 3 };

// Seconds of the machine's monotonic clock, for intervals. The time for which the machine was
// suspended counts, so that after it no clock seems to have stepped.
double MonotonicSeconds();
// Time of the system clock, microseconds since the Unix epoch. For HEALTH, and for data from
// sources without a clock.
std::int64_t NowUtime();

// Health of one process: state, active faults, counters and message rates, published as HEALTH.
// Received and rejected messages are counted here instead of having a line each in the log text.
//
// The state is the severity of the worst active fault. Without a fault it is kStarting until
// SetRunning(), and then kOk.
class Health {
 public:
  using Clock = std::function<double()>;  // monotonic, seconds
  explicit Health(std::string process, Clock clock = MonotonicSeconds);
  Health(const Health&) = delete;
  Health& operator=(const Health&) = delete;

  // Raises a fault: it is active until Release(). Replaces the detail of an active fault.
  void Hold(const ConditionKind& kind, std::string detail = {});
  // Clears a fault.
  void Release(const ConditionKind& kind);
  // Hold() or Release().
  void HoldIf(bool holds, const ConditionKind& kind, std::string detail = {});
  // Raises a fault that is an event as kind.events says. total: the number of its events so far.
  // now_s: of any one monotonic clock. Call it regularly.
  void FollowEvents(const ConditionKind& kind,
                    std::int64_t total,
                    double now_s,
                    std::string detail = {});
  // Replaces the faults that the core of the process (such as Mapper) reports. Faults raised by
  // Hold() stay; one raised by both is active until both clear it.
  void SetConditions(const std::vector<Condition>& found) { SetFound(kByCore, found); }

  // waits_for: text for people, such as "waiting for navigation".
  void SetStarting(std::string waits_for);
  void SetRunning();
  // Sets the part of the text that follows the faults, such as "12 submaps, 3 loop closures".
  void SetText(std::string figures);
  // Functions that read counters and text from the core of the process. They are called, on the
  // thread of the event loop, when HEALTH is made. Of equal names the core's counter is
  // reported. Its text replaces that of SetText().
  struct Core {
    std::function<std::map<std::string, std::int64_t>()> counters;
    std::function<std::string()> text;
  };
  void ReadFrom(Core core) { core_ = std::move(core); }

  // Adds to a counter, such as "mbes_bad_checksum". A counter is in HEALTH from its first count on.
  void Count(const std::string& counter, std::int64_t n = 1) { counters_[counter] += n; }
  // Sets a counter.
  void Set(const std::string& counter, std::int64_t value) { counters_[counter] = value; }
  void Set(HealthValue which, std::int64_t value) { Set(NameOf(which), value); }
  // Counts a message or frame of a stream, such as "imu". HEALTH has its rate [Hz] over the last
  // second.
  void Tick(const std::string& stream) { ++ticks_[stream]; }

  const std::string& process() const { return process_; }
  std::int64_t counter(const std::string& name) const;
  HealthState state() const { return state_; }
  // One line for people: the active faults, worst first, then the text of SetStarting() or
  // SetText().
  std::string text() const;

  // Makes the message, and begins a new period of the rates. period_s: duration of the one that
  // ends.
  health_t Snapshot(std::int64_t now_utime, double period_s);

  // Watches an age, such as that of the oldest waiting job: calls age_s [s] once a second, reports
  // it as counter NAME_age_ms [ms], and raises the fault while it exceeds limit_s.
  void WatchAge(const std::string& name,
                const ConditionKind& kind,
                double limit_s,
                std::function<double()> age_s);
  // Publishes HEALTH once a second, independent of input, and within 0.1 s of a change of the
  // state. Also detects the faults that every process can have (SelfWatch), and feeds systemd's
  // watchdog from the event loop. So systemd restarts a process only if its event loop is blocked.
  // A disk that does not respond, or a long computation, is a fault in HEALTH and no reason for a
  // restart.
  void PublishEverySecond(Bus* bus, EventLoop* loop);
  // Feeds systemd's watchdog from a long step on the event loop's thread. Call it while the step
  // makes progress, such as a restart that reads a long dive.
  void ReportProgress();

 private:
  enum Finder { kByNode, kByCore, kBySelfWatch, kNumFinders };
  struct Record {
    const ConditionKind* kind = nullptr;
    std::array<std::optional<std::string>, kNumFinders> details;  // by Finder; absent: not active
    double since_s = 0.0;
    std::int64_t count = 0;  // how often it became active
    bool holds() const;
    std::string Sentence() const;
  };

  void SetDetail(Finder finder, const ConditionKind& kind, std::optional<std::string> detail);
  void SetFound(Finder finder, const std::vector<Condition>& found);
  std::vector<const Record*> Holding() const;  // worst first
  std::map<std::string, std::int64_t> Counters() const;
  void NoteState();
  health_t Message(std::int64_t now_utime) const;
  void EndRatePeriod(double period_s);
  void OnTimer(Bus* bus);
  void Publish(Bus* bus);

  const std::string process_;
  const Clock clock_;
  const double start_s_;
  std::map<std::string_view, Record> records_;  // by the name of the kind; never removed
  std::map<std::string_view, FaultEvents<double>> events_;  // by the name of the kind
  std::optional<std::string> starting_ = "starting";
  std::string figures_;
  std::optional<Core> core_;
  HealthState state_ = HealthState::kStarting;
  double state_since_s_;

  std::map<std::string, std::int64_t> counters_;
  std::map<std::string, std::int64_t> ticks_;
  std::map<std::string, double> rates_hz_;
  std::int64_t seq_ = 0;
  std::int32_t restarts_ = 0;
  HealthState sent_state_ = HealthState::kStarting;

  SelfWatch self_watch_;
  double last_timer_s_ = 0.0;
  double last_second_s_ = 0.0;
  double late_s_ = 0.0;  // largest lateness of the timer since last_second_s_
};

// A figure of another process; absent where its message has none. device: whose it is, of a driver:
// "imu".
std::optional<std::int64_t> ValueIn(const health_t& health,
                                    HealthValue which,
                                    const std::string& device = {});

}  // namespace seastitch
