#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

namespace seastitch {

// So many sigma from its configuration a value is called wrong, and another is advised.
inline constexpr double kAdviceSigmas = 4.0;

// Whether an estimate is an end of the range in which it was sought. The true value is then at most
// (kLow) or at least (kHigh) that, and its sigma is the prior's.
enum class RangeEnd : std::uint8_t { kNone, kLow, kHigh };

// Estimate of one parameter of a survey's noise from its overlaps.
struct ComponentEstimate {
  double configured = 0.0;  // prior value, from mapper.yaml
  double value = 0.0;
  double log_sigma = 0.0;  // 1 sigma of the natural logarithm of `value`
  RangeEnd end = RangeEnd::kNone;
};

// Noise of a survey (docs/noise-from-overlaps.md). All but the first are 1 sigma, not variances.
struct NoiseEstimate {
  // Estimated variance of a sounding, divided by the variance of soundings about a smooth surface
  // within a submap.
  ComponentEstimate sounding_variance_ratio;
  // Height error that neighbouring soundings share, divided by the altitude above the seabed.
  ComponentEstimate correlated_error_ratio;
  ComponentEstimate position_walk;  // random walk per axis, by travelled distance [m/sqrt(m)]
  ComponentEstimate heading_walk;   // random walk, by travelled distance [rad/sqrt(m)]
  int closures = 0;                 // number of closures used
};

// Time offset of the sonar's stamps with respect to the attitude's, estimated from soundings.
struct TimeOffsetEstimate {
  double add_s = 0.0;    // correction to be added to the stamp of every ping
  double sigma_s = 0.0;  // 1 sigma
  std::int64_t pings = 0;
  // RMS change from ping to ping of the slope across the track [rad], without and with the
  // correction.
  double change_before = 0.0;
  double change_after = 0.0;
};

// Scale of roll, estimated from soundings without overlap: its sum with the steering of the beams.
struct RollScaleEstimate {
  // What 1 m/s of SonarCalibration::smile_mps looks like, for beams up to 65 degrees.
  static constexpr double kPercentOfSteeringMps = 0.2;
  double add_percent = 0.0;    // by which roll is to grow
  double sigma_percent = 0.0;  // 1 sigma
  bool IsClear() const {
    constexpr double kLeastPercent = 0.5;
    return std::abs(add_percent) > std::max(kLeastPercent, kAdviceSigmas * sigma_percent);
  }
};

// Time offset from the roll rate, and scale of roll, by the slope across the track.
struct SonarTimingEstimate {
  static constexpr char kKey[] = "sonar_time_offset_s";  // of mapper.yaml
  double configured_s =
      0.0;  // sonar_time_offset_s, already added; the estimate is to be added to it
  // True: the soundings were ray traced by their source. Then the offset cannot be corrected here.
  bool placed_by_source = false;
  std::optional<TimeOffsetEstimate> roll;
  std::optional<RollScaleEstimate> roll_scale;
};

// Time offset of the stamps of attitude or DVL with respect to the inertial unit's.
struct StampOffsetEstimate {
  std::string key;            // of mapper.yaml: "navigation.dvl_time_offset_s"
  double configured_s = 0.0;  // value of the key, already added
  double add_s = 0.0;         // estimate, to be added to the value
  double sigma_s = 0.0;       // 1 sigma
  double suspected_s = 0.0;   // time during which it was significant, and corrected
};

// What a replay reports of a survey's noise and of the sonar's timing.
struct SurveyNoise {
  NoiseEstimate components;
  SonarTimingEstimate timing;
};

}  // namespace seastitch
