#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

struct PartCollectorParams {
  int max_parts = 32;      // per message; KMALL's own limit for #MRZ
  int max_open = 4;        // incomplete messages at a time: two swaths of each of two heads
  double max_age_s = 2.0;  // of an incomplete message, measured with Add()'s times: two slow pings
};

// Reassembles sonar messages that were split into parts, one UDP datagram per part. Parts may come
// in any order. Memory is bounded by max_open * max_parts payloads. Key identifies the message that
// a part belongs to. Two messages may have equal keys (two heads of an old sonar): a part then goes
// to the first message that lacks it.
template <class Key>
class PartCollector {
 public:
  using Parts = std::vector<std::vector<std::uint8_t>>;

  explicit PartCollector(const PartCollectorParams& params) : params_(params) {}

  // Adds part `index` of `num_parts`. Returns all parts, in order, when the message is complete.
  // time: arrival of the part. The caller guarantees index < num_parts <= max_parts, a part that is
  // not empty, and no repeated part.
  std::optional<Parts> Add(
      const Key& key, std::size_t num_parts, std::size_t index, Bytes part, Time time) {
    const auto set = SetFor(key, num_parts, index, time);
    set->parts[index].assign(part.begin(), part.end());
    if (--set->missing > 0) return std::nullopt;
    Parts parts = std::move(set->parts);
    sets_.erase(set);
    return parts;
  }

  // Number of messages that were given up: too old, or too many at a time.
  std::int64_t lost() const { return lost_; }
  // Number of incomplete messages.
  std::int64_t open() const { return static_cast<std::int64_t>(sets_.size()); }

 private:
  struct Set {
    Key key;
    Time time;
    Parts parts;  // an empty part has not come yet
    std::size_t missing;
  };
  using Sets = std::deque<Set>;

  typename Sets::iterator SetFor(const Key& key,
                                 std::size_t num_parts,
                                 std::size_t index,
                                 Time time) {
    const auto found = std::find_if(sets_.begin(), sets_.end(), [&](const Set& set) {
      return set.key == key && set.parts.size() == num_parts && set.parts[index].empty();
    });
    if (found != sets_.end()) return found;
    const Duration max_age = FromSeconds(params_.max_age_s);
    lost_ += std::erase_if(sets_, [&](const Set& set) { return time - set.time > max_age; });
    if (open() >= params_.max_open) {
      sets_.pop_front();
      ++lost_;
    }
    sets_.push_back({key, time, Parts(num_parts), num_parts});
    return std::prev(sets_.end());
  }

  PartCollectorParams params_;
  Sets sets_;  // oldest first
  std::int64_t lost_ = 0;
};

}  // namespace seastitch
