#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/datagram_driver.hpp"
#include "drivers/mbes/mbes_decoder.hpp"

namespace seastitch {

struct MbesDriverConfig {
  DriverParams driver;
  MbesDecoderParams decoder;
};

// Throws ConfigError.
MbesDriverConfig LoadMbesDriverConfig(const std::string& path);
std::string PrintConfig(const MbesDriverConfig& config);
// As it is published on CONFIG.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const MbesDriverConfig& config);
ParameterTable TableOf(MbesDriverConfig* config);

// Datagrams, or what a connection gives, to MBES_PING, SVP and RAW_MBES.
class MbesDriver : public DatagramDriver {
 public:
  MbesDriver(const MbesDriverConfig& config, DriverOutput* output);

  Counters decoder_counters() const override { return decoder_.counters(); }
  Counters clock_figures() const override { return decoder_.clock_figures(); }

 private:
  bool Decode(const Datagram& datagram) override;

  MbesDecoder decoder_;
};

}  // namespace seastitch
