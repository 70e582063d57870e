#include "mapper/navigation/dead_reckoning.hpp"

#include <utility>

#include "mapper/navigation/dead_reckoning_impl.hpp"

namespace seastitch {

DeadReckoning::DeadReckoning(const NavigationParams& params, const VehicleGeometry& vehicle)
    : impl_((CheckParams(params), std::make_unique<Impl>(params, vehicle))) {}
DeadReckoning::~DeadReckoning() = default;
DeadReckoning::DeadReckoning(DeadReckoning&&) noexcept = default;
DeadReckoning& DeadReckoning::operator=(DeadReckoning&&) noexcept = default;

void DeadReckoning::Add(const ImuSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DvlSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const DepthSample& sample) { impl_->Add(sample); }
void DeadReckoning::Add(const PositionFix& fix) { impl_->Add(fix); }
void DeadReckoning::AddSoundSpeed(Time t, double speed_mps) { impl_->AddSoundSpeed(t, speed_mps); }
void DeadReckoning::Finish() { impl_->Finish(); }

StartState DeadReckoning::start_state() const { return impl_->start_state(); }
bool DeadReckoning::place_is_known() const { return impl_->place_is_known(); }
bool DeadReckoning::starts_from_fix() const { return impl_->starts_from_fix(); }
std::vector<SuspectedOffset> DeadReckoning::suspected_offsets() const {
  return impl_->suspected_offsets();
}
NavSensorHealth DeadReckoning::health(NavSensor sensor) const { return impl_->health(sensor); }
NavDoubts DeadReckoning::doubts() const { return impl_->doubts(); }
double DeadReckoning::dvl_yaw_rad() const { return impl_->dvl_yaw_rad(); }

std::optional<Time> DeadReckoning::latest() const { return impl_->track().latest(); }
std::optional<NavState> DeadReckoning::StateAt(Time t) const { return impl_->track().StateAt(t); }
Time DeadReckoning::AfterGap(Time t) const { return impl_->track().AfterGap(t); }
std::optional<NavState> DeadReckoning::Predicted() const { return impl_->Predicted(); }
std::optional<Eigen::Matrix2d> DeadReckoning::VelocityCovariance(Time t) const {
  return impl_->track().VelocityCovariance(t);
}
std::optional<Eigen::Matrix3d> DeadReckoning::RelativeCovariance(Time a, Time b) const {
  return impl_->RelativeCovariance(a, b);
}
std::vector<SmoothedPose> DeadReckoning::TakeSmoothed(Time until) {
  return impl_->TakeSmoothed(until);
}
std::optional<Pose2> DeadReckoning::Hindsight(Time anchor, Time t) const {
  return impl_->track().Hindsight(anchor, t);
}
std::vector<MapFix> DeadReckoning::WaitingFixes() const { return impl_->WaitingFixes(); }
std::vector<MapFix> DeadReckoning::TakeFixes(Time until) { return impl_->TakeFixes(until); }

std::optional<std::vector<std::uint8_t>> DeadReckoning::Save(std::optional<Time> since) const {
  return impl_->Save(since);
}
bool DeadReckoning::Restore(Bytes saved) {
  std::unique_ptr<Impl> restored = impl_->Anew();
  if (!restored->Restore(saved)) return false;
  impl_ = std::move(restored);
  return true;
}

const NavTally& DeadReckoning::tally() const { return impl_->tally(); }
InnovationSummary DeadReckoning::innovations(NavSensor sensor) const {
  return impl_->filter().innovations(sensor);
}

}  // namespace seastitch
