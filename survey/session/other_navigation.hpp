#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/core/sample.hpp"
#include "mapper/input/sensor_clocks.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/navigation.hpp"
#include "products/survey.hpp"

namespace seastitch {

// The navigation that a replay does not use: that of the INS for `navigation_source:
// dead_reckoning`, dead reckoning for `given`. It computes a track from the same samples, for
// comparison.
class OtherNavigation {
 public:
  explicit OtherNavigation(const MapperConfig& config);

  void Add(const Received& received);

  const char* source() const { return is_given_ ? "given" : "dead_reckoning"; }
  // Track of the dive, after the last sample. Empty where its sensors are not in the log.
  std::vector<TrackState> Finish();

 private:
  template <class T>
  void Add(T sample, const MessageStamp& stamp);
  void AddStates();

  const bool is_given_;
  const double sonar_time_offset_s_;
  const std::unique_ptr<Navigation> navigation_;
  SensorClocks clocks_;
  bool has_velocity_ = false;  // of a DVL
  std::optional<Time> last_;
  std::vector<TrackState> track_;
};

}  // namespace seastitch
