#include <optional>
#include <utility>

#include "mapper/geometry/calibrated_motion.hpp"
#include "mapper/mapper.hpp"

// Pings on their way into submaps.
namespace seastitch {

void Mapper::GeoreferencePings() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return;
  const Time newest = newest_input_.value_or(*latest);
  const Duration ahead = LooksAhead(params_.calibration);
  while (std::optional<MbesPing> ping = pings_.Take(*latest - ahead, newest))
    AddToSubmap(*std::move(ping));
  while (const std::optional<SoundingPing> ping = sounding_pings_.Take(*latest, newest))
    AddToSubmap(*ping);
}

void Mapper::AddToSubmap(MbesPing ping) {
  const SoundSpeed::Choice sound_speed = sound_speed_.For(ping);
  sound_speed_source_ = sound_speed.source;
  if (!SoundSpeed::IsProfile(sound_speed.source)) Count("pings_without_profile");
  const std::optional<Eigen::Isometry3d> pose = PoseAt(ping.time);
  if (!pose) return RefuseWithoutPose(ping.time);
  PoseLookup poses = [this](Time t) { return PoseAt(t); };
  if (!params_.calibration.IsZero()) {
    const bool by_heave = params_.calibration.heave_scale_percent != 0.0;
    const double heave_m = by_heave ? HeaveAt(poses, ping.time) : 0.0;
    poses = CalibratedPoses(std::move(poses), params_.calibration, ping.head, heave_m);
  }
  std::optional<SonarMotion> sonar = SonarMotion::Of(ping, poses, params_.vehicle);
  if (!sonar) return RefuseWithoutPose(ping.time);
  GeoreferencedPing placed = WithoutSoundings(ping, *sonar);
  placed.T_map_vehicle = *pose;
  AddToSubmap(std::move(placed),
              [ping = std::move(ping),
               sonar = *std::move(sonar),
               rays = sound_speed.rays,
               correction = SwathCorrectionOf(params_.calibration)] {
                return PlaceSoundings(ping, sonar, *rays, correction);
              });
}

void Mapper::AddToSubmap(const SoundingPing& ping) {
  const std::optional<Eigen::Isometry3d> pose = PoseAt(ping.time);
  if (!pose) return RefuseWithoutPose(ping.time);
  soundings_came_placed_ = true;
  GeoreferencedPing placed = Georeference(ping, *pose);
  PingSoundings soundings = std::move(placed);
  AddToSubmap(std::move(placed),
              [soundings = std::move(soundings)]() mutable { return std::move(soundings); });
}

void Mapper::AddToSubmap(GeoreferencedPing ping, std::function<PingSoundings()> georeference) {
  const Time time = ping.time;
  ping.dvl_yaw_rad = navigation_->dvl_yaw_rad();
  if (const auto state = navigation_->StateAt(time)) ping.bottom_lock = state->bottom_lock;
  PingPlacer::Ping placed =
      placer_.Place(std::move(ping), std::move(georeference), [this](Time t) { return PoseAt(t); });
  if (std::optional<Submap> closed = builder_.Add(std::move(placed))) OnClosed(std::move(*closed));
  if (const auto frame_time = builder_.frame_time()) frames_.Remember(*frame_time, time);
}

// Without a pose before navigation started, or before a restart: no fault.
void Mapper::RefuseWithoutPose(Time ping) {
  const bool is_early = nav_began_ && ping < *nav_began_;
  pings_lost_.Add(is_early ? PingLoss::kBeforeNavigation : PingLoss::kWithoutPose);
}

PingTally Mapper::pings_lost() const {
  PingTally lost = pings_lost_;
  lost.Add(builder_.pings_lost());
  lost.Add(PingLoss::kDroppedWaiting, pings_.dropped() + sounding_pings_.dropped());
  lost.Add(PingLoss::kFromTheFuture, pings_.from_the_future() + sounding_pings_.from_the_future());
  return lost;
}

}  // namespace seastitch
