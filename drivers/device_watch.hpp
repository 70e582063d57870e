#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/counters.hpp"
#include "common/runtime/health.hpp"

namespace seastitch {

// Sets the state of HEALTH: starting until the first data, lost after timeout_s without data, and
// the faults of the source.
class DeviceWatch {
 public:
  using Clock = std::chrono::steady_clock;

  // device: for people, such as "IMU at can:can0".
  DeviceWatch(const std::string& device, double timeout_s, Health* health);

  void OnData();
  // Call it regularly. trouble: why the source cannot be used, for people; empty where it can.
  void Check(Clock::time_point now, const std::string& trouble);
  // refused: datagrams of other senders so far; refusal: the last of these senders. A fault is
  // reported for 10 s after each.
  void CheckSenders(Clock::time_point now, std::int64_t refused, const std::string& refusal);

 private:
  double timeout_s_;
  Health* health_;
  bool data_since_check_ = false;
  std::optional<Clock::time_point> last_data_;  // with the resolution of the period of Check()
  std::int64_t refused_ = 0;
  Clock::time_point refused_at_;
};

// Copies the counters of a part into HEALTH.
void SetAll(const Counters& counters, Health* health);

}  // namespace seastitch
