#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/core/health/counters.hpp"

namespace seastitch {

// Occurrences that a navigation counts: all by name, for people, and those that monitors watch as
// members. They belong to one process: they are not saved.
class NavTally {
 public:
  void Count(const std::string& name, std::int64_t n = 1) { by_name_[name] += n; }
  void Set(const std::string& name, std::int64_t value) { by_name_[name] = value; }
  // The state was set to a sensor's measurement.
  void CountReset(const std::string& sensor) {
    Count(sensor + "_reset");
    ++resets_;
  }
  // A sample came too late to be used.
  void CountLate(const std::string& sensor) {
    Count(sensor + "_late");
    ++late_[sensor];
    ++out_of_time_;
  }
  // A sample came late, and was taken out of its order.
  void CountLateTaken(const std::string& sensor) {
    Count(sensor + "_late_taken");
    ++out_of_time_;
  }
  // The time of a sample is too far ahead for it to be used.
  void CountAhead(const std::string& sensor) {
    Count(sensor + "_ahead");
    ++out_of_time_;
  }
  void CountHeadingStep() {
    Count("heading_step");
    ++heading_steps_;
  }
  // A jump of an INS's position.
  void CountJump() {
    Count("ins_position_jumps");
    ++jumps_;
  }
  // A position of an INS is too far from the datum to be used.
  void CountTooFar() {
    Count("ins_position_far_from_datum");
    ++too_far_;
  }

  const Counters& by_name() const { return by_name_; }
  const std::map<std::string, std::int64_t>& late() const { return late_; }  // by sensor
  // Samples too late or too far ahead, used or not.
  std::int64_t out_of_time() const { return out_of_time_; }
  std::int64_t resets() const { return resets_; }
  std::int64_t heading_steps() const { return heading_steps_; }
  std::int64_t jumps() const { return jumps_; }
  std::int64_t too_far() const { return too_far_; }

 private:
  Counters by_name_;
  std::map<std::string, std::int64_t> late_;
  std::int64_t out_of_time_ = 0;
  std::int64_t resets_ = 0;
  std::int64_t heading_steps_ = 0;
  std::int64_t jumps_ = 0;
  std::int64_t too_far_ = 0;
};

}  // namespace seastitch
