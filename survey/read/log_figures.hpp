#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/convert/stream_watch.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// Counts of the messages of one sender on a channel.
struct SenderFigures {
  std::int64_t events = 0;
  std::int64_t bytes = 0;
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
  std::int64_t longest_gap_us = 0;
  std::int64_t clock_steps_back = 0;
  std::int64_t lost = 0;         // by the sequence numbers
  std::int64_t undecodable = 0;  // on one of Seastitch's channels
  double rate_hz() const;
  void Add(const SenderFigures& other);
};

// A step of the clock with which the log is stamped.
struct ClockStep {
  std::int64_t utime = 0;  // time of the event before the step
  std::int64_t step_us = 0;
};

// Counts the events of one recorder in their order. Counters are saturated, so that the sequence
// numbers of a damaged log do not overflow.
class LogFigures {
 public:
  void Add(const LogEvent& event);

  // By channel, then by sender; "" if the channel has one sender or no known one.
  using Senders = std::map<std::string, SenderFigures>;
  const std::map<std::string, Senders>& channels() const { return channels_; }
  std::int64_t events() const { return events_; }
  std::int64_t first_utime() const { return first_utime_; }  // of the first event
  std::int64_t last_utime() const { return last_utime_; }    // of the last
  // Steps back: an event has an earlier stamp than the one before. Steps forward: no event for more
  // than 5 s, although no message is missing by sequence numbers. (A logger records its own HEALTH
  // every second.)
  const std::vector<ClockStep>& clock_steps() const { return clock_steps_; }

 private:
  void NoteClock(const LogEvent& event);

  std::map<std::string, Senders> channels_;
  std::map<std::string, SequenceWatch> watches_;  // by channel and sender
  std::vector<ClockStep> clock_steps_;
  std::int64_t events_ = 0;
  std::int64_t first_utime_ = 0;
  std::int64_t last_utime_ = 0;
  ClockStep jump_;  // forward, not decided yet; 0: none
};

// Of the sum over all senders.
SenderFigures Total(const LogFigures::Senders& senders);

}  // namespace seastitch
