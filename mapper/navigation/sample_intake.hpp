#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "common/geo/map_frame.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Checks and orders samples: refuses and counts implausible ones, corrects stamps by the configured
// offsets, and sorts the rest by time. Inertial samples drive the clock.
class SampleIntake {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  // tally: must outlive this object.
  SampleIntake(const NavigationParams& params, const VehicleGeometry& vehicle, NavTally* tally);

  void Add(const ImuSample& sample);
  void Add(const DvlSample& sample);
  void Add(const DepthSample& sample);
  // Returns a usable fix that comes too late to be sorted in, for a caller that can use it at any
  // age.
  std::optional<Event> Add(const PositionFix& fix);
  void AddSoundSpeed(Time t, double speed_mps);
  void Finish();

  // The next sample in order of time, when no earlier one can come any more.
  std::optional<Event> Next();
  // Samples that were not returned yet, in order of time.
  const std::deque<Event>& waiting() const { return waiting_; }
  // Call it when a state has been published: the clock does not go back any more.
  void Freeze() { frozen_ = true; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.waiting_, self.settled_, self.due_, self.newest_imu_);
    archive(self.leap_, self.leap_began_, self.leap_samples_, self.frozen_);
  }

 private:
  void Count(const std::string& name) { tally_->Count(name); }
  // Counts a sample that is not usable, and hands its time on for the share of refused samples.
  void Refuse(NavSensor sensor, Time t, const std::string& counter);
  void AddAttitude(Time t, const Attitude& attitude, HeadingAlignment alignment);
  bool TakesTime(Time t);
  bool IsLate(Time t) const { return settled_ && t <= *settled_; }
  void AddAiding(const std::string& sensor, Time t, Measurement measurement);
  bool Insert(Event event);
  void LeaveOut(Time first_imu);

  const NavigationParams params_;
  const VehicleGeometry vehicle_;
  const MapFrame map_frame_;
  const double wait_s_;  // for samples that come out of order
  NavTally* tally_;
  std::deque<Event> waiting_;    // in order of time, none at or before settled_
  std::optional<Time> settled_;  // all samples up to here were returned
  std::optional<Time> due_;      // all samples up to here may be returned
  std::optional<Time> newest_imu_;
  std::optional<Time> leap_;  // last of a run of stamps beyond clock_jump_s
  Time leap_began_;           // its first
  int leap_samples_ = 0;
  bool frozen_ = false;
};

}  // namespace seastitch
