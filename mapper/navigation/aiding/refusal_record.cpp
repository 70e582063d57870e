#include "mapper/navigation/aiding/refusal_record.hpp"

#include <cmath>
#include <cstddef>

namespace seastitch {
namespace {

constexpr double kMuch = 0.1;

std::int64_t SecondOf(Time t) {
  return static_cast<std::int64_t>(std::floor(ToSeconds(t - Time())));
}

double Part(int refused, int samples) {
  return samples > 0 ? static_cast<double>(refused) / samples : 0.0;
}

}  // namespace

void RefusalRecord::Add(Time t, bool refused, int taken) {
  since_ = Since(t);
  Second& bin = At(t);
  ++bin.samples;
  bin.taken += taken;
  last_ = t;
  if (refused) {
    ++bin.refused;
    last_refused_ = t;
    if (!streak_since_) streak_since_ = t;
  } else {
    streak_since_.reset();
  }
  NoteShare(t);
}

void RefusalRecord::AddUnusable(Time t) {
  since_ = Since(t);
  ++At(t).unusable;
  NoteShare(t);
}

RefusalRecord::Second& RefusalRecord::At(Time t) {
  const std::int64_t second = SecondOf(t);
  Second& bin = seconds_[static_cast<std::size_t>(second) % seconds_.size()];
  if (bin.second != second) bin = {second, 0, 0, 0, 0};
  return bin;
}

void RefusalRecord::NoteShare(Time t) {
  if (Share(t) <= kMuch)
    since_.reset();
  else if (!since_)
    since_ = t;
}

RefusalRecord::Second RefusalRecord::Minute(Time now) const {
  Second sum;
  for (const Second& bin : seconds_) {
    if (SecondOf(now) - bin.second >= kSeconds) continue;
    sum.samples += bin.samples;
    sum.refused += bin.refused;
    sum.taken += bin.taken;
    sum.unusable += bin.unusable;
  }
  return sum;
}

double RefusalRecord::Share(Time now) const {
  const Second sum = Minute(now);
  return Part(sum.refused - sum.taken + sum.unusable, sum.samples + sum.unusable);
}

std::optional<Time> RefusalRecord::Since(Time now) const {
  return Share(now) > kMuch ? since_ : std::nullopt;
}

bool RefusalRecord::AreOften(Time now) const {
  const Second sum = Minute(now);
  return Part(sum.refused, sum.samples) > kMuch;
}

double RefusalRecord::StreakS() const {
  return streak_since_ ? ToSeconds(*last_ - *streak_since_) : 0.0;
}

std::optional<double> RefusalRecord::QuietS(Time t) const {
  if (!last_refused_) return std::nullopt;
  return ToSeconds(t - *last_refused_);
}

}  // namespace seastitch
