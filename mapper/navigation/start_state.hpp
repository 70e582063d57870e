#pragma once

#include <cstdint>
#include <string>

namespace seastitch {

// What the start waits for.
enum class StartState : std::uint8_t {
  kNoInertialData,
  kNoAttitude,
  kAttitudeUnsteady,   // two attitudes a moment apart do not agree
  kHeadingTooCoarse,   // the device aligns, or states a sigma above start_heading_sigma_rad
  kNoDepthOrVelocity,  // for start_wait_s at most
  kNoFix,
  // Of navigation that is given.
  kNoGivenAttitude,
  kNoGivenPosition,
  kNoGivenDepth,
  kStarted,
};
// A sentence for whoever has to do something about it. "" when started.
std::string Explain(StartState state);

}  // namespace seastitch
