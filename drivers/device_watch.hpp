#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/core/health/counters.hpp"
#include "common/runtime/health.hpp"
#include "drivers/socket/sender_gate.hpp"

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

 private:
  double timeout_s_;
  Health* health_;
  bool data_since_check_ = false;
  std::optional<Clock::time_point> last_data_;  // with the resolution of the period of Check()
};

// Reports datagrams of other senders in HEALTH. refusal: all so far.
void FollowRefusals(const SenderRefusal& refusal,
                    DeviceWatch::Clock::time_point now,
                    Health* health);
// Copies the counters of a part into HEALTH.
void SetAll(const Counters& counters, Health* health);

}  // namespace seastitch
