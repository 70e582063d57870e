// The map frame, against the radii of curvature of WGS 84 (NIMA TR8350.2), not against a library.
#include "common/geo/map_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kSemiMajor_m = 6'378'137.0;
constexpr double kEccentricity2 = 6.694379990141e-3;

struct Radii {
  explicit Radii(double latitude_rad) {
    const double w2 = 1.0 - kEccentricity2 * std::pow(std::sin(latitude_rad), 2);
    prime_vertical_m = kSemiMajor_m / std::sqrt(w2);
    meridian_m = kSemiMajor_m * (1.0 - kEccentricity2) / std::pow(w2, 1.5);
  }
  double meridian_m;
  double prime_vertical_m;
};

TEST(MapFrame, IsNorthAndEastOfItsOrigin) {
  for (const Datum origin : {Datum{43.07, -70.71}, Datum{0.0, 0.0}, Datum{-77.8, 166.7}}) {
    const MapFrame map(origin);
    const double latitude_rad = Deg2Rad(origin.latitude_deg);
    const Radii radii(latitude_rad);
    EXPECT_LT(map.NorthEastOf(origin).norm(), 1e-6);
    constexpr double kStepRad = 1e-6;  // about 6 m
    const Eigen::Vector2d north =
        map.NorthEastOf(GeoPoint{latitude_rad + kStepRad, Deg2Rad(origin.longitude_deg)});
    EXPECT_NEAR(north.x(), kStepRad * radii.meridian_m, 1e-4);
    EXPECT_NEAR(north.y(), 0.0, 1e-4);
    const Eigen::Vector2d east =
        map.NorthEastOf(GeoPoint{latitude_rad, Deg2Rad(origin.longitude_deg) + kStepRad});
    EXPECT_NEAR(east.y(), kStepRad * radii.prime_vertical_m * std::cos(latitude_rad), 1e-4);
    EXPECT_NEAR(east.x(), 0.0, 1e-4);
  }
}

// A point on the ellipsoid lies below the tangent plane: a point of the plane, at its own depth, is
// the same point.
TEST(MapFrame, TakesAPointOfTheMapBackToItself) {
  const MapFrame map(Datum{43.07, -70.71});
  for (const Eigen::Vector2d& p_m :
       {Eigen::Vector2d(120.0, -45.0), Eigen::Vector2d(-3000.0, 2500.0)}) {
    const Eigen::Vector2d back = map.NorthEastOf(map.PointAt(p_m));
    EXPECT_LT((back - p_m).norm(), 1e-3);
    // A degree of longitude at 100 m below is shorter by 100 m in 6,378 km.
    const Datum below = map.PointAt(p_m, 100.0), at = map.PointAt(p_m);
    const double ratio = (below.longitude_deg + 70.71) / (at.longitude_deg + 70.71);
    EXPECT_NEAR(ratio - 1.0, 100.0 / Radii(Deg2Rad(43.07)).prime_vertical_m, 1e-7);
  }
}

}  // namespace
}  // namespace seastitch
