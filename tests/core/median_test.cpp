#include "common/core/median.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace seastitch {
namespace {

TEST(Median, OfAnEvenNumberIsTheUpperOfTheTwoInTheMiddle) {
  EXPECT_EQ(Median(std::vector{3}), 3);
  EXPECT_EQ(Median(std::vector{9, 1, 4}), 4);
  EXPECT_EQ(Median(std::vector{9, 1, 4, 7}), 7);
}

TEST(OrderStatistics, AreTheValuesAtBothIndicesAfterSorting) {
  std::mt19937 random(1);
  for (std::size_t count = 1; count < 200; ++count) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<double>(random() % 50));
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t low = random() % count;
    const std::size_t high = low + random() % (count - low);
    EXPECT_EQ(OrderStatistics(low, high, &values), std::pair(sorted[low], sorted[high])) << count;
  }
}

}  // namespace
}  // namespace seastitch
