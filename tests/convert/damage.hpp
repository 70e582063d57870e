#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "common/convert/convert.hpp"

// What the tests of conversions share.
namespace seastitch {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

// Through the wire: what a subscriber gets.
template <class Msg>
Msg Wire(const Msg& msg) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  EXPECT_EQ(msg.encode(bytes.data(), 0, static_cast<int>(bytes.size())), bytes.size());
  Msg copy{};
  EXPECT_EQ(copy.decode(bytes.data(), 0, static_cast<int>(bytes.size())), bytes.size());
  return copy;
}

// Every damage alone makes FromLcm refuse a message that it took before.
template <class Msg>
struct Damage {
  const char* name;
  std::function<void(Msg&)> apply;
};
template <class Msg>
void ExpectEachRefused(const Msg& good, const std::vector<Damage<Msg>>& damages) {
  ASSERT_TRUE(FromLcm(good)) << "the undamaged message";
  for (const Damage<Msg>& damage : damages) {
    Msg bad = good;
    damage.apply(bad);
    EXPECT_FALSE(FromLcm(bad)) << damage.name;
  }
}

}  // namespace seastitch
