#include "mapper/input/sound_speed.hpp"

#include <cstddef>
#include <utility>

#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

// Enough for one profile an hour for two and a half days.
constexpr std::size_t kMaxProfiles = 64;

Duration Apart(Time a, Time b) { return a < b ? b - a : a - b; }

}  // namespace

SoundSpeed::SoundSpeed(const std::optional<SoundVelocityProfile>& configured) {
  if (!configured) return;
  if (auto rays = RayTracer::Make(*configured))
    configured_ = std::make_shared<const RayTracer>(*std::move(rays));
}

bool SoundSpeed::Add(const SoundVelocityProfile& profile, Time sent) {
  std::optional<RayTracer> rays = RayTracer::Make(profile);
  if (!rays) return false;
  if (profiles_.size() == kMaxProfiles) profiles_.pop_front();
  profiles_.push_back({profile.time, sent, std::make_shared<const RayTracer>(*std::move(rays))});
  return true;
}

SoundSpeed::Choice SoundSpeed::For(const MbesPing& ping) {
  const Dated* nearest = nullptr;
  const Time last_echo = LastEcho(ping);
  for (const Dated& profile : profiles_) {
    const double ahead_s = ToSeconds(profile.sent - last_echo);
    if (ahead_s > 0.0 && ahead_s <= kMaxAheadS) continue;
    if (!nearest || Apart(profile.time, ping.time) < Apart(nearest->time, ping.time))
      nearest = &profile;
  }
  if (nearest) return {nearest->rays, Source::kProfile};
  if (configured_) return {configured_, Source::kConfigured};
  const bool measured = IsSoundSpeed(ping.sound_speed_mps);
  const double speed_mps = measured ? ping.sound_speed_mps : kAssumedMps;
  if (!constant_ || constant_mps_ != speed_mps) {
    constant_ = std::make_shared<const RayTracer>(RayTracer::Constant(speed_mps));
    constant_mps_ = speed_mps;
  }
  return {constant_, measured ? Source::kTransducer : Source::kAssumed};
}

}  // namespace seastitch
