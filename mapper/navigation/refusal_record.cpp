#include "mapper/navigation/refusal_record.hpp"

#include <cmath>

namespace seastitch {
namespace {

constexpr double kMuch = 0.1;

}  // namespace

void RefusalRecord::Add(Time t, bool refused) {
  if (!first_) first_ = t;
  last_ = t;
  const auto second = static_cast<std::int64_t>(std::floor(ToSeconds(t - *first_)));
  Second& bin = seconds_[static_cast<std::size_t>(second) % kSeconds];
  if (bin.second != second) bin = {second, 0, 0};
  ++bin.samples;
  if (refused) {
    ++bin.refused;
    last_refused_ = t;
    if (!streak_since_) streak_since_ = t;
  } else {
    streak_since_.reset();
  }
  if (Share() <= kMuch)
    since_.reset();
  else if (!since_)
    since_ = t;
}

double RefusalRecord::Share() const {
  if (!last_) return 0.0;
  const auto now = static_cast<std::int64_t>(std::floor(ToSeconds(*last_ - *first_)));
  int samples = 0;
  int refused = 0;
  for (const Second& bin : seconds_) {
    if (bin.second < 0 || now - bin.second >= static_cast<std::int64_t>(kSeconds)) continue;
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
