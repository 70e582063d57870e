#pragma once

namespace seastitch {

// Of sea water, with room to spare: beyond, it is a mistake of the sensor or of a file.
inline constexpr double kMinSoundSpeedMps = 1300.0;
inline constexpr double kMaxSoundSpeedMps = 1800.0;
constexpr bool IsSoundSpeed(double mps) {
  return mps >= kMinSoundSpeedMps && mps <= kMaxSoundSpeedMps;
}

}  // namespace seastitch
