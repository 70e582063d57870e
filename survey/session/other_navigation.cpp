#include "survey/session/other_navigation.hpp"

#include <type_traits>
#include <utility>

#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"

namespace seastitch {
namespace {

constexpr double kTrackIntervalS = 0.1;

std::unique_ptr<Navigation> MakeOther(const MapperConfig& config, bool given) {
  if (given)
    return std::make_unique<InsNavigation>(
        config.given_navigation, config.navigation, config.vehicle);
  return std::make_unique<DeadReckoning>(config.navigation, config.vehicle);
}

}  // namespace

OtherNavigation::OtherNavigation(const MapperConfig& config)
    : is_given_(config.navigation_source == NavigationSource::kDeadReckoning),
      sonar_time_offset_s_(config.sonar_time_offset_s),
      navigation_(MakeOther(config, is_given_)),
      clocks_(config.navigation.clock_jump_s) {}

void OtherNavigation::Add(const Received& received) {
  std::visit(Overloaded{[this](const Heartbeat& heartbeat) { clocks_.OnHeartbeat(heartbeat); },
                        [](const SoundingPing&) {},
                        [](const SoundVelocityProfile&) {},
                        [&](const auto& sample) { Add(sample, received.stamp); }},
             received.sample);
}

template <class T>
void OtherNavigation::Add(T sample, const MessageStamp& stamp) {
  sample.time = clocks_.InDiveTime(ChannelOf(sample), sample.time, stamp);
  if constexpr (std::is_same_v<T, MbesPing>) {
    navigation_->AddSoundSpeed(sample.time + FromSeconds(sonar_time_offset_s_),
                               sample.sound_speed_mps);
  } else {
    if constexpr (std::is_same_v<T, DvlSample>) has_velocity_ = true;
    navigation_->Add(sample);
    AddStates();
  }
}

void OtherNavigation::AddStates() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest || (last_ && ToSeconds(*latest - *last_) < kTrackIntervalS)) return;
  const std::optional<NavState> state = navigation_->StateAt(*latest);
  if (!state) return;
  last_ = latest;
  track_.push_back(ToTrackState(*state, 0));
}

std::vector<TrackState> OtherNavigation::Finish() {
  navigation_->Finish();
  AddStates();
  // Without a velocity dead reckoning is no track.
  return is_given_ || has_velocity_ ? std::move(track_) : std::vector<TrackState>{};
}

}  // namespace seastitch
