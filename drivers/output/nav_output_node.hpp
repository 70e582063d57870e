#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/vehicle.hpp"
#include "common/parameters/parameters.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "drivers/output/byte_sink.hpp"
#include "drivers/output/nav_sentences.hpp"

namespace seastitch {

struct NavOutputConfig {
  std::string udp;        // URL of byte_sink.hpp; empty: none
  std::string serial;     // another
  bool corrected = true;  // NAV_CORRECTED; else NAV
  NavSentencesParams sentences;
  std::filesystem::path vehicle_file = "vehicle.yaml";
  VehicleGeometry vehicle;  // made from vehicle_file

  // URLs of the outputs that are configured.
  std::vector<std::string> outputs() const;
};

// Throws ConfigError.
NavOutputConfig LoadNavOutputConfig(const std::string& path);
std::string PrintConfig(const NavOutputConfig& config);
// As it is published on CONFIG.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const NavOutputConfig& config);
ParameterTable TableOf(NavOutputConfig* config);

// Sends the navigation of the bus as NMEA 0183 to an autopilot, a chart plotter or gpsd. While no
// navigation is heard it sends nothing.
class NavOutputNode {
 public:
  // config: with an output at least.
  NavOutputNode(const NavOutputConfig& config, Bus* bus);
  NavOutputNode(const NavOutputNode&) = delete;
  NavOutputNode& operator=(const NavOutputNode&) = delete;

  // Call it once a second.
  void Check();
  Health& health() { return health_; }

 private:
  struct Output {
    std::string url;
    std::unique_ptr<ByteSink> sink;
  };

  template <class Msg>
  void OnMessage(const char* channel, Bus* bus);
  void Send(const NavState& state);

  const std::string channel_;
  const double dvl_below_m_;  // the Doppler log, below the vehicle's reference point
  NavSentences sentences_;
  std::vector<Output> sinks_;
  std::optional<double> altitude_m_;
  double altitude_s_ = 0.0;        // monotonic time of altitude_m_
  std::optional<double> heard_s_;  // monotonic time of the last NAV, or of the first Check()
  Health health_{"nav-output"};
};

}  // namespace seastitch
