#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "seastitch/health_t.hpp"

namespace seastitch {

// The processes of a vehicle, by their names in HEALTH, in the order of display.
inline constexpr std::array kProcesses = {
    "imu-driver", "dvl-driver", "mbes-driver", "mapper", "optimizer", "logger"};
// Runs if nav_driver.yaml has an instrument.
inline constexpr char kNavDriver[] = "nav-driver";
// Runs if nav_output.yaml has an output.
inline constexpr char kNavOutput[] = "nav-output";
// The page of the vehicle.
inline constexpr char kPage[] = "page";
// Not part of seastitch.target: enabled one by one.
inline constexpr std::array kOptionalProcesses = {kNavDriver, kNavOutput, kPage};
bool IsOptional(const std::string& process);
// True for one of the processes above.
bool IsOurs(const std::string& process);

// The processes that send HEALTH. Times are seconds of a monotonic clock.
class ProcessRoll {
 public:
  void Add(const health_t& msg, double now_s);

  // The last message; nullptr if there was none.
  const health_t* Find(const std::string& process) const;
  // Seconds since its last message; infinite if there was none.
  double SilentFor(const std::string& process, double now_s) const;
  // True if two processes with this name send alternately. A restart does not count.
  bool IsTwice(const std::string& process, double now_s) const;
  // kProcesses, then other names.
  std::vector<std::string> names() const;

 private:
  // One running program: its sequence numbers increase one by one.
  struct Program {
    std::int64_t seq;
    double first_s;
    double last_s;
  };
  struct Entry {
    health_t last{};
    double heard_s = 0.0;
    std::vector<Program> programs;  // with messages in the last seconds
  };
  std::map<std::string, Entry> entries_;
};

}  // namespace seastitch
