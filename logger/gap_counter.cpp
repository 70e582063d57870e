#include "logger/gap_counter.hpp"

#include <optional>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxWatches = 200;  // so that HEALTH fits into one datagram

}  // namespace

std::int64_t GapCounter::Add(const std::string& channel, Bytes message) {
  const std::optional<MessagePlace> place = PlaceOf(message);
  if (!place) return 0;
  const std::string key = place->sender.empty() ? channel : channel + ' ' + place->sender;
  if (!watches_.contains(key) && watches_.size() >= kMaxWatches) return 0;
  const std::int64_t lost = watches_[key].Add(place->seq);
  if (lost > 0) {
    lost_[channel] += lost;
    total_ += lost;
  }
  return lost;
}

}  // namespace seastitch
