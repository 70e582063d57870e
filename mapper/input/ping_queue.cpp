#include "mapper/input/ping_queue.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {

template <class Ping>
void PingQueue<Ping>::Add(Ping ping) {
  if (pings_.size() >= capacity_) {
    pings_.pop_front();
    ++dropped_;
  }
  const auto place =
      std::upper_bound(pings_.begin(), pings_.end(), ping.time, [](Time t, const Waiting& other) {
        return t < other.ping.time;
      });
  const Time last_echo = LastEcho(ping);
  pings_.insert(place, {std::move(ping), last_echo});
}

template <class Ping>
std::optional<Ping> PingQueue<Ping>::Take(Time latest, Time newest) {
  while (!pings_.empty()) {
    if (pings_.front().last_echo <= latest) return TakeAny();
    if (ToSeconds(pings_.front().ping.time - std::max(latest, newest)) <= kMaxAheadS)
      return std::nullopt;
    pings_.pop_front();
    ++from_the_future_;
  }
  return std::nullopt;
}

template <class Ping>
std::optional<Ping> PingQueue<Ping>::TakeAny() {
  if (pings_.empty()) return std::nullopt;
  Ping ping = std::move(pings_.front().ping);
  pings_.pop_front();
  return ping;
}

template class PingQueue<MbesPing>;
template class PingQueue<SoundingPing>;

}  // namespace seastitch
