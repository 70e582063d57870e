#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "seastitch/health_t.hpp"

namespace seastitch {

// The processes of a vehicle, by their names in HEALTH, in the order in which people see them.
inline constexpr std::array kProcesses = {
    "imu-driver", "dvl-driver", "mbes-driver", "mapper", "optimizer", "logger"};
// Runs where nav_driver.yaml names an instrument.
inline constexpr char kNavDriver[] = "nav-driver";
// One of the processes above.
bool IsOurs(const std::string& process);

// The processes that send HEALTH. Times are seconds of a monotonic clock.
class ProcessRoll {
 public:
  void Add(const health_t& msg, double now_s);

  // The last message; nullptr: never heard.
  const health_t* Find(const std::string& process) const;
  // Since its last message; infinite: never heard.
  double SilentFor(const std::string& process, double now_s) const;
  // True where two processes of this name send by turns. A restart does not count.
  bool IsTwice(const std::string& process, double now_s) const;
  // kProcesses, then those beyond.
  std::vector<std::string> names() const;

 private:
  // One program: its sequence numbers rise one by one.
  struct Program {
    std::int64_t seq;
    double first_s;
    double last_s;
  };
  struct Entry {
    health_t last{};
    double heard_s = 0.0;
    std::vector<Program> programs;  // heard lately
  };
  std::map<std::string, Entry> entries_;
};

}  // namespace seastitch
