#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "seastitch/config_t.hpp"

namespace seastitch {

// Publishes the configuration of a process on CONFIG: at its start, and on a CONFIG_REQUEST, at
// most once in 10 s. A request that comes sooner is answered when the 10 s are over. A driver,
// which the sensors' network reaches, subscribes to nothing (LCM 1.3.1 ends at a crafted fragment):
// it sends every 8 s.
class ConfigPublisher {
 public:
  static constexpr double kPauseS = 10.0;
  static constexpr double kTimerS = 8.0;  // seastitch doctor listens for 9 s
  enum class When { kOnRequest, kByTimer };

  // parts: from ConfigParts() (common/convert/convert.hpp). Version, time and seq are set when they
  // are sent.
  ConfigPublisher(std::vector<config_t> parts, Bus* bus, When when = When::kOnRequest);
  ConfigPublisher(const ConfigPublisher&) = delete;
  ConfigPublisher& operator=(const ConfigPublisher&) = delete;

  // Sends one waiting part, if any. Not all at once, because that would overflow the receivers'
  // buffers. now_s: monotonic clock.
  void SendNext(double now_s, std::int64_t now_utime);
  // Does that ten times a second.
  void SendBy(EventLoop* loop);

 private:
  const std::vector<config_t> parts_;
  Bus* const bus_;
  const When when_;
  bool wanted_ = true;
  std::optional<double> last_s_;  // when the last answer began
  std::deque<config_t> waiting_;  // to be sent
  std::int64_t seq_ = 0;
};

}  // namespace seastitch
