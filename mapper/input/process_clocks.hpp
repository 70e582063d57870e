#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/sample.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// The computer's clocks, as the heartbeats of its processes tell them: the monotonic clock that
// goes on while sensors are silent, and the steps of the system's clock. A step is a change of
// `time - uptime_s` of one process start. It is the same at every speed of a replay. Two heartbeats
// have to agree on it: of two processes, or of one that no other contradicts. Pure.
class ProcessClocks {
 public:
  // Adds a heartbeat. One whose uptime is not possible is ignored. Two processes of the same name
  // whose uptimes alternate between two values count as restarted each time. If they began less
  // than a second apart, so that the uptimes increase in the order of the messages, they count as
  // one, wrong by at most that second.
  void Add(const Heartbeat& heartbeat);

  // Seconds that passed by the uptimes since the first heartbeat.
  double elapsed_s() const { return elapsed_s_; }
  // True if a step of the clock from now on will be found: a process has been heard twice, the last
  // time less than 3 s before now_s (a value of elapsed_s(), continued by other clocks).
  bool WouldFindStep(double now_s) const;
  // Sum of the steps of the system's clock so far.
  Duration stepped() const { return stepped_; }

  // Own processes of this program that have sent nothing for 2.5 s, by name.
  std::vector<std::string> silent() const;

 private:
  struct Process {
    double uptime_s = 0.0;
    double to_elapsed_s = 0.0;               // elapsed_s = uptime_s + this
    double heard_s = 0.0;                    // elapsed_s at its last heartbeat
    std::optional<double> before_restart_s;  // uptime_s of the process before this one
    Duration clock{};                        // time - uptime_s - stepped()
    int heartbeats = 0;                      // since it started, up to kEstablished
  };

  Duration StepSeenBy(Process* p, const Heartbeat& heartbeat);

  std::map<std::string, Process> processes_;
  double elapsed_s_ = 0.0;
  Duration stepped_{};
  // A step that only one process has shown so far.
  struct Suspected {
    Duration step;
    std::string process;
    int against = 0;  // heartbeats of other processes since, without a step
  };
  std::optional<Suspected> suspected_;
};

}  // namespace seastitch
