#pragma once

#include <string>

#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "drivers/device_watch.hpp"
#include "drivers/mbes/mbes_decoder.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

struct MbesDriverConfig {
  std::string source = "udp:224.1.20.40:6020";  // system 40 as it leaves the factory
  int receive_buffer_bytes = 16 * 1024 * 1024;  // a ping may be 400 kB in one burst
  double timeout_s = 5.0;                       // without data: lost; some slow pings
  MbesDecoderParams decoder;

  std::string Validate() const;
};

// Throws ConfigError.
MbesDriverConfig LoadMbesDriverConfig(const std::string& path);

// Datagrams to MBES_PING, SVP and RAW_MBES.
class MbesDriver {
 public:
  MbesDriver(const MbesDriverConfig& config, Bus* bus);

  void Feed(const Datagram& datagram);
  // Copies every counter into HEALTH and says whether data still come. Call it once a second.
  // trouble: of the socket.
  void UpdateHealth(const Counters& socket,
                    DeviceWatch::Clock::time_point now,
                    const std::string& trouble = "");
  Health& health() { return health_; }

 private:
  void PublishRaw(const Datagram& datagram);

  Bus* bus_;
  std::string source_;
  MbesDecoder decoder_;
  Health health_;
  DeviceWatch watch_;
  std::int64_t raw_seq_ = 0;
  std::int64_t ping_seq_ = 0;
  std::int64_t profile_seq_ = 0;
};

}  // namespace seastitch
