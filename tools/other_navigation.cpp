#include "tools/other_navigation.hpp"

#include <type_traits>
#include <utility>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/ins/given_navigation.hpp"
#include "seastitch/health_t.hpp"

namespace seastitch {
namespace {

constexpr double kTrackIntervalS = 0.1;

std::unique_ptr<Navigation> MakeOther(const MapperConfig& config, bool given) {
  if (given)
    return std::make_unique<GivenNavigation>(
        config.given_navigation, config.navigation, config.vehicle);
  return std::make_unique<DeadReckoning>(config.navigation, config.vehicle);
}

}  // namespace

OtherNavigation::OtherNavigation(const MapperConfig& config, Bus* bus)
    : is_given_(config.navigation_source == NavigationSource::kDeadReckoning),
      sonar_time_offset_s_(config.sonar_time_offset_s),
      navigation_(MakeOther(config, is_given_)),
      clocks_(config.navigation.clock_jump_s),
      bus_(bus) {
  Subscribe<imu_t>(channels::kImu);
  Subscribe<dvl_t>(channels::kDvl);
  Subscribe<depth_t>(channels::kDepth);
  Subscribe<navigation_t>(channels::kIns);
  Subscribe<position_fix_t>(channels::kPositionFix);
  Subscribe<mbes_ping_t>(channels::kMbesPing);
  bus_->Subscribe<health_t>(channels::kHealth, 0, [this](const health_t& msg) {
    if (const auto heartbeat = FromLcm(msg)) clocks_.OnHeartbeat(*heartbeat);
  });
}

template <class Msg>
void OtherNavigation::Subscribe(const char* channel) {
  bus_->Subscribe<Msg>(channel, 0, [this](const Msg& msg) {
    auto sample = FromLcm(msg);
    if (!sample) return;
    sample->time =
        clocks_.InDiveTime(ChannelOf(*sample), sample->time, {FromUtime(msg.recv_utime), msg.seq});
    if constexpr (std::is_same_v<Msg, mbes_ping_t>) {
      navigation_->AddSoundSpeed(sample->time + FromSeconds(sonar_time_offset_s_),
                                 sample->sound_speed_mps);
    } else {
      if constexpr (std::is_same_v<Msg, dvl_t>) has_velocity_ = true;
      navigation_->Add(*sample);
      AddStates();
    }
  });
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
