#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"
#include "common/core/time.hpp"
#include "common/parameters/parameters.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/device_watch.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {

struct DriverParams {
  std::string source;                           // URL, see can_source.hpp and byte_source.hpp
  int receive_buffer_bytes = 16 * 1024 * 1024;  // a sonar sends pings of 400 kB in bursts
  double timeout_s = 5.0;                       // HEALTH reports `lost` after it without data
};
// Declares `device`, the data format of the device. names: its allowed values.
void DeclareDevice(std::string* device,
                   const std::vector<std::string>& names,
                   ParameterTable* table);
// Declares the keys of DriverParams.
void DeclareDriver(DriverParams* params, ParameterTable* table);
// Throws ConfigError "FILE: source: ..." if the URL is invalid or of a kind that this driver does
// not read.
void CheckSource(const std::string& config_file, const DriverParams& params, SourceKind kind);
// Declares `clock` and `latency_s`. has_clock: the device sends the time of its measurements; if
// not, only `clock: receive` is allowed.
void DeclareClock(ClockParams* params, bool has_clock, ParameterTable* table);

// The value of `device` in a configuration file; names.front() if the key is absent. Throws
// ConfigError.
std::string DeviceIn(const std::string& path, const std::vector<std::string>& names);

// Bytes from a device, as a driver records them. A view.
struct RawBytes {
  std::string_view channel;  // such as channels::kRawCan
  std::string_view source;   // the driver's `source`
  Time recv;
  Bytes bytes;
};

// Takes what a driver makes: measurements, and the bytes that they were decoded from.
class DriverOutput {
 public:
  virtual ~DriverOutput() = default;
  // recv: receive time of the bytes.
  virtual void Put(Sample sample, Time recv) = 0;
  virtual void Put(const RawBytes& raw) = 0;
};

// Passes them on as encoded messages, such as to a log, and numbers these by channel.
class MessageOutput : public DriverOutput {
 public:
  using Write = std::function<void(const std::string& channel, const void* data, std::size_t size)>;
  explicit MessageOutput(Write write) : write_(std::move(write)) {}

  // A heartbeat is not written: every process sends its own (Health).
  void Put(Sample sample, Time recv) override;
  void Put(const RawBytes& raw) override;
  // A message of another kind, with the number that it has.
  template <class Msg>
  void Send(const std::string& channel, const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    write_(channel, bytes.data(), bytes.size());
  }

 private:
  const Write write_;
  std::map<std::string, std::int64_t, std::less<>> seqs_;  // of the next message, by channel
};

// Publishes them: the output of a driver process.
class BusOutput : public MessageOutput {
 public:
  explicit BusOutput(Bus* bus)
      : MessageOutput([bus](const std::string& channel, const void* data, std::size_t size) {
          bus->PublishBytes(channel, data, size);
        }) {}
};

// Base class of all drivers: puts out the raw bytes, and publishes counters and health. CanDriver
// and DatagramDriver derive from it and read the transport; the class of a device derives from one
// of these, decodes, and puts out the measurements.
class DeviceDriver {
 public:
  // name: of the process, such as "imu-driver". raw_channel: such as channels::kRawCan. raw_source:
  // value of the field `source` in the raw messages.
  DeviceDriver(const std::string& name,
               const std::string& raw_channel,
               const std::string& raw_source,
               const DriverParams& params,
               DriverOutput* output);
  virtual ~DeviceDriver() = default;
  DeviceDriver(const DeviceDriver&) = delete;
  DeviceDriver& operator=(const DeviceDriver&) = delete;

  // Copies all counters into HEALTH and sets its state: ok, degraded, or lost after timeout_s
  // without data. Call it once a second. now: monotonic. trouble: why the source cannot be read,
  // for people; empty if it can.
  virtual void UpdateHealth(const Counters& source,
                            DeviceWatch::Clock::time_point now,
                            const std::string& trouble = "",
                            const SenderRefusal& refusal = {});
  Health& health() { return health_; }
  const DriverParams& params() const { return params_; }
  virtual Counters decoder_counters() const = 0;
  virtual Counters clock_figures() const = 0;

  // Runs until a signal or loop->Stop(); returns the exit status. Calls feed when fd is readable,
  // and update_health once a second. Publishes HEALTH on the bus.
  int Run(int fd,
          const std::function<void()>& feed,
          const std::function<void()>& update_health,
          Bus* bus,
          EventLoop* loop);

 protected:
  // Puts out the bytes.
  void PutRaw(Bytes bytes, Time recv) { output_->Put({raw_channel_, raw_source_, recv, bytes}); }
  // Puts out a measurement, which shows that the device is alive. stream: its name in HEALTH.
  void Put(Sample sample, Time recv, const std::string& stream);
  // Puts out what is no proof of life, such as a sound speed profile.
  void PutAside(Sample sample, Time recv, const std::string& stream);

 private:
  DriverOutput* const output_;
  const DriverParams params_;
  const std::string raw_channel_;
  const std::string raw_source_;
  Health health_;
  DeviceWatch watch_;
};

}  // namespace seastitch
