#pragma once

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>

#include "common/core/time.hpp"

// Items with a member `time`, in order of it: a vector or a deque.
namespace seastitch {

// Iterator to the first item that is not before t.
template <class Items>
auto FirstFrom(Items& items, Time t) {
  return std::lower_bound(
      items.begin(), items.end(), t, [](const auto& item, Time time) { return item.time < time; });
}

// Iterator to the first item after t.
template <class Items>
auto FirstAfter(Items& items, Time t) {
  return std::upper_bound(
      items.begin(), items.end(), t, [](Time time, const auto& item) { return time < item.time; });
}

// The items around a time, and the share of the second, from 0 to 1.
template <class Item>
struct Around {
  const Item& before;
  const Item& after;
  double share;
};

// Absent: t lies outside, or between two items that are more than max_gap_s apart. At the time of
// an item both are that one.
template <class Items, class Item = typename Items::value_type>
std::optional<Around<Item>> AroundOf(const Items& items,
                                     Time t,
                                     double max_gap_s = std::numeric_limits<double>::infinity()) {
  const auto after = FirstFrom(items, t);
  if (after == items.end()) return std::nullopt;
  if (after->time == t) return Around<Item>{*after, *after, 0.0};
  if (after == items.begin()) return std::nullopt;
  const Item& before = *std::prev(after);
  const double gap_s = ToSeconds(after->time - before.time);
  if (gap_s > max_gap_s) return std::nullopt;
  return Around<Item>{before, *after, ToSeconds(t - before.time) / gap_s};
}

}  // namespace seastitch
