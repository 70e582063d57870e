#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/config/parameter_file.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/can/signal_map.hpp"
#include "drivers/device_driver.hpp"
#include "drivers/registry.hpp"
#include "drivers/socket/can_source.hpp"

namespace seastitch {

// Base class of drivers of a device on a CAN bus.
class CanDriver : public DeviceDriver {
 public:
  CanDriver(const std::string& name, const DriverParams& params, DriverOutput* output);

  // Puts out the frames (RAW_CAN): as cannelloni packets, each of frames that arrived within a
  // millisecond, recv_utime that of the last. Then decodes each.
  void Feed(std::span<const ReceivedFrame> frames);
  void Feed(const CanFrame& frame, Time recv);
  // Call it at the end of a log: incomplete measurements are published or counted.
  virtual void Finish() = 0;

  virtual std::vector<CanFilter> filters() const = 0;
  // CanSource::outages(), before UpdateHealth().
  void SeeOutages(std::int64_t outages) { errors_.SeeOutages(outages); }
  void UpdateHealth(const Counters& source,
                    DeviceWatch::Clock::time_point now,
                    const std::string& trouble = "",
                    const SenderRefusal& refusal = {}) override;

 protected:
  virtual void Decode(const CanFrame& frame, Time recv) = 0;

 private:
  CanErrors errors_;
  std::uint8_t packets_ = 0;  // cannelloni's number of the next packet
};

// Runs a driver on its source until a signal, or the end of a log.
int Run(CanDriver* driver, Bus* bus, EventLoop* loop);

// Keys `dbc` and `signals` of the configuration of a device that a DBC file describes.
struct SignalFile {
  std::string dbc;
  std::vector<std::string> texts;  // of each field; empty: the device does not send it
};
// Throws std::runtime_error.
std::string TextOfDbc(const std::filesystem::path& dbc);
// field_keys: the keys of the map `signals`.
void DeclareSignals(const std::vector<std::string>& field_keys,
                    SignalFile* file,
                    ParameterTable* table);
// config_path: of the file that the texts stand in; file->dbc is relative to it, and absolute
// afterwards. Throws ConfigError.
SignalMap LoadSignals(const std::string& config_path,
                      const std::vector<std::string>& field_keys,
                      SignalFile* file);

// Configuration of a device on a CAN bus, which a DBC file describes or which speaks NMEA 2000.
template <class SignalParams, class Nmea2000Params>
struct CanDeviceConfig {
  std::string device = kSignalDevice;
  DriverParams driver;
  SignalFile signals;       // of "signals"
  SignalParams can;         // of "signals", made from signals
  Nmea2000Params nmea2000;  // of "nmea2000"
};

// devices: the names that `device` may have. Throws ConfigError.
template <class Config>
Config LoadCanConfig(const std::string& path,
                     const std::vector<std::string>& devices,
                     const std::vector<std::string>& field_keys) {
  Config config;
  config.device = DeviceIn(path, devices);
  LoadParameters(path, TableOf(&config));
  CheckSource(path, config.driver, SourceKind::kCan);
  if (config.device != kSignalDevice) return config;
  config.can.signals = LoadSignals(path, field_keys, &config.signals);
  if (const std::string problem = config.can.Validate(); !problem.empty())
    throw ConfigError(path + ": " + problem);
  return config;
}

// With the defaults of its device.
template <class Config>
std::string PrintCanConfig(const Config& config) {
  Config defaults;
  defaults.device = config.device;
  return PrintWithDefaults(config, defaults);
}

// The configuration of a driver as it is published: `name` and the DBC file that it reads, if any,
// which it then names without a folder. file: its part of `config`.
template <class Config>
std::vector<std::pair<std::string, std::string>> WithDbc(const std::string& name,
                                                         Config config,
                                                         SignalFile Config::*file) {
  std::vector<std::pair<std::string, std::string>> files;
  const std::filesystem::path dbc = (config.*file).dbc;
  if (!dbc.empty()) {
    files.emplace_back(dbc.filename().string(), TextOfDbc(dbc));
    (config.*file).dbc = dbc.filename().string();
  }
  files.emplace_back(name, PrintConfig(config));
  return files;
}

// Of a device on NMEA 2000: its address on the bus.
void DeclareSourceAddress(int* address, ParameterTable* table);

}  // namespace seastitch
