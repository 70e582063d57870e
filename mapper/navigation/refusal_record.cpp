#include "mapper/navigation/refusal_record.hpp"

#include <cmath>

namespace seastitch {
namespace {

constexpr double kMuch = 0.1;

std::int64_t SecondOf(Time t) {
  return static_cast<std::int64_t>(std::floor(ToSeconds(t - Time())));
}

}  // namespace

void RefusalRecord::Add(Time t, bool refused) {
  Tally(t, refused);
  last_ = t;
  if (!refused)
    streak_since_.reset();
  else if (!streak_since_)
    streak_since_ = t;
}

void RefusalRecord::AddUnusable(Time t) { Tally(t, true); }

void RefusalRecord::Tally(Time t, bool refused) {
  since_ = Since(t);
  const std::int64_t second = SecondOf(t);
  Second& bin = seconds_[static_cast<std::size_t>(second) % seconds_.size()];
  if (bin.second != second) bin = {second, 0, 0};
  ++bin.samples;
  if (refused) {
    ++bin.refused;
    last_refused_ = t;
  }
  if (Share(t) <= kMuch)
    since_.reset();
  else if (!since_)
    since_ = t;
}

std::optional<Time> RefusalRecord::Since(Time now) const {
  return Share(now) > kMuch ? since_ : std::nullopt;
}

double RefusalRecord::Share(Time now) const {
  int samples = 0;
  int refused = 0;
  for (const Second& bin : seconds_) {
    if (SecondOf(now) - bin.second >= kSeconds) continue;
    samples += bin.samples;
    refused += bin.refused;
  }
  return samples > 0 ? static_cast<double>(refused) / samples : 0.0;
}

double RefusalRecord::StreakS() const {
  return streak_since_ ? ToSeconds(*last_ - *streak_since_) : 0.0;
}

std::optional<double> RefusalRecord::QuietS(Time t) const {
  if (!last_refused_) return std::nullopt;
  return ToSeconds(t - *last_refused_);
}

}  // namespace seastitch
