#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "common/core/time.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/parameters.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/device_watch.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {

struct DriverParams {
  std::string source;                           // URL, see can_source.hpp and byte_source.hpp
  int receive_buffer_bytes = 16 * 1024 * 1024;  // a sonar's ping may be 400 kB in one burst
  double timeout_s = 5.0;                       // without data: lost
};
// What the files of all drivers have.
void DeclareDevice(std::string* device,
                   const std::vector<std::string>& names,
                   ParameterTable* table);
void DeclareDriver(DriverParams* params, ParameterTable* table);
// Throws ConfigError "FILE: source: ..." for one that this driver can never open.
void CheckSource(const std::string& config_file, const DriverParams& params, SourceKind kind);
// has_clock: the device sends the time of its measurements.
void DeclareClock(ClockParams* params, bool has_clock, ParameterTable* table);

// Which device a file is for; the first where it names none. Throws ConfigError.
std::string DeviceIn(const std::string& path, const std::vector<std::string>& names);

// What every driver has, whatever its transport: the raw bytes, counters, health. CanDriver and
// DatagramDriver feed it, the device's own part decodes and publishes.
class DeviceDriver {
 public:
  // name: the process, such as "imu-driver". raw_channel: such as channels::kRawCan. raw_source:
  // what its messages are said to be of.
  DeviceDriver(const std::string& name,
               const std::string& raw_channel,
               const std::string& raw_source,
               const DriverParams& params,
               Bus* bus);
  virtual ~DeviceDriver() = default;
  DeviceDriver(const DeviceDriver&) = delete;
  DeviceDriver& operator=(const DeviceDriver&) = delete;

  // Copies every counter into HEALTH and says whether data still come. Call it once a second.
  // trouble, refusal: of the source (CanSource).
  virtual void UpdateHealth(const Counters& source,
                            DeviceWatch::Clock::time_point now,
                            const std::string& trouble = "",
                            const std::string& refusal = "");
  Health& health() { return health_; }
  virtual Counters decoder_counters() const = 0;
  virtual Counters clock_figures() const = 0;

  // Runs until a signal or loop->Stop(). feed: when fd is readable.
  int Run(int fd,
          const std::function<void()>& feed,
          const std::function<void()>& update_health,
          EventLoop* loop);

 protected:
  // In parts where the bytes are many.
  void PublishRaw(const std::vector<std::uint8_t>& bytes, Time recv);
  std::int64_t raw_seq() const { return raw_seq_; }  // of the next
  // For each message published.
  void OnPublished(const std::string& stream);
  // The same, for one that does not show that the device is alive.
  void OnSidePublished(const std::string& stream) { health_.Tick(stream); }

  Bus* bus_;

 private:
  std::string raw_channel_;
  std::string raw_source_;
  std::int64_t raw_seq_ = 0;
  Health health_;
  DeviceWatch watch_;
};

}  // namespace seastitch
