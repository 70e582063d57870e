#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "drivers/datagram_driver.hpp"
#include "drivers/dvl/pd0.hpp"

namespace seastitch {

struct Pd0DriverConfig {
  std::string device = "pd0";
  DriverParams driver;
  Pd0Params pd0;

  std::set<std::string> output_channels() const;  // without the raw bytes
};

// Throws ConfigError.
Pd0DriverConfig LoadPd0DriverConfig(const std::string& path);
std::string PrintConfig(const Pd0DriverConfig& config);
// As it is published on CONFIG.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const Pd0DriverConfig& config);
ParameterTable TableOf(Pd0DriverConfig* config);

// PD0 ensembles over UDP to DVL, RAW_DVL and, if configured, DEPTH.
class Pd0Driver : public DatagramDriver {
 public:
  Pd0Driver(const Pd0DriverConfig& config, DriverOutput* output);

  Counters decoder_counters() const override { return decoder_.counters(); }
  Counters clock_figures() const override { return decoder_.clock_figures(); }

 private:
  bool Decode(const Datagram& datagram) override;

  Pd0Decoder decoder_;
};

}  // namespace seastitch
