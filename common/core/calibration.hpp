#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/pose.hpp"

namespace seastitch {

// Corrections of how soundings are placed from beams and poses, each to be added to what the sonar
// and the navigation state. They remove the errors of integration that bend submaps inside: ribs
// that follow the motion, and swaths that tilt or smile.
struct SonarCalibration {
  double roll_rad = 0.0;  // of the sonar, clockwise seen from behind: deeper to starboard
  double second_head_roll_rad = 0.0;  // of head 1 of a sonar with two; roll_rad is of head 0
  // Steering error as a sound speed at the transducer [m/s]: the sine of a beam's angle grows by
  // smile_mps / kSmileSpeedMps. The depth at nadir stays.
  double smile_mps = 0.0;
  static constexpr double kSmileSpeedMps = 1500.0;
  // The part of it that the sound-speed profile causes [m/s]: a swath that the water bends is also
  // stretched.
  double smile_by_water_mps = 0.0;
  double attitude_latency_ms = 0.0;  // attitude is taken so much later than the sounding
  double depth_latency_ms = 0.0;     // depth is taken so much later than the sounding
  double roll_scale_percent = 0.0;   // roll grows by so much
  double heave_scale_percent = 0.0;  // changes of depth faster than 20 s grow by so much

  bool IsZero() const { return *this == SonarCalibration{}; }
  friend bool operator==(const SonarCalibration&, const SonarCalibration&) = default;
};

// One of the values.
enum class CalibrationKey : std::uint8_t {
  kRoll,
  kSecondHeadRoll,
  kSmile,
  kSmileByWater,
  kAttitudeLatency,
  kDepthLatency,
  kRollScale,
  kHeaveScale,
};
inline constexpr std::size_t kCalibrationKeys = 8;

// What stands in files and pages of one value.
struct CalibrationName {
  CalibrationKey key;
  const char* name;  // of the section `calibration` of mapper.yaml
  const char* unit;  // as people read it
  double per_unit;   // the member of SonarCalibration in one unit of the file
  double smallest;   // step that is worth a change, in the unit of the file
  double SonarCalibration::*value;
};
inline constexpr std::array<CalibrationName, kCalibrationKeys> kCalibrationNames{{
    {CalibrationKey::kRoll, "roll_deg", "deg", Deg2Rad(1.0), 0.02, &SonarCalibration::roll_rad},
    {CalibrationKey::kSecondHeadRoll,
     "second_head_roll_deg",
     "deg",
     Deg2Rad(1.0),
     0.02,
     &SonarCalibration::second_head_roll_rad},
    {CalibrationKey::kSmile, "smile_mps", "m/s", 1.0, 0.3, &SonarCalibration::smile_mps},
    {CalibrationKey::kSmileByWater,
     "smile_by_water_mps",
     "m/s",
     1.0,
     0.3,
     &SonarCalibration::smile_by_water_mps},
    {CalibrationKey::kAttitudeLatency,
     "attitude_latency_ms",
     "ms",
     1.0,
     1.0,
     &SonarCalibration::attitude_latency_ms},
    {CalibrationKey::kDepthLatency,
     "depth_latency_ms",
     "ms",
     1.0,
     1.0,
     &SonarCalibration::depth_latency_ms},
    {CalibrationKey::kRollScale,
     "roll_scale_percent",
     "%",
     1.0,
     0.5,
     &SonarCalibration::roll_scale_percent},
    {CalibrationKey::kHeaveScale,
     "heave_scale_percent",
     "%",
     1.0,
     2.0,
     &SonarCalibration::heave_scale_percent},
}};

// A value as the overlaps of a survey show it.
struct CalibratedValue {
  double add = 0.0;       // to what was used, as in SonarCalibration
  double sigma = 0.0;     // 1 sigma; 0: the overlaps say nothing of it
  bool is_clear = false;  // beyond doubt, so that the next run of a replay uses it
};

// An error of submaps that changes slowly over a survey, as tide changes depth.
struct SlowError {
  double rms = 0.0;       // SI
  double sigma = 0.0;     // RMS of its 1 sigma; 0: not estimated
  double smallest = 0.0;  // that is worth a word
  bool IsClear() const { return sigma > 0.0 && rms > std::max(smallest, 3.0 * sigma); }
};

// What the overlaps of one dive say about its calibration.
struct CalibrationEstimate {
  SonarCalibration used;  // that the soundings were placed with
  std::array<CalibratedValue, kCalibrationKeys> values{};
  std::int64_t pairs = 0;  // of overlapping submaps
  std::int64_t cells = 0;  // that two submaps of a pair measured
  double before_m = 0.0;   // RMS of the height differences of these cells
  double after_m = 0.0;    // the same with the clear values
  // Depth at nadir that the smile would change, as a part of the altitude, if the sound speed
  // profile were its cause.
  double depth_part = 0.0;
  // What is left beside the values, without its mean. It is stated, never applied.
  SlowError depth_m{.smallest = 0.02};            // tide, settling
  SlowError roll_rad{.smallest = Deg2Rad(0.02)};  // of the attitude

  const CalibratedValue& Of(CalibrationKey key) const {
    return values[static_cast<std::size_t>(key)];
  }
  // Whether there are overlaps enough to apply anything.
  bool HasEnough() const { return pairs >= 10 && cells >= 3000; }
  bool HasClear() const {
    for (const CalibratedValue& value : values)
      if (value.is_clear) return true;
    return false;
  }
  // `used` with what is clear.
  SonarCalibration Corrected() const {
    SonarCalibration corrected = used;
    for (const CalibrationName& of : kCalibrationNames)
      if (Of(of.key).is_clear) corrected.*of.value += Of(of.key).add;
    return corrected;
  }
};

}  // namespace seastitch
