#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/core/conditions.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/own_sockets.hpp"

namespace seastitch {

// Finds what can go wrong in every process: messages that do not decode or cannot be sent,
// datagrams that the kernel dropped, a loop that is late, work that waits for too long.
class SelfWatch {
 public:
  struct Age {
    std::string name;  // of the counter NAME_age_ms
    const ConditionKind* kind;
    double limit_s;
    std::function<double()> age_s;  // of the oldest thing that waits; 0 where nothing does
  };
  void AddAge(Age age) { ages_.push_back(std::move(age)); }

  struct Report {
    std::vector<Condition> conditions;
    std::map<std::string, std::int64_t> counters;
  };
  // Once a second. now_s: monotonic. late_s: how late the loop's timer was at most since the last
  // call. What is counted, and not a state, is a fault for 10 s after it last grew.
  Report Check(const Bus& bus, double now_s, double late_s);

 private:
  // Whether a counter grew lately.
  class Growth {
   public:
    bool Lately(std::int64_t total, double now_s);

   private:
    std::int64_t total_ = 0;
    double grew_s_ = 0.0;
  };

  void CheckBus(const Bus& bus, double now_s, Report* report);
  void CheckSockets(double now_s, Report* report);
  void CheckLoop(double now_s, double late_s, Report* report);
  void CheckAges(Report* report) const;

  std::vector<Age> ages_;
  std::map<std::string, Growth> undecodable_;  // by channel
  Growth unsent_;
  OwnSockets sockets_;
  std::map<std::string, Growth> drops_;  // by socket
  double longest_late_s_ = 0.0;          // lately
  Growth late_;
  std::int64_t times_late_ = 0;
};

}  // namespace seastitch
