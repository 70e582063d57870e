#pragma once

#include <cstdint>
#include <string>

namespace seastitch {

// Condition that the start waits for.
enum class StartState : std::uint8_t {
  kNoInertialData,
  kNoAttitude,
  kAttitudeUnsteady,   // two successive attitudes differ too much
  kHeadingTooCoarse,   // the device aligns, or states a sigma above start_heading_sigma_rad
  kNoDepthOrVelocity,  // waits for start_wait_s at most
  kNoFix,
  // Of given navigation.
  kNoGivenAttitude,
  kNoGivenPosition,
  kNoGivenDepth,
  kStarted,
};
// A sentence for people with the remedy; "" when started.
std::string Explain(StartState state);

}  // namespace seastitch
