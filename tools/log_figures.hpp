#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// What is counted of the messages of one sender on a channel.
struct SenderFigures {
  std::int64_t events = 0;
  std::int64_t bytes = 0;
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
  std::int64_t longest_gap_us = 0;
  std::int64_t clock_steps_back = 0;
  std::int64_t lost = 0;         // by the numbers of the messages
  std::int64_t undecodable = 0;  // of a channel of ours
  double rate_hz() const;
  void Add(const SenderFigures& other);
};

// A step of the clock that stamps the log.
struct ClockStep {
  std::int64_t utime = 0;  // of the event before it
  std::int64_t step_us = 0;
};

// Counts the events of one recorder in their order. Numbers of a damaged log do not overflow: what
// does not fit is the largest or the smallest.
class LogFigures {
 public:
  void Add(const LogEvent& event);

  // By channel, then by sender; "" where the channel has one sender or none that is known.
  using Senders = std::map<std::string, SenderFigures>;
  const std::map<std::string, Senders>& channels() const { return channels_; }
  std::int64_t events() const { return events_; }
  std::int64_t first_utime() const { return first_utime_; }  // of the first event
  std::int64_t last_utime() const { return last_utime_; }    // of the last
  // Back: an event is stamped earlier than the one before. Forward: nothing came for more than 5 s,
  // and yet the next message goes on with its number: a logger records its own HEALTH each second.
  const std::vector<ClockStep>& clock_steps() const { return clock_steps_; }

 private:
  void NoteClock(const LogEvent& event);

  std::map<std::string, Senders> channels_;
  std::map<std::string, SequenceWatch> watches_;  // by channel and sender
  std::vector<ClockStep> clock_steps_;
  std::int64_t events_ = 0;
  std::int64_t first_utime_ = 0;
  std::int64_t last_utime_ = 0;
  ClockStep jump_;  // forward, not yet judged; 0: none
};

// Of the sum over all senders.
SenderFigures Total(const LogFigures::Senders& senders);

}  // namespace seastitch
