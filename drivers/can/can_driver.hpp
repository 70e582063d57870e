#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/config.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/device_watch.hpp"
#include "drivers/socket/can_source.hpp"

namespace seastitch {

struct CanDriverParams {
  std::string source;                          // URL, see can_source.hpp
  int receive_buffer_bytes = 8 * 1024 * 1024;  // the kernel's default loses frames in a flood
  double timeout_s = 2.0;                      // without data: lost

  std::string Validate() const;
};

// What the drivers of CAN devices have in common: RAW_CAN, counters, health. The device's own part
// decodes and publishes.
class CanDriver {
 public:
  // name: the process, such as "imu-driver".
  CanDriver(const std::string& name, const CanDriverParams& params, Bus* bus);
  virtual ~CanDriver() = default;
  CanDriver(const CanDriver&) = delete;
  CanDriver& operator=(const CanDriver&) = delete;

  // Publishes the frames on RAW_CAN: as cannelloni packets, each of frames that arrived within a
  // millisecond, recv_utime that of the last. Then decodes each.
  void Feed(std::span<const ReceivedFrame> frames);
  void Feed(const CanFrame& frame, Time recv);
  // The end of a log: what is held back is published or counted.
  virtual void Finish() = 0;

  virtual std::vector<CanFilter> filters() const = 0;
  // Copies every counter into HEALTH and says whether data still come. Call it once a second.
  // trouble: of the source.
  void UpdateHealth(const Counters& source,
                    DeviceWatch::Clock::time_point now,
                    const std::string& trouble = "");
  Health& health() { return health_; }
  virtual Counters decoder_counters() const = 0;
  virtual Counters clock_figures() const = 0;

 protected:
  virtual void Decode(const CanFrame& frame, Time recv) = 0;
  // For each message published.
  void OnPublished(const std::string& stream);

  Bus* bus_;

 private:
  void PublishRaw(std::span<const ReceivedFrame> frames);

  std::string raw_source_;
  std::int64_t raw_seq_ = 0;
  CanErrors errors_;
  std::int64_t outages_ = 0;  // of the interface
  Health health_;
  DeviceWatch watch_;
};

// Runs a driver on its source until a signal, or the end of a log.
int RunCanDriver(CanDriver* driver, CanSource* source, Bus* bus, EventLoop* loop);

// Keys "source", "receive_buffer_bytes" and "timeout_s" of a CAN driver's file.
CanDriverParams ReadCanDriverParams(ConfigMap* root);
// Keys "clock" ("device", "model" or "receive") and "latency_s".
ClockParams ReadClockParams(ConfigMap* root);
// Key "dbc", relative to the folder of the file, and the map "signals", whose keys are field_keys.
// Throws ConfigError.
SignalMap ReadSignalMap(ConfigMap* root, const std::vector<std::string>& field_keys);

}  // namespace seastitch
