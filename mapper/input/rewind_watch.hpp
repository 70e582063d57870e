#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/core/time.hpp"
#include "mapper/input/sensor_clocks.hpp"

namespace seastitch {

// Finds that the time of all sensors went back: a log that is played again or from an earlier
// place, or the log of another dive. A step of a clock is no such thing, since SensorClocks
// corrects it before. Fixes and profiles come about any time before, and decide nothing. Nor does
// a single stamp, behind or ahead.
class RewindWatch {
 public:
  explicit RewindWatch(double jump_s) : jump_s_(jump_s) {}

  // time: in dive time.
  void Add(SensorChannel channel, Time time);

  // By how much the inertial unit (or INS) is behind its newest time [s]; absent while it goes on.
  std::optional<double> behind_s() const;
  // True once the inertial unit (or INS) has gone on for kSureS from the earlier time, another
  // sensor too, and none from the time before.
  bool IsSure() const;

  static constexpr double kSureS = 1.0;

 private:
  // Messages in a row that are behind the channel's newest time.
  struct Run {
    std::int64_t since = 0;  // number of the first, among all messages
    int messages = 0;
    Time begin;
    Time last;
  };
  struct Channel {
    std::optional<Time> newest;
    std::optional<Time> ahead;  // of the last message, if that leapt ahead of newest
    std::int64_t went_on = 0;   // number of its last message that was not behind
    std::optional<Run> run;
  };

  const Channel* TimeBase() const;

  double jump_s_;
  std::int64_t messages_ = 0;
  std::array<Channel, kSensorChannels> channels_;
};

}  // namespace seastitch
