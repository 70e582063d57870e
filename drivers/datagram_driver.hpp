#pragma once

#include <cstdint>
#include <string>

#include "common/runtime/bus.hpp"
#include "common/runtime/config.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/device_watch.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

struct DatagramDriverParams {
  std::string source;                           // URL, see udp_socket.hpp
  int receive_buffer_bytes = 16 * 1024 * 1024;  // a sonar's ping may be 400 kB in one burst
  double timeout_s = 5.0;                       // without data: lost

  std::string Validate() const;
};
// Keys "source", "receive_buffer_bytes" and "timeout_s". Throws ConfigError.
DatagramDriverParams ReadDatagramDriverParams(ConfigMap* root);

// What the drivers of devices that send UDP datagrams have in common: the raw bytes, counters,
// health. The device's own part decodes and publishes.
class DatagramDriver {
 public:
  // name: the process, such as "mbes-driver". raw_channel: "RAW_MBES".
  DatagramDriver(const std::string& name,
                 const std::string& raw_channel,
                 const DatagramDriverParams& params,
                 Bus* bus);
  virtual ~DatagramDriver() = default;
  DatagramDriver(const DatagramDriver&) = delete;
  DatagramDriver& operator=(const DatagramDriver&) = delete;

  // Publishes the bytes, in parts where they are many, then decodes them.
  void Feed(const Datagram& datagram);
  // Copies every counter into HEALTH and says whether data still come. Call it once a second.
  // trouble: of the socket.
  void UpdateHealth(const Counters& socket,
                    DeviceWatch::Clock::time_point now,
                    const std::string& trouble = "");
  Health& health() { return health_; }
  virtual Counters decoder_counters() const = 0;
  virtual Counters clock_figures() const = 0;

 protected:
  virtual void Decode(const Datagram& datagram) = 0;
  // For each message published.
  void OnPublished(const std::string& stream);
  // The same, for one that does not show that the device is alive.
  void OnSidePublished(const std::string& stream) { health_.Tick(stream); }

  Bus* bus_;

 private:
  std::string source_;
  std::string raw_channel_;
  std::int64_t raw_seq_ = 0;
  Health health_;
  DeviceWatch watch_;
};

// Runs a driver on its socket until a signal.
int RunDatagramDriver(DatagramDriver* driver,
                      const DatagramDriverParams& params,
                      Bus* bus,
                      EventLoop* loop);

}  // namespace seastitch
