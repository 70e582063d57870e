#include "drivers/nav/nav_codec.hpp"

#include "codecs/calendar.hpp"

namespace seastitch {

std::optional<Time> DayClock::Stamp(std::optional<Duration> time_of_day, Time recv) {
  if (!time_of_day || params_.clock == DeviceClock::kReceive) return params_.FromReceive(recv);
  const Time near = known_ ? known_->device + (recv - known_->recv) : recv;
  return stamper_.Stamp(NearestTimeOfDay(*time_of_day, near), recv);
}

void OtherSentences::Add(std::string_view type) {
  constexpr std::size_t kMostTypes = 16;
  ++count_;
  if (types_.size() < kMostTypes) types_.emplace(type);
}

std::string OtherSentences::names() const {
  std::string text;
  for (const std::string& type : types_) text += (text.empty() ? "" : ", ") + type;
  return text;
}

}  // namespace seastitch
