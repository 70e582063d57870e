#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "seastitch/config_t.hpp"

namespace seastitch {

// Publishes the configuration of a process on CONFIG: when it starts, and when a CONFIG_REQUEST
// asks for it, at most once in 10 s. A request that comes sooner is answered then.
class ConfigPublisher {
 public:
  static constexpr double kPauseS = 10.0;

  // parts: of one process (ConfigParts() in common/convert/convert.hpp). Version, time and seq are
  // set when they are sent.
  ConfigPublisher(std::vector<config_t> parts, Bus* bus);
  ConfigPublisher(const ConfigPublisher&) = delete;
  ConfigPublisher& operator=(const ConfigPublisher&) = delete;

  // Sends one part, where one waits: all at once would overrun the receivers' buffers. now_s:
  // monotonic.
  void SendNext(double now_s, std::int64_t now_utime);
  // Calls it ten times a second.
  void SendBy(EventLoop* loop);

 private:
  const std::vector<config_t> parts_;
  Bus* const bus_;
  bool wanted_ = true;
  std::optional<double> last_s_;  // when the last answer began
  std::deque<config_t> waiting_;  // to be sent
  std::int64_t seq_ = 0;
};

}  // namespace seastitch
