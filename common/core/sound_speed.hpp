#pragma once

namespace seastitch {

// Limits of the sound speed in sea water, with a margin. A value beyond is an error of a sensor or
// of a file.
inline constexpr double kMinSoundSpeedMps = 1300.0;
inline constexpr double kMaxSoundSpeedMps = 1800.0;
constexpr bool IsSoundSpeed(double mps) {
  return mps >= kMinSoundSpeedMps && mps <= kMaxSoundSpeedMps;
}

}  // namespace seastitch
