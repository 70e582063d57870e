#include "common/core/time_series.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

#include "common/core/geo_point.hpp"

namespace seastitch {
namespace {

struct Item {
  Time time;
  int number = 0;
};

Time At(double t_s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(t_s); }

TEST(TimeSeries, FindsTheItemsAroundATime) {
  const std::vector<Item> items{{At(0.0), 0}, {At(1.0), 1}, {At(5.0), 2}};
  const auto between = AroundOf(items, At(0.25));
  ASSERT_TRUE(between);
  EXPECT_EQ(between->before.number, 0);
  EXPECT_EQ(between->after.number, 1);
  EXPECT_DOUBLE_EQ(between->share, 0.25);
  const auto on_one = AroundOf(items, At(1.0));
  ASSERT_TRUE(on_one);
  EXPECT_EQ(on_one->before.number, 1);
  EXPECT_EQ(on_one->after.number, 1);
  EXPECT_FALSE(AroundOf(items, At(-0.1)));
  EXPECT_FALSE(AroundOf(items, At(5.1)));
  EXPECT_TRUE(AroundOf(items, At(2.0)));
  EXPECT_FALSE(AroundOf(items, At(2.0), 3.9)) << "in a gap";
  EXPECT_TRUE(AroundOf(items, At(0.0), 3.9)) << "the first itself";
  EXPECT_FALSE(AroundOf(std::vector<Item>{}, At(0.0)));
}

TEST(TimeSeries, FindsTheFirstFromAndAfterATime) {
  const std::deque<Item> items{{At(0.0), 0}, {At(1.0), 1}, {At(1.0), 2}};
  EXPECT_EQ(FirstFrom(items, At(1.0))->number, 1);
  EXPECT_EQ(FirstAfter(items, At(0.0))->number, 1);
  EXPECT_EQ(FirstAfter(items, At(1.0)), items.end());
  EXPECT_EQ(FirstFrom(items, At(-9.0))->number, 0);
}

// A degree of latitude on a sphere of that radius; the same of longitude at 60 degrees is half; and
// over the antimeridian.
TEST(GeoPoint, DistancesAreThoseOfASphere) {
  const double degree_m = Deg2Rad(1.0) * 6'371'000.0;
  const GeoPoint at{Deg2Rad(60.0), Deg2Rad(179.5)};
  EXPECT_NEAR(DistanceM(at, {Deg2Rad(61.0), Deg2Rad(179.5)}), degree_m, 1e-6);
  EXPECT_NEAR(DistanceM(at, {Deg2Rad(60.0), Deg2Rad(-179.5)}), 0.5 * degree_m, 1e-6);
  const Eigen::Vector2d way_m = NorthEastBetween(at, {Deg2Rad(59.0), Deg2Rad(-179.5)});
  EXPECT_NEAR(way_m.x(), -degree_m, 1e-6);
  EXPECT_NEAR(way_m.y(), 0.5 * degree_m, 1e-6);
}

}  // namespace
}  // namespace seastitch
