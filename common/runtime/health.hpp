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

#include "common/core/conditions.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/self_watch.hpp"
#include "seastitch/health_t.hpp"

namespace seastitch {

enum class HealthState : std::int8_t { kStarting = 0, kOk = 1, kDegraded = 2, kLost = 3 };

// Seconds of the machine's monotonic clock, for intervals.
double MonotonicSeconds();
// The system clock, microseconds. For health and for stamping what has no clock of its own.
std::int64_t NowUtime();

// State, faults, counters and rates of one process: streams are counted here, not logged.
//
// The state is that of the worst fault that holds. Without one it is starting until SetRunning(),
// then ok.
class Health {
 public:
  using Clock = std::function<double()>;  // monotonic, seconds
  explicit Health(std::string process, Clock clock = MonotonicSeconds);
  Health(const Health&) = delete;
  Health& operator=(const Health&) = delete;

  // A fault that holds until Release(). The detail of a fault that holds already is replaced.
  void Hold(const ConditionKind& kind, std::string detail = {});
  void Release(const ConditionKind& kind);
  // Hold() or Release().
  void HoldIf(bool holds, const ConditionKind& kind, std::string detail = {});
  // The faults that the core of the process finds, in place of those that it found before. Faults
  // held by Hold() stay.
  void SetConditions(const std::vector<Condition>& found) { SetFound(kByCore, found); }

  // waits_for: for people, such as "waiting for navigation".
  void SetStarting(std::string waits_for);
  void SetRunning();
  // What follows the faults in the text, such as "12 submaps, 3 loop closures".
  void SetText(std::string figures);
  // Counters and text that the core of the process keeps itself. They are read when a report is
  // made or asked for, and come before those set here.
  struct Core {
    std::function<std::map<std::string, std::int64_t>()> counters;
    std::function<std::string()> text;
  };
  void ReadFrom(Core core) { core_ = std::move(core); }

  // Adds to a counter, such as "mbes_bad_checksum". Counters appear with their first count.
  void Count(const std::string& counter, std::int64_t n = 1) { counters_[counter] += n; }
  void Set(const std::string& counter, std::int64_t value) { counters_[counter] = value; }
  // One message or frame of a stream whose rate is reported, such as "imu".
  void Tick(const std::string& stream) { ++ticks_[stream]; }

  const std::string& process() const { return process_; }
  std::int64_t counter(const std::string& name) const;
  HealthState state() const { return state_; }
  // One line: the faults, worst first, then what a starting process waits for, or the figures.
  std::string text() const;

  // The message, and the start of the next rate period.
  health_t Snapshot(std::int64_t now_utime, double period_s);

  // Reports the age of the oldest thing that waits, seconds, as counter NAME_age_ms, and holds kind
  // while it is above limit_s. Seen within a second.
  void WatchAge(const std::string& name,
                const ConditionKind& kind,
                double limit_s,
                std::function<double()> age_s);
  // Publishes HEALTH once a second, whatever comes or does not come, and 0.1 s after the state
  // changed at the latest; looks for the faults that every process can have (SelfWatch), and feeds
  // systemd's watchdog. A disk that hangs and a computation that takes long are faults of their own
  // and feed it all the same: only a loop that is stuck does not.
  void PublishEverySecond(Bus* bus, EventLoop* loop);

 private:
  enum Finder { kByNode, kByCore, kBySelfWatch, kNumFinders };
  struct Record {
    const ConditionKind* kind = nullptr;
    std::array<std::optional<std::string>, kNumFinders> details;  // by who finds it
    double since_s = 0.0;
    std::int64_t count = 0;
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
  double late_s_ = 0.0;  // of the timer, the most since last_second_s_
};

}  // namespace seastitch
