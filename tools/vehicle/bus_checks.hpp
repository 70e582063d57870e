#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "page/process_roll.hpp"
#include "tools/vehicle/finding.hpp"
#include "tools/vehicle/setup.hpp"

namespace seastitch {

// Configuration with which each process runs: texts by process and file.
using RunningConfigs = std::map<std::string, std::map<std::string, std::string>>;

// Statistics of a sensor's value over the seconds that the doctor listens.
struct Heard {
  int count = 0;
  double first_s = 0.0;  // when the driver received them
  double last_s = 0.0;
  double sum = 0.0;
  double high = -std::numeric_limits<double>::infinity();

  void Add(double value, double recv_s);
  double mean() const { return sum / count; }
  double rate_hz() const { return count > 1 ? (count - 1) / (last_s - first_s) : 0.0; }
};

// Listens on the bus for the doctor. It also requests the configuration of all processes: the
// answers show that the bus works, and which configuration each process has.
class BusWatch {
 public:
  // Throws std::runtime_error if the bus cannot be opened or cannot receive.
  explicit BusWatch(const std::string& lcm_url);
  // Handles messages for this time.
  void Listen(double seconds);
  // True if a process has published every file of its configuration.
  bool Answered(const std::string& process, const Setup& setup) const;
  // True if all processes with HEALTH have done so.
  bool AllAnswered(const Setup& setup) const;

  bool loopback = false;
  ProcessRoll roll;
  RunningConfigs configs;
  // By channel of a sensor: receive time minus stamp.
  std::map<std::string, Heard> latency_s;
  Heard specific_force_mps2, depth_m, sound_speed_mps;
  Heard bottom_lock, speed_mps;  // of the Doppler log: 0 or 1; with bottom lock
  Heard valid_beams;             // fraction of a ping's beams

 private:
  template <class Msg, class Take>
  void Sense(const char* channel, Take take);

  Bus bus_;
  ConfigAssembler files_;
  const std::string sender_;
};

Findings CheckLoopback(const BusWatch& watch);
// Checks that all processes that are needed run, once each, in one version, without a fault. now_s:
// monotonic.
Findings CheckProcesses(const BusWatch& watch, const Setup& setup, double now_s);
// Checks that each process runs with the present content of its files.
Findings CheckRunningConfigs(const BusWatch& watch, const Setup& setup);
// Checks rates, stamps, clocks and plausible values. at_surface: depth must be near 0, and
// positions must come where a source of them is configured.
Findings CheckSensors(const BusWatch& watch, const Setup& setup, bool at_surface);

}  // namespace seastitch
