#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/core/sensors.hpp"
#include "mapper/geometry/sound_ray.hpp"

namespace seastitch {

// Choice of a ping's sound-speed profile: the received profile nearest in time, else the configured
// one, else a constant speed, the one that the sonar measured at its face.
//
// A profile may be hours older than its message, so that its time does not say when it became
// known. It is used for the pings whose last echo is not before the time of its message. By then
// navigation's reorder window has made the choice independent of the order of arrival.
class SoundSpeed {
 public:
  enum class Source : std::uint8_t { kProfile, kConfigured, kTransducer, kAssumed };
  // Used where the sonar measures none either: sea water of 10 degrees and 35 psu near the surface.
  static constexpr double kAssumedMps = 1490.0;

  // `configured` must be usable: see RayTracer::Make().
  explicit SoundSpeed(const std::optional<SoundVelocityProfile>& configured);

  // No reorder window is longer. A message from further ahead of a ping has another clock, which
  // says nothing: its profile holds at once.
  static constexpr double kMaxAheadS = 10.0;

  // said: when it was sent; Time() where nobody knows, for all pings from now on. False: no profile
  // of sea water, not taken. Keeps the newest 64.
  bool Add(const SoundVelocityProfile& profile, Time said = Time());

  struct Choice {
    const RayTracer* rays;  // until the next call of Add() or For()
    Source source;
  };
  Choice For(const MbesPing& ping);

 private:
  struct Dated {
    Time time;
    Time said;
    RayTracer rays;
  };

  std::optional<RayTracer> configured_;
  std::deque<Dated> profiles_;  // in the order of arrival
  std::optional<RayTracer> constant_;
  double constant_mps_ = 0.0;
};

}  // namespace seastitch
