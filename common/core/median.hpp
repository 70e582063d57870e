#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace seastitch {

// Median of values, which must not be empty. Of an even number of values, the upper of the two in
// the middle.
template <class T>
T Median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The values that stand at indices `low` and `high` after sorting. Changes the order of *values.
template <class T>
std::pair<T, T> OrderStatistics(std::size_t low, std::size_t high, std::vector<T>* values) {
  const auto at = [values](std::size_t index) {
    const auto place = values->begin() + static_cast<std::ptrdiff_t>(index);
    std::nth_element(values->begin(), place, values->end());
    return *place;
  };
  const T lowest = at(low);
  return {lowest, at(high)};
}

}  // namespace seastitch
