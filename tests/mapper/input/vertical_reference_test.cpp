#include "mapper/input/vertical_reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "common/core/pose.hpp"
#include "mapper/mapper.hpp"

namespace seastitch {
namespace {

Time At(double t_s) { return FromUtime(1'777'716'000'000'000) + FromSeconds(t_s); }

// --- the grid ------------------------------------------------------------------------------------

// 3 x 2 points at longitudes 10, 11, 12 and latitudes 51 (first row), 50.
constexpr char kGrid[] =
    "ncols 3\nnrows 2\nxllcorner 9.5\nyllcorner 49.5\ncellsize 1\nNODATA_value -9999\n"
    "40 41 42\n44 45 -9999\n";

std::optional<double> HeightAt(const DatumHeight& grid, double latitude_deg, double longitude_deg) {
  return grid.At({Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)});
}

TEST(DatumHeight, ChangesEvenlyBetweenItsPoints) {
  const DatumHeight grid = DatumHeight::Parse(kGrid, "g.asc");
  EXPECT_NEAR(*HeightAt(grid, 51.0, 10.0), 40.0, 1e-9);
  EXPECT_NEAR(*HeightAt(grid, 51.0, 11.0), 41.0, 1e-9);
  EXPECT_NEAR(*HeightAt(grid, 50.0, 10.0), 44.0, 1e-9);
  EXPECT_NEAR(*HeightAt(grid, 50.75, 10.5), 41.5, 1e-9);
  EXPECT_NEAR(*HeightAt(grid, 51.4, 9.6), 40.0, 1e-9) << "the half cell around it";
  EXPECT_NEAR(*HeightAt(grid, 50.75, 370.5), 41.5, 1e-9);
}

TEST(DatumHeight, IsNothingOutsideAndBesideWhatIsMissing) {
  const DatumHeight grid = DatumHeight::Parse(kGrid, "g.asc");
  EXPECT_FALSE(HeightAt(grid, 51.6, 10.0));
  EXPECT_FALSE(HeightAt(grid, 49.4, 10.0));
  EXPECT_FALSE(HeightAt(grid, 51.0, 12.6));
  EXPECT_FALSE(HeightAt(grid, 51.0, -10.0));
  EXPECT_FALSE(HeightAt(grid, 50.1, 11.9));
  EXPECT_TRUE(HeightAt(grid, 51.0, 12.0));
  EXPECT_FALSE(DatumHeight().At({0.9, 0.2}));
}

TEST(DatumHeight, MistakesAreNamed) {
  const auto said = [](const std::string& text) -> std::string {
    try {
      DatumHeight::Parse(text, "g.asc");
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(said(""), "g.asc: no ESRI ASCII grid: no ncols");
  EXPECT_EQ(said("ncols 2\nnrows 1\ncellsize 0\n"),
            "g.asc: ncols, nrows and cellsize are those of no grid");
  EXPECT_EQ(said("ncols 2\nnrows 1\ncellsize 1\n1 2"), "g.asc: no xllcorner");
  const std::string head = "ncols 2\nnrows 1\ncellsize 1\nxllcenter 5\nyllcenter 50\n";
  EXPECT_EQ(said(head + "1 2"), "");
  EXPECT_EQ(said(head + "1"), "g.asc: not ncols x nrows values but 1");
  EXPECT_EQ(said(head + "1 2 3"), "g.asc: not ncols x nrows values but 3");
  EXPECT_EQ(said(head + "1 high"), "g.asc: 'high' is not a number of metres");
  EXPECT_EQ(said("ncols 2\nnrows 1\ncellsize 100\nxllcenter 500000\nyllcenter 7000000\n1 2"),
            "g.asc: its corner is not in degrees of longitude and latitude");
}

// --- heights into depths -------------------------------------------------------------------------

// A ship in a swell of 1 m; tide of 0.2 m an hour. The INS stands 3 m above the reference point and
// 10 m ahead of it, the ship is down by 2 degrees at the bow.
class HeightsDive : public testing::Test {
 protected:
  static constexpr double kZeroAboveEllipsoidM = 43.0;
  static constexpr double kPitchRad = -2.0 / 57.29578;

  static VehicleGeometry Vehicle() {
    VehicleGeometry vehicle;
    vehicle.datum.latitude_rad = Deg2Rad(50.0);
    vehicle.datum.longitude_rad = Deg2Rad(10.0);
    vehicle.T_vehicle_imu.translation() << 10.0, 0.0, -3.0;
    return vehicle;
  }
  static VerticalReferenceParams Params() {
    VerticalReferenceParams params;
    params.by_heights = true;
    params.separation_m = kZeroAboveEllipsoidM;
    return params;
  }
  static double TideM(double t_s) { return 1.5 + 0.2 * t_s / 3600.0; }
  static double DepthM(double t_s) { return 2.0 + std::sin(0.8 * t_s); }  // below the water line

  static NavigationSample Ins(double t_s) {
    NavigationSample ins;
    ins.time = At(t_s);
    ins.position = GeoPosition{Deg2Rad(50.0), Deg2Rad(10.0), {0.1, 0.1}};
    ins.attitude = Attitude{Eigen::Quaterniond(RotationFromRpy(0.0, kPitchRad, 0.0))};
    ins.velocity = GeoVelocity{};
    const double above_reference_m = 3.0 * std::cos(kPitchRad) + 10.0 * std::sin(kPitchRad);
    ins.height =
        InsVertical{kZeroAboveEllipsoidM + TideM(t_s) - DepthM(t_s) + above_reference_m, 0.0};
    return ins;
  }
  static DepthSample Depth(double t_s) {
    return DepthSample{At(t_s), std::nullopt, DepthM(t_s), 0.1};
  }
};

TEST_F(HeightsDive, TheWaterLineIsWhereHeightAndDepthAgree) {
  VerticalReference vertical(Params(), Vehicle());
  EXPECT_FALSE(vertical.LevelAt(At(0.0)));
  EXPECT_FALSE(vertical.IsMissed()) << "no depth yet";
  for (int i = 0; i < 6000; ++i) {
    vertical.Add(Depth(0.1 * i));
    NavigationSample ins = Ins(0.1 * i);
    if (i % 77 == 0) ins.height->value_m += 20.0;  // of a satellite too few
    vertical.Add(ins);
    if (i > 100) {
      ASSERT_NEAR(*vertical.LevelAt(At(0.1 * i)), TideM(0.1 * i), 0.01) << i;
    }
  }
  EXPECT_FALSE(vertical.IsMissed());
  vertical.Add(Depth(600.0 + 3700.0));
  EXPECT_TRUE(vertical.IsMissed());
}

TEST_F(HeightsDive, TheZeroMayHaveAHeightByPlace) {
  VerticalReferenceParams params = Params();
  params.separation = DatumHeight::Parse(kGrid, "g.asc");
  VerticalReference vertical(params, Vehicle());
  vertical.Add(Ins(0.0));
  vertical.Add(Depth(0.1));
  vertical.Add(Ins(0.2));
  EXPECT_NEAR(*vertical.LevelAt(At(0.2)), 1.5 - 1.0, 0.1) << "44 m there, not 43";
}

// Through the mapper: the vehicle's depth is that of the map.
TEST_F(HeightsDive, DepthsCountFromTheZeroThatIsStated) {
  MapperParams params;
  params.vehicle = Vehicle();
  params.navigation_source = NavigationSource::kGiven;
  params.vertical = Params();
  Mapper mapper(params);
  int compared = 0;
  for (int i = 0; i < 1200; ++i) {
    mapper.Add(Depth(0.1 * i));
    mapper.Add(Ins(0.1 * i));
    for (const MapperEvent& event : mapper.TakeEvents()) {
      const auto* nav = std::get_if<NavState>(&event);
      if (nav == nullptr || i < 100) continue;
      const double t_s = ToSeconds(nav->time - At(0.0));
      EXPECT_NEAR(nav->T_map_vehicle.translation().z(), DepthM(t_s) - TideM(t_s), 0.02) << t_s;
      ++compared;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_EQ(mapper.counters().at("depths_without_height"), 1) << "the one before the first height";
}

}  // namespace
}  // namespace seastitch
