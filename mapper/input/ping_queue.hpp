#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Queue of pings, in order of time, until navigation's final states reach their last echo. Bounded:
// when it is full the oldest is dropped. Pure.
template <class Ping = MbesPing>
class PingQueue {
 public:
  explicit PingQueue(std::size_t capacity) : capacity_(capacity) {}

  // Limit of the time [s] by which a ping may be ahead of navigation's input: beyond it its clock
  // is wrong, and it is dropped when its turn comes.
  static constexpr double kMaxAheadS = 30.0;

  void Add(Ping ping);
  // The oldest ping, if navigation's final states reach its last echo. latest: of these states.
  // newest: of the samples that navigation has, which go ahead of its states after a gap.
  std::optional<Ping> Take(Time latest, Time newest);
  // The oldest ping, reached or not; for the end of a dive.
  std::optional<Ping> TakeAny();

  std::size_t size() const { return pings_.size(); }
  std::int64_t dropped() const { return dropped_; }                  // the queue was full
  std::int64_t from_the_future() const { return from_the_future_; }  // beyond kMaxAheadS

 private:
  struct Waiting {
    Ping ping;
    Time last_echo;
  };

  const std::size_t capacity_;
  std::deque<Waiting> pings_;
  std::int64_t dropped_ = 0;
  std::int64_t from_the_future_ = 0;
};

}  // namespace seastitch
