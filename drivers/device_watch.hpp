#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/runtime/health.hpp"
#include "drivers/counters.hpp"

namespace seastitch {

// Tells HEALTH whether a device gives data: ok at the first, degraded where they come in spite of
// trouble, lost after a silence, ok again by itself.
class DeviceWatch {
 public:
  using Clock = std::chrono::steady_clock;

  // device: for people, such as "IMU at can:can0".
  DeviceWatch(std::string device, double timeout_s, Health* health);

  void OnData();
  // Call it regularly. trouble: what keeps data from coming, or may do so soon, for people; empty
  // where nothing does.
  void Check(Clock::time_point now, const std::string& trouble);

 private:
  std::string device_;
  double timeout_s_;
  Health* health_;
  bool data_since_check_ = false;
  std::optional<Clock::time_point> last_data_;  // to the period of Check()
};

// Copies the counters of a part into HEALTH.
void SetAll(const Counters& counters, Health* health);

}  // namespace seastitch
