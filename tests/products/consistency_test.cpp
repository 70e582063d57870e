#include "products/map/consistency.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "products/map/s44.hpp"
#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

using testing::SeenFrom;

Survey CollectAll(const TemporaryDir& folder, const std::vector<Submap>& submaps) {
  SurveyCollector collector(folder.path());
  for (const Submap& s : submaps) collector.Add(s);
  return collector.Finish();
}

ConsistencyMap MapOf(const Survey& survey, double cell_m, std::size_t cache_points = 1'000'000) {
  const SurveyPoses poses = DeadReckonedPoses(survey);
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    box.extend(NorthEastBox(survey.submaps, poses, i, MapProjection()));
  }
  return ComputeConsistency(survey.submaps,
                            poses,
                            MapProjection(),
                            GridGeometry::Covering(box.min(), box.max(), cell_m),
                            cache_points);
}

Submap WithId(Submap submap, int id) {
  submap.id.value = id;
  return submap;
}

const testing::Seabed kFlat = [](double, double) { return 30.0; };
const testing::Seabed kSlope20 = [](double north, double) {
  return 30.0 + north * std::tan(Deg2Rad(20.0));
};

TEST(Consistency, IdenticalSubmapsHaveNoPointErrorAndTheirOwnNoiseAsSurfaceError) {
  const TemporaryDir folder;
  const Submap one = SeenFrom(0, {}, {}, kFlat, 10, 10, 0.25, 0.02);
  const ConsistencyFigures f = Figures(MapOf(CollectAll(folder, {one, WithId(one, 1)}), 1.0));
  EXPECT_GT(f.point.cells, 60u);
  EXPECT_EQ(f.point.rms_m, 0.0);
  EXPECT_NEAR(f.surface.median_m, 0.02 * 0.8, 0.008);
}

TEST(Consistency, OfTwoCleanLooksAtTheSameGroundIsSpacingByPointsAndNoiseBySurface) {
  for (const double spacing : {0.15, 0.3}) {
    const TemporaryDir folder;
    const ConsistencyFigures f =
        Figures(MapOf(CollectAll(folder,
                                 {SeenFrom(0, {}, {}, kFlat, 8, 8, spacing, 0.02),
                                  SeenFrom(1, {}, {}, kFlat, 8, 8, spacing, 0.02)}),
                      1.0));
    EXPECT_NEAR(f.point.median_m, 0.5 * spacing, 0.15 * spacing) << spacing;
    EXPECT_NEAR(f.surface.median_m, 0.018, 0.006) << spacing;
  }
}

TEST(Consistency, OnASlopeGrowsWithTheShiftTimesTheSineOfTheSlope) {
  for (const double shift : {0.25, 0.5, 1.0}) {
    const TemporaryDir folder;
    const Submap a = SeenFrom(0, {}, {}, kSlope20, 8, 4, 0.1, 0.0);
    const Submap b = SeenFrom(1, {}, {shift, 0, 0}, kSlope20, 8, 4, 0.1, 0.0);
    const ConsistencyFigures f = Figures(MapOf(CollectAll(folder, {a, b}), 1.0));
    const double expected = shift * std::sin(Deg2Rad(20.0));
    EXPECT_NEAR(f.surface.median_m, expected, 1e-4) << shift;
    EXPECT_NEAR(f.point.median_m, std::hypot(expected, 0.055), 0.012) << shift;
  }
}

TEST(Consistency, OfAVerticalOffsetOnLevelGroundIsThatOffset) {
  const TemporaryDir folder;
  Submap b = SeenFrom(1, {}, {}, kFlat, 6, 6, 0.15, 0.0);
  b.T_map_submap.translation().z() += 0.4;
  const Submap a = SeenFrom(0, {}, {}, kFlat, 6, 6, 0.15, 0.0);
  const ConsistencyFigures f = Figures(MapOf(CollectAll(folder, {a, b}), 1.0));
  EXPECT_NEAR(f.surface.rms_m, 0.4, 1e-4);
  EXPECT_NEAR(f.point.rms_m, 0.4, 0.02);
}

TEST(Consistency, IsThatOfTheWorstPairWhereThreeSubmapsMeet) {
  const TemporaryDir folder;
  std::vector<Submap> submaps;
  for (int id = 0; id < 3; ++id) {
    submaps.push_back(WithId(SeenFrom(0, {}, {}, kFlat, 6, 6, 0.2, 0.0), id));
    submaps.back().T_map_submap.translation().z() += id == 0 ? 0.0 : id == 1 ? 0.1 : 0.35;
  }
  const ConsistencyMap map = MapOf(CollectAll(folder, submaps), 1.0);
  EXPECT_NEAR(Figures(map).point.median_m, 0.35, 1e-3);
  EXPECT_NEAR(Figures(map).surface.median_m, 0.35, 1e-3);
  EXPECT_EQ(*std::max_element(map.submaps.cells().begin(), map.submaps.cells().end()), 3);
}

TEST(Consistency, HasNoValueWhereOneSubmapAloneSees) {
  const TemporaryDir folder;
  const Survey survey =
      CollectAll(folder,
                 {SeenFrom(0, {}, {}, testing::Hills, 6, 6, 0.3, 0.0),
                  SeenFrom(1, {20, 0, 0}, {20, 0, 0}, testing::Hills, 6, 6, 0.3, 0)});
  const ConsistencyMap map = MapOf(survey, 1.0);
  for (const ErrorFigures& f : {Figures(map).point, Figures(map).surface}) {
    EXPECT_EQ(f.cells, 0u);
    EXPECT_TRUE(std::isnan(f.rms_m));
  }
  EXPECT_EQ(*std::max_element(map.submaps.cells().begin(), map.submaps.cells().end()), 1);
}

TEST(Consistency, SaysNothingPastTheEdgeOfASubmap) {
  // Two swaths that share one row of cells without reaching into one another.
  const TemporaryDir folder;
  const Submap south = SeenFrom(0, {-4.2, 0, 0}, {-4.2, 0, 0}, kFlat, 10, 10, 0.2, 0.0);
  const Submap north = SeenFrom(1, {6.2, 0, 0}, {6.2, 0, 0}, kFlat, 10, 10, 0.2, 0.0);
  const ConsistencyMap map = MapOf(CollectAll(folder, {south, north}), 2.0);
  EXPECT_EQ(*std::max_element(map.submaps.cells().begin(), map.submaps.cells().end()), 2);
  EXPECT_EQ(Figures(map).point.cells, 0u);
}

TEST(Consistency, IsTheSameWithACacheOfOneSubmap) {
  const TemporaryDir folder;
  const testing::DriftingSurvey drifting = testing::MakeDriftingSurvey();
  const Survey survey = CollectAll(folder, drifting.submaps);
  const ConsistencyMap small = MapOf(survey, 1.0, 1), large = MapOf(survey, 1.0);
  EXPECT_EQ(small.point_error_m.cells(), large.point_error_m.cells());
  EXPECT_EQ(small.surface_error_m.cells(), large.surface_error_m.cells());
}

TEST(Consistency, FallsWhenDriftingSubmapsArePutRightOverTheSameCells) {
  const TemporaryDir folder;
  const testing::DriftingSurvey drifting = testing::MakeDriftingSurvey();
  const Survey survey = CollectAll(folder, drifting.submaps);
  const GridGeometry geometry = GridGeometry::Covering({-40, -40}, {120, 120}, 1.0);
  const auto map_at = [&](const SurveyPoses& poses) {
    return ComputeConsistency(survey.submaps, poses, MapProjection(), geometry, 1'000'000);
  };
  const ConsistencyMap before = map_at(DeadReckonedPoses(survey));
  const ConsistencyMap after = map_at({drifting.truth, {}});
  const ConsistencyFigures b = FiguresOfComparableCells(before, after);
  const ConsistencyFigures a = FiguresOfComparableCells(after, before);
  EXPECT_EQ(a.point.cells, b.point.cells);
  EXPECT_LT(a.point.cells, Figures(before).point.cells);
  EXPECT_LT(a.point.rms_m, 0.95 * b.point.rms_m);
  EXPECT_LT(a.surface.rms_m, 0.5 * b.surface.rms_m);
}

// One map sees some cells twice and the other three times, with the same errors a pair: what the
// third adds to the largest is no difference between the maps.
TEST(Consistency, ComparesCellsThatAsManySubmapsSee) {
  const GridGeometry geometry = GridGeometry::Covering({0, 0}, {9, 9}, 1.0);
  const auto map_seen_by = [&](std::uint16_t submaps, float error_m) {
    ConsistencyMap map{Grid<float>(geometry, error_m),
                       Grid<float>(geometry, error_m),
                       Grid<std::uint16_t>(geometry, 2)};
    map.submaps(0, 0) = submaps;
    map.surface_error_m(0, 0) = 10.0f * error_m;
    return map;
  };
  const ConsistencyMap twice = map_seen_by(2, 0.1f);
  const ConsistencyMap thrice = map_seen_by(3, 0.1f);
  const std::uint64_t cells = geometry.size();
  EXPECT_EQ(FiguresOfComparableCells(thrice, thrice).surface.cells, cells);
  EXPECT_EQ(FiguresOfComparableCells(thrice, twice).surface.cells, cells - 1);
  EXPECT_NEAR(FiguresOfComparableCells(thrice, twice).surface.rms_m, 0.1, 1e-6);
  EXPECT_GT(FiguresOfComparableCells(twice, twice).surface.rms_m, 0.13);
}

// At 100 m: sqrt(2) sqrt(0.15^2 + 0.75^2) = 1.082 m for the Exclusive Order.
TEST(S44, CountsTheCellsOfEachOrderAndLeavesOutThoseOfOneSwath) {
  Raster elevation, mismatch;
  elevation.values = {-100.0f, -100.0f, -100.0f, kNoData};
  mismatch.values = {1.07f, 1.09f, kNoData, 0.0f};
  const S44Shares shares = CompareWithS44(elevation, mismatch);
  EXPECT_EQ(shares.cells, 2u);
  EXPECT_EQ(shares.within, (std::array<std::uint64_t, 4>{1, 2, 2, 2}));
  EXPECT_NEAR(kS44Orders[3].TvuM(100.0), std::hypot(1.0, 2.3), 1e-12);
}

}  // namespace
}  // namespace seastitch
