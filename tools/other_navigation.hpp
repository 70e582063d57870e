#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/runtime/bus.hpp"
#include "mapper/input/sensor_clocks.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/navigation.hpp"
#include "products/survey.hpp"

namespace seastitch {

// The navigation that a replay does not use: that of the INS for `navigation_source:
// dead_reckoning`, dead reckoning for `given`. It computes a track from the same messages, for
// comparison.
class OtherNavigation {
 public:
  // Subscribes to the sensors' messages on the bus.
  OtherNavigation(const MapperConfig& config, Bus* bus);
  OtherNavigation(const OtherNavigation&) = delete;
  OtherNavigation& operator=(const OtherNavigation&) = delete;

  const char* source() const { return is_given_ ? "given" : "dead_reckoning"; }
  // Track of the dive, after the last message. Empty where its sensors are not in the log.
  std::vector<TrackState> Finish();

 private:
  template <class Msg>
  void Subscribe(const char* channel);
  void AddStates();

  const bool is_given_;
  const double sonar_time_offset_s_;
  const std::unique_ptr<Navigation> navigation_;
  SensorClocks clocks_;
  Bus* const bus_;
  bool has_velocity_ = false;  // of a DVL
  std::optional<Time> last_;
  std::vector<TrackState> track_;
};

}  // namespace seastitch
