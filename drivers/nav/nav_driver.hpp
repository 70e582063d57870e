#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/parameters/parameters.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "drivers/device_driver.hpp"
#include "drivers/nav/depth_codec.hpp"
#include "drivers/nav/ecan_ins.hpp"
#include "drivers/nav/nmea_fixes.hpp"
#include "drivers/nav/nmea_ins.hpp"
#include "drivers/socket/byte_source.hpp"

namespace seastitch {

// Connection of an instrument. Several instruments may share a source.
struct NavDeviceParams {
  std::string source;      // URL, see byte_source.hpp; empty: no such instrument
  double timeout_s = 5.0;  // without a message HEALTH reports it as lost; 0: never
};

struct NavDriverConfig {
  NavDriverConfig();

  std::string file;  // that it was loaded from, for messages
  int receive_buffer_bytes = 1024 * 1024;
  bool needs_checksum = true;

  NavDeviceParams ins;
  std::string ins_format = "nmea";                         // nmea, phins, ... (kInsFormats)
  NmeaInsParams ins_nmea{.clock = {DeviceClock::kModel}};  // the clock of the other formats too
  bool altitude_is_depth = false;
  std::string ins_dbc =
      "sbg_ecan.dbc";     // of an INS on CAN; relative to the file until it is loaded
  SignalMap ins_signals;  // made from ins_dbc

  NavDeviceParams gps{"", 10.0};
  NmeaFixParams gps_fixes{.source = "gps", .clock = {DeviceClock::kModel}};

  NavDeviceParams usbl{"", 0.0};
  NmeaFixParams usbl_fixes{.source = "usbl", .clock = {DeviceClock::kDevice}, .sigma_m = 5.0};

  NavDeviceParams depth;
  DepthCodecParams depth_codec{.clock = {DeviceClock::kReceive}};

  // URLs of all configured instruments, each once.
  std::set<std::string> sources() const;
  // Channels on which the configured instruments publish.
  std::set<std::string> output_channels() const;
};

// Throws ConfigError.
NavDriverConfig LoadNavDriverConfig(const std::string& path);
std::string PrintConfig(const NavDriverConfig& config);
// As it is published on CONFIG: the file, and the DBC file that it reads, if any.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const NavDriverConfig& config);
ParameterTable TableOf(NavDriverConfig* config);

// Driver of up to four instruments: an INS (channel INS), a GPS receiver and a USBL system (channel
// POSITION_FIX), a pressure sensor (channel DEPTH). It puts out their bytes too (RAW_NAV).
class NavDriver {
 public:
  using Clock = std::chrono::steady_clock;
  // State of one source. trouble: why it cannot be read, for people; empty if it can.
  struct SourceState {
    std::string trouble;
    SenderRefusal refusal;
    Counters counters;
    std::string can_trouble{};
  };

  NavDriver(const NavDriverConfig& config, DriverOutput* output);
  NavDriver(const NavDriver&) = delete;
  NavDriver& operator=(const NavDriver&) = delete;

  // Puts out bytes of a source, then the measurements decoded from them. source: its URL as
  // configured. piece: a datagram, or the bytes of one read call. Returns whether a message of an
  // instrument was decoded.
  bool Feed(const std::string& source, const Datagram& piece);
  // Call it once a second.
  void UpdateHealth(const std::map<std::string, SourceState>& sources, Clock::time_point now);

  // Frames that the instrument on this source needs; empty: it is not on CAN.
  std::vector<CanFilter> can_filters(const std::string& source) const;

  Health& health() { return health_; }
  const NavDriverConfig& config() const { return config_; }
  // With the instrument's name as prefix: gps_no_position.
  Counters decoder_counters() const;

 private:
  struct Device {
    std::string name;
    NavDeviceParams params;
    std::unique_ptr<NavCodec> codec;
    std::int64_t heard = 0;                       // messages until the last CheckDevices()
    std::optional<Clock::time_point> last_heard;  // first check, or the last with new messages
  };
  void AddDevice(const std::string& name,
                 const NavDeviceParams& params,
                 std::unique_ptr<NavCodec> codec);
  void Put(NavOutput measured, Time recv);
  void CheckSources(const std::map<std::string, SourceState>& sources, Clock::time_point now);
  void CheckDevices(Clock::time_point now);

  const NavDriverConfig config_;
  DriverOutput* const output_;
  Health health_;
  std::vector<Device> devices_;
};

// Runs it on its sources until a signal. Throws ConfigError where it has none.
int Run(NavDriver* driver, Bus* bus, EventLoop* loop);

}  // namespace seastitch
