#include "mapper/input/rewind_watch.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {
namespace {

constexpr int kFewest = 2;  // messages of a run that count

}  // namespace

void RewindWatch::Add(SensorChannel channel, Time time) {
  const auto index = static_cast<std::size_t>(channel);
  if (IsRare(index)) return;
  Channel& c = channels_[index];
  ++messages_;
  const Duration jump = FromSeconds(jump_s_);
  const std::optional<Time> ahead = std::exchange(c.ahead, std::nullopt);
  if (c.newest && time > *c.newest + jump && !(ahead && time >= *ahead - jump)) {
    c.ahead = time;
    return;
  }
  if (!c.newest || time >= *c.newest - jump) {
    c.newest = c.newest ? std::max(*c.newest, time) : time;
    c.went_on = messages_;
    c.run.reset();
    return;
  }
  const bool goes_on = c.run && time >= c.run->last - jump;
  if (!goes_on) c.run = Run{messages_, 0, time, time};
  ++c.run->messages;
  c.run->last = std::max(c.run->last, time);
}

const RewindWatch::Channel* RewindWatch::TimeBase() const {
  for (const SensorChannel base : {SensorChannel::kImu, SensorChannel::kIns})
    if (const Channel& c = channels_[static_cast<std::size_t>(base)]; c.run) return &c;
  return nullptr;
}

std::optional<double> RewindWatch::behind_s() const {
  const Channel* const base = TimeBase();
  if (base == nullptr || base->run->messages < kFewest) return std::nullopt;
  return ToSeconds(*base->newest - base->run->begin);
}

bool RewindWatch::IsSure() const {
  const Channel* const base = TimeBase();
  if (base == nullptr || ToSeconds(base->run->last - base->run->begin) < kSureS) return false;
  bool another = false;
  for (const Channel& c : channels_) {
    if (&c == base) continue;
    if (c.went_on > base->run->since) return false;
    another = another || (c.run && c.run->messages >= kFewest);
  }
  return another;
}

}  // namespace seastitch
