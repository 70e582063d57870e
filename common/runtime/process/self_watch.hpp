#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/fault_events.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/process/own_sockets.hpp"

namespace seastitch {

// Detects the faults that every process can have: messages that cannot be decoded or sent,
// datagrams that the kernel dropped, a blocked event loop, work that waits for too long.
class SelfWatch {
 public:
  struct Age {
    std::string name;  // of the counter NAME_age_ms
    const ConditionKind* kind;
    double limit_s;
    std::function<double()> age_s;  // age of the oldest waiting item; 0: none waits
  };
  void AddAge(Age age) { ages_.push_back(std::move(age)); }

  struct Report {
    std::vector<Condition> conditions;
    std::map<std::string, std::int64_t> counters;
  };
  // To be called once a second; returns the active faults. now_s: monotonic clock. late_s: largest
  // lateness of the loop's timer since the last call.
  Report Check(const Bus& bus, double now_s, double late_s);

 private:
  void CheckBus(const Bus& bus, double now_s, Report* report);
  void CheckSockets(double now_s, Report* report);
  void CheckLoop(double now_s, double late_s, Report* report);
  void CheckAges(Report* report) const;

  std::vector<Age> ages_;
  std::map<std::string, FaultEvents<double>> undecodable_;  // by channel
  FaultEvents<double> unsent_{conditions::kMessagesNotSent};
  OwnSockets sockets_;
  std::map<std::string, FaultEvents<double>> drops_;  // by socket
  FaultEvents<double> late_{conditions::kLoopLate};
  double longest_late_s_ = 0.0;  // while that fault holds
};

}  // namespace seastitch
