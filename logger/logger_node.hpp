#pragma once

#include <cstdint>
#include <filesystem>

#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "logger/foreign_channels.hpp"
#include "logger/gap_counter.hpp"
#include "logger/log_writer.hpp"
#include "logger/logger_config.hpp"

namespace seastitch {

// The node of the logger process: records every message of the bus with its receive time, and
// counts lost messages. With every new file it requests the configuration of all processes, so that
// every file contains it.
class LoggerNode {
 public:
  // Opens the next file of the dive. Throws std::runtime_error "FILE: reason".
  LoggerNode(const LoggerConfig& config, const DiveFolder& dive, Bus* bus);

  // Updates counters and faults in HEALTH; to be called once a second. now_s: monotonic.
  void UpdateHealth(double now_s = MonotonicSeconds());
  // Writes all received messages to the disk, and ends.
  void Finish();

  Health& health() { return health_; }
  const std::filesystem::path& file() const { return file_; }  // written to, as of UpdateHealth()
  // The processes that started before this log send their configuration again.
  void RequestConfiguration();

 private:
  void OnEvent(const std::string& channel, const lcm::ReceiveBuffer& buffer);

  Bus* const bus_;
  const std::filesystem::path dive_;
  LogWriter writer_;
  std::filesystem::path file_;
  GapCounter gaps_;
  ForeignChannels foreign_;
  Health health_{"logger"};
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
