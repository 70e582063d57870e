#include "mapper/submaps/cloud_filter.hpp"
#include "common/runtime/for_each_beside.hpp"
#include "tests/support/property.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace seastitch {
namespace {

// Soundings scattered over 30 x 30 m, with a feature and with outliers, as a filter meets them.
struct Scene {
  PointCloud cloud;
  std::vector<PingSpan> pings;
  std::vector<std::uint8_t> is_outlier;
  std::vector<std::uint8_t> is_feature;
};

// One every 0.3 m along x.
PingSpan PingAt(double x) {
  const auto ping = static_cast<std::uint32_t>(x / 0.3);
  return {ping, ping};
}

using Height = std::function<double(double, double)>;  // above the seabed; 0: none

Scene MakeScene(double per_m2,
                double sigma_m,
                const Height& feature,
                double slope,
                double outlier_part,
                std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> side(0.0, 30.0);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  std::uniform_real_distribution<double> off(1.0, 6.0);
  std::normal_distribution<double> noise(0.0, sigma_m);
  Scene scene;
  for (int i = 0; i < static_cast<int>(900.0 * per_m2); ++i) {
    const double x = side(random);
    const double y = side(random);
    const double height = feature(x, y);
    const bool outlier = part(random) < outlier_part;
    double z = 20.0 + slope * x - height + noise(random);
    if (outlier) z += (part(random) < 0.5 ? -1.0 : 1.0) * off(random);
    scene.cloud.Add(Eigen::Vector3d(x, y, z).cast<float>());
    scene.pings.push_back(PingAt(x));
    scene.is_outlier.push_back(outlier ? 1 : 0);
    scene.is_feature.push_back(!outlier && height > 0.05 ? 1 : 0);
  }
  return scene;
}

double PartKept(const std::vector<std::uint8_t>& kept, const std::vector<std::uint8_t>& of) {
  double among = 0.0;
  double total = 0.0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (of[i] == 0) continue;
    total += 1.0;
    among += kept[i];
  }
  return total > 0.0 ? among / total : 0.0;
}

double Nothing(double, double) { return 0.0; }
double Pipeline(double, double y) {
  const double off = std::abs(y - 15.3);
  return off < 0.25 ? 0.25 + std::sqrt(0.0625 - off * off) : 0.0;
}
double WreckEdge(double x, double) { return x > 15.0 ? 4.0 : 0.0; }
double Boulders(double x, double y) {
  const double r = std::hypot(std::remainder(x, 6.0), std::remainder(y, 6.0));
  return r < 0.5 ? std::sqrt(0.25 - r * r) + 0.2 : 0.0;
}

struct Case {
  const char* name;
  Height feature;
  double slope;
  double per_m2;
};

class SeabedFilter : public testing::TestWithParam<Case> {};

TEST_P(SeabedFilter, DropsOutliersAndKeepsTheFeature) {
  const Case& c = GetParam();
  const Scene scene = MakeScene(c.per_m2, 0.03, c.feature, c.slope, 0.01, 3);
  const std::vector<std::uint8_t> kept = FindSeabed(scene.cloud, scene.pings, {});
  std::size_t parts = 0;
  const ForEach backwards = [&](std::size_t n, const std::function<void(std::size_t)>& work) {
    parts = n;
    for (std::size_t i = n; i-- > 0;) work(i);
  };
  EXPECT_EQ(FindSeabed(scene.cloud, scene.pings, {}, backwards), kept);
  EXPECT_GT(parts, 1u);
  EXPECT_EQ(FindSeabed(scene.cloud, scene.pings, {}, ForEachBeside), kept);
  std::vector<std::uint8_t> good = scene.is_outlier;
  for (std::uint8_t& g : good) g = g == 0 ? 1 : 0;
  EXPECT_LE(PartKept(kept, scene.is_outlier), 0.01);
  EXPECT_GE(PartKept(kept, good), 0.99);
  if (PartKept(scene.is_feature, scene.is_feature) > 0.0) {
    EXPECT_GE(PartKept(kept, scene.is_feature), 0.95);
  }
}

INSTANTIATE_TEST_SUITE_P(Seabeds,
                         SeabedFilter,
                         testing::Values(Case{"Flat", Nothing, 0.0, 60.0},
                                         Case{"FlatSparse", Nothing, 0.0, 6.0},
                                         Case{"SteepSlope", Nothing, 1.0, 60.0},
                                         Case{"Pipeline", Pipeline, 0.0, 60.0},
                                         Case{"WreckEdge", WreckEdge, 0.0, 60.0},
                                         Case{"Boulders", Boulders, 0.2, 60.0}),
                         [](const auto& seabed) { return seabed.param.name; });

TEST(SeabedFilterAlone, DropsPointsThatHangInEmptySpace) {
  Scene scene = MakeScene(30.0, 0.02, Nothing, 0.0, 0.0, 5);
  scene.cloud.Add({200.0f, 0.0f, 20.0f});
  scene.pings.push_back(PingAt(200.0));
  EXPECT_EQ(FindSeabed(scene.cloud, scene.pings, {}).back(), 0);
}

// Eight beams of one ping that find the same range above the seabed, and the same of two pings.
TEST(SeabedFilterAlone, DropsARunOfBeamsThatTheNextPingDoesNotConfirm) {
  for (const int pings : {1, 2}) {
    Scene scene = MakeScene(6.0, 0.03, Nothing, 0.0, 0.0, 7);
    const std::size_t seabed = scene.cloud.size();
    for (int beam = 0; beam < 8; ++beam) {
      const double x = 15.0 + 0.3 * (beam % pings);
      scene.cloud.Add(Eigen::Vector3d(x, 10.0 + 0.2 * beam, 14.0).cast<float>());
      scene.pings.push_back(PingAt(x));
    }
    const std::vector<std::uint8_t> kept = FindSeabed(scene.cloud, scene.pings, {});
    const auto run = std::count(kept.begin() + static_cast<std::ptrdiff_t>(seabed), kept.end(), 1);
    EXPECT_EQ(run, pings == 1 ? 0 : 8);
    // Where no second ping came, nothing speaks against it.
    scene.pings.assign(scene.pings.size(), {5, 5});
    const std::vector<std::uint8_t> alone = FindSeabed(scene.cloud, scene.pings, {});
    EXPECT_EQ(std::count(alone.begin() + static_cast<std::ptrdiff_t>(seabed), alone.end(), 1), 8);
  }
}

TEST(SeabedFilterAlone, TakesAnEmptyCloud) { EXPECT_TRUE(FindSeabed({}, {}, {}).empty()); }

TEST(SeabedFilterAlone, JudgesTheSameWhereverTheCloudLies) {
  EXPECT_TRUE(rc::check([] {
    const Scene scene =
        MakeScene(4.0, 0.03, Nothing, 0.1, 0.02, *rc::gen::arbitrary<std::uint64_t>());
    const auto dx = static_cast<float>(*rc::gen::inRange(-8, 8) * 64);  // whole columns
    PointCloud moved;
    for (const Eigen::Vector3f& p : scene.cloud.points) moved.Add({p.x() + dx, p.y(), p.z()});
    const auto a = FindSeabed(scene.cloud, scene.pings, {});
    const auto b = FindSeabed(moved, scene.pings, {});
    std::size_t differ = 0;
    for (std::size_t i = 0; i < a.size(); ++i) differ += a[i] != b[i] ? 1 : 0;
    RC_ASSERT(differ <= a.size() / 500);  // float rounding at the borders of cells
  }));
}

TEST(SoundingGate, NamesWhatIsWrong) {
  const CloudFilterParams params;
  const Eigen::Vector3d vehicle(100.0, 200.0, 10.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto at = [&](double x, double y, double z) {
    return CheckSounding(vehicle + Eigen::Vector3d(x, y, z), vehicle, params);
  };
  EXPECT_EQ(at(0.0, 5.0, 20.0), SoundingGate::kPass);
  EXPECT_EQ(at(0.0, nan, 20.0), SoundingGate::kNotFinite);
  EXPECT_EQ(at(0.0, 0.0, INFINITY), SoundingGate::kNotFinite);
  EXPECT_EQ(at(0.0, 5.0, -20.0), SoundingGate::kAboveVehicle);
  EXPECT_EQ(at(0.0, 0.1, 0.1), SoundingGate::kTooNear);
  EXPECT_EQ(at(0.0, 400.0, 20.0), SoundingGate::kTooFar);
}

}  // namespace
}  // namespace seastitch
