#include "mapper/ping_queue.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {

void PingQueue::Add(MbesPing ping) {
  if (pings_.size() >= capacity_) {
    pings_.pop_front();
    ++dropped_;
  }
  const auto place =
      std::upper_bound(pings_.begin(), pings_.end(), ping.time, [](Time t, const MbesPing& other) {
        return t < other.time;
      });
  pings_.insert(place, std::move(ping));
}

std::optional<MbesPing> PingQueue::Take(Time latest) {
  while (!pings_.empty()) {
    const Duration ahead = LastEcho(pings_.front()) - latest;
    if (ahead <= Duration::zero()) return TakeAny();
    if (ToSeconds(ahead) <= kMaxAheadS) return std::nullopt;
    pings_.pop_front();
    ++from_the_future_;
  }
  return std::nullopt;
}

std::optional<MbesPing> PingQueue::TakeAny() {
  if (pings_.empty()) return std::nullopt;
  MbesPing ping = std::move(pings_.front());
  pings_.pop_front();
  return ping;
}

}  // namespace seastitch
