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

// Records every message of the bus with its time of receipt, and reports what was lost on the way.
// With every log that it begins it asks for the configuration, so that each holds it.
class LoggerNode {
 public:
  // Opens the next file of the dive. Throws std::runtime_error "FILE: reason".
  LoggerNode(const LoggerConfig& config, const DiveFolder& dive, Bus* bus);

  // Brings counters and state up to date; to be called once a second.
  void UpdateHealth();
  // Puts everything on the disk that came so far, and ends.
  void Finish();

  Health& health() { return health_; }
  const std::filesystem::path& file() const { return file_; }  // written to, as of UpdateHealth()
  // The processes that started before this log send their configuration again.
  void RequestConfiguration();

 private:
  // Of a counter that is read once a second: whether it grew within the last seconds.
  struct RecentGrowth {
    bool Add(std::int64_t total);
    std::int64_t total = 0;
    int seconds_since = 0;
  };

  void OnEvent(const std::string& channel, const lcm::ReceiveBuffer& buffer);

  Bus* const bus_;
  const std::filesystem::path dive_;
  LogWriter writer_;
  std::filesystem::path file_;
  GapCounter gaps_;
  ForeignChannels foreign_;
  Health health_{"logger"};
  RecentGrowth losses_;
  RecentGrowth unloggable_;
  RecentGrowth deleted_;
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
