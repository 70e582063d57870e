#include "common/core/bytes.hpp"
#include "tests/support/property.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace seastitch {
namespace {

template <class T>
void ExpectRoundTrip() {
  EXPECT_TRUE(rc::check([](T value) {
    ByteWriter out;
    out.Le(value);
    out.Be(value);
    ByteReader in(out.bytes());
    const T le = in.Le<T>();
    const T be = in.Be<T>();
    RC_ASSERT(in.ok() && in.left() == 0);
    RC_ASSERT(std::memcmp(&le, &value, sizeof value) == 0);
    RC_ASSERT(std::memcmp(&be, &value, sizeof value) == 0);
  }));
}

TEST(Bytes, GiveBackEveryNumberInBothOrders) {
  ExpectRoundTrip<std::uint8_t>();
  ExpectRoundTrip<std::int16_t>();
  ExpectRoundTrip<std::uint32_t>();
  ExpectRoundTrip<std::int64_t>();
  ExpectRoundTrip<float>();
  ExpectRoundTrip<double>();
}

TEST(Bytes, HaveTheOrderOfTheirName) {
  ByteWriter out;
  out.Le<std::uint16_t>(0x0102);
  out.Be<std::uint32_t>(0x03040506);
  const std::vector<std::uint8_t> expected{2, 1, 3, 4, 5, 6};
  EXPECT_EQ(out.bytes(), expected);
}

TEST(ByteReader, StaysPutAndGivesZeroAfterAShortRead) {
  EXPECT_TRUE(rc::check([](const std::vector<std::uint8_t>& bytes, std::uint8_t extra) {
    ByteReader in(bytes);
    RC_ASSERT(in.Take(bytes.size() + 1u + extra).empty());
    RC_ASSERT(!in.ok());
    RC_ASSERT(in.at() == 0u);
    RC_ASSERT(in.Le<std::uint8_t>() == 0u);  // also where one byte would still be there
    RC_ASSERT(in.left() == bytes.size());
  }));
}

TEST(ByteReader, NeverGoesPastTheEndWhateverIsAsked) {
  EXPECT_TRUE(
      rc::check([](const std::vector<std::uint8_t>& bytes, const std::vector<std::uint8_t>& steps) {
        ByteReader in(bytes);
        std::size_t want = 0;
        for (const std::uint8_t step : steps) {
          want += step;
          in.Skip(step);
        }
        RC_ASSERT(in.ok() == (want <= bytes.size()));
        RC_ASSERT(in.at() <= bytes.size());
      }));
}

TEST(ByteReader, IsNotFooledByASizeThatWrapsAround) {
  const std::vector<std::uint8_t> bytes(8);
  ByteReader in(bytes);
  in.Skip(4);
  EXPECT_TRUE(in.Take(SIZE_MAX - 2).empty());
  EXPECT_FALSE(in.ok());
}

TEST(ByteReader, TakesNothingFromNothing) {
  ByteReader in({});
  EXPECT_TRUE(in.Take(0).empty());
  EXPECT_TRUE(in.ok());
}

}  // namespace
}  // namespace seastitch
