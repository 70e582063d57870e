#include "drivers/nav/nav_codec.hpp"

#include "codecs/calendar.hpp"

namespace seastitch {

std::optional<Time> DayClock::Stamp(std::optional<Duration> time_of_day, Time recv) {
  if (!time_of_day || params_.clock == DeviceClock::kReceive) return params_.FromReceive(recv);
  const Time near = known_ ? known_->device + (recv - known_->recv) : recv;
  return stamper_.Stamp(NearestTimeOfDay(*time_of_day, near), recv);
}

}  // namespace seastitch
