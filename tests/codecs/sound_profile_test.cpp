#include "codecs/sound_profile.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace seastitch {
namespace {

using Row = std::vector<ProfileRow>;

TEST(ProfileFrom, ReadsACastOnTheWayUpBackwards) {
  const auto profile = ProfileFrom(
      FromUtime(5), Row{{100.0, 1480.0}, {50.0, 1490.0}, {20.0, 1495.0}, {1.0, 1500.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->time, FromUtime(5));
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 20.0, 50.0, 100.0}));
  EXPECT_EQ(profile->speed_mps, (std::vector<double>{1500.0, 1495.0, 1490.0, 1480.0}));
}

TEST(ProfileFrom, KeepsTheWayDownOfACastDownAndUp) {
  const auto profile = ProfileFrom(
      FromUtime(5),
      Row{{1.0, 1500.0}, {50.0, 1490.0}, {100.0, 1480.0}, {50.0, 1491.0}, {2.0, 1501.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 50.0, 100.0}));
}

TEST(ProfileFrom, LosesOnlyTheRowsWithoutASoundSpeed) {
  const auto profile = ProfileFrom(
      FromUtime(5), Row{{0.0, 0.0}, {1.0, 1500.0}, {10.0, -99.0}, {20.0, 1490.0}, {30.0, 15.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 20.0}));
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{{1.0, 0.0}}));
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{}));
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{{1.0, 1500.0}, {no_number, 1490.0}}));
}

}  // namespace
}  // namespace seastitch
