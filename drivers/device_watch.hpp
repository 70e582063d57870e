#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/counters.hpp"
#include "common/runtime/health.hpp"

namespace seastitch {

// Reports in HEALTH whether a device gives data: starting until the first come, lost after a
// silence, and whether its source can be used.
class DeviceWatch {
 public:
  using Clock = std::chrono::steady_clock;

  // device: for people, such as "IMU at can:can0".
  DeviceWatch(const std::string& device, double timeout_s, Health* health);

  void OnData();
  // Call it regularly. trouble: why the source cannot be used, for people; empty where it can.
  void Check(Clock::time_point now, const std::string& trouble);
  // Datagrams of other senders so far, and of whom the last came: a fault for 10 s after it.
  void CheckSenders(Clock::time_point now, std::int64_t refused, const std::string& refusal);

 private:
  double timeout_s_;
  Health* health_;
  bool data_since_check_ = false;
  std::optional<Clock::time_point> last_data_;  // to the period of Check()
  std::int64_t refused_ = 0;
  Clock::time_point refused_at_;
};

// Copies the counters of a part into HEALTH.
void SetAll(const Counters& counters, Health* health);

}  // namespace seastitch
