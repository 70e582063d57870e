#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "common/core/sensors.hpp"
#include "mapper/geometry/sound_ray.hpp"

namespace seastitch {

// Chooses a ping's sound-speed profile: the received profile nearest in time, else the configured
// one, else a constant speed, the one measured at the sonar.
//
// The time of a profile may be hours before that of its message. A profile is used for pings whose
// last echo is not before the time of its message. At that time all messages within navigation's
// reorder window have arrived, so that the choice does not depend on their order of arrival.
class SoundSpeed {
 public:
  enum class Source : std::uint8_t { kProfile, kConfigured, kTransducer, kAssumed };
  static bool IsProfile(Source source) {
    return source == Source::kProfile || source == Source::kConfigured;
  }
  // Speed used if the sonar measures none: sea water of 10 degrees and 35 psu near the surface
  // [m/s].
  static constexpr double kAssumedMps = 1490.0;

  // `configured` must be usable: see RayTracer::Make().
  explicit SoundSpeed(const std::optional<SoundVelocityProfile>& configured);

  // Longest time [s] by which a message can be later than a ping: no reorder window is longer. A
  // larger difference shows that the message has another clock; then the profile is used at once.
  static constexpr double kMaxAheadS = 10.0;

  // sent: time of the message; Time() if unknown: the profile is used for all pings from now on.
  // False if it is not a profile of sea water; it is then ignored. Keeps the newest 64.
  bool Add(const SoundVelocityProfile& profile, Time sent = Time());

  struct Choice {
    std::shared_ptr<const RayTracer> rays;
    Source source;
  };
  Choice For(const MbesPing& ping);

 private:
  struct Dated {
    Time time;
    Time sent;
    std::shared_ptr<const RayTracer> rays;
  };

  std::shared_ptr<const RayTracer> configured_;  // null: none
  std::deque<Dated> profiles_;                   // in the order of arrival
  std::shared_ptr<const RayTracer> constant_;
  double constant_mps_ = 0.0;
};

}  // namespace seastitch
