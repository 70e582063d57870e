#pragma once

#include <GeographicLib/LocalCartesian.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Refuses and counts what no sensor of ours can say, sets stamps right by the configured offsets,
// and puts what is left in order of time. Inertial samples drive the clock.
class SampleIntake {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  // Counters must outlive it.
  SampleIntake(const NavigationParams& params, const VehicleGeometry& vehicle, Counters* counters);

  void Add(const ImuSample& sample);
  void Add(const DvlSample& sample);
  void Add(const DepthSample& sample);
  // A usable fix that comes too late to be put in order: for whoever can take it at any age.
  std::optional<Event> Add(const PositionFix& fix);
  void AddSoundSpeed(Time t, double speed_mps);
  void Finish();

  // The next sample in order of time, once none before it can come.
  std::optional<Event> Next();
  // Those that are not given yet, in order of time.
  const std::deque<Event>& waiting() const { return waiting_; }
  // Something was built on what was given: the clock does not go back any more.
  void Freeze() { frozen_ = true; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.waiting_, self.settled_, self.due_, self.newest_imu_);
    archive(self.leap_, self.leap_samples_, self.frozen_);
  }

 private:
  void Count(const std::string& name) { ++(*counters_)[name]; }
  void AddAttitude(Time t, const Attitude& attitude, Alignment alignment);
  bool TakesTime(Time t);
  bool IsLate(Time t) const { return settled_ && t <= *settled_; }
  void AddAiding(const std::string& sensor, Time t, Measurement measurement);
  bool Insert(Event event);
  void LeaveOut(Time first_imu);

  const NavigationParams params_;
  const VehicleGeometry vehicle_;
  const GeographicLib::LocalCartesian to_map_;
  const double wait_s_;  // for samples that come out of order
  Counters* counters_;
  std::deque<Event> waiting_;    // in order of time, none at or before settled_
  std::optional<Time> settled_;  // all up to here is given
  std::optional<Time> due_;      // all up to here may be given
  std::optional<Time> newest_imu_;
  std::optional<Time> leap_;  // last of a run of stamps beyond clock_jump_s
  int leap_samples_ = 0;
  bool frozen_ = false;
};

}  // namespace seastitch
