#include "tests/products/product_fixtures.hpp"

namespace seastitch {
namespace {

std::string ErrorOf(const Survey& survey, const ProductOptions& options, const fs::path& dir) {
  try {
    WriteProducts(survey, options, dir);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "no error";
}

TEST(WriteProducts, WithholdsACorrectionThatMakesTheMapWorse) {
  const TemporaryDir folder;
  std::vector<Pose2> wrong =
      DeadReckonedPoses(Collect(Drifting(), folder.path(), {}, {})).T_map_level;
  for (std::size_t i = 3; i < 6; ++i) wrong[i].x += 4.0;
  const Survey survey = Collect(Drifting(), folder.path(), SolutionAt(wrong), {LoopEdge(0, 5)});
  const ProductSummary summary = WriteProducts(survey, {}, folder.path());
  EXPECT_EQ(summary.outcome, Outcome::kWithheld);
  EXPECT_GT(summary.solved.surface.rms_m, summary.before.surface.rms_m);
  EXPECT_EQ(summary.after().point.rms_m, summary.before.point.rms_m);
  EXPECT_EQ(TextOf(folder / "elevation.tif"), TextOf(folder / "elevation_as_navigated.tif"));
  // Not twice the same picture.
  EXPECT_THAT(TextOf(folder / "report.html"), Not(HasSubstr("depth_as_navigated.png\"><img")));
  EXPECT_EQ(TextOf(folder / "mismatch.tif"), TextOf(folder / "mismatch_as_navigated.tif"));
  const auto poses = PosesIn(folder / "poses.txt");
  EXPECT_EQ(poses.at(4), DeadReckonedPoses(survey).T_map_level[4].Translation());
  EXPECT_EQ(Json(folder / "report.json")["outcome"], "withheld");
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("The correction was withheld"));
}

TEST(Judge, IsNotRuledByTheFewCellsWithAWrongSounding) {
  const auto outcome = [](const ErrorFigures& before, const ErrorFigures& solved) {
    ProductSummary summary;
    summary.correction_max_m = 1.0;
    summary.before = {before, before};
    summary.solved = {solved, solved};
    Judge({}, 0.05, &summary);
    return summary.outcome;
  };
  const ErrorFigures before{0.203, 0.034, 0.134, 10'000};
  EXPECT_EQ(outcome(before, {0.216, 0.028, 0.100, 10'000}), Outcome::kCorrected);
  EXPECT_EQ(outcome(before, {0.190, 0.034, 0.150, 10'000}), Outcome::kCorrected);
  EXPECT_EQ(outcome(before, {0.216, 0.034, 0.150, 10'000}), Outcome::kWithheld);
  // Three submaps of a hundred, thrown off.
  EXPECT_EQ(outcome(before, {1.015, 0.034, 0.134, 10'000}), Outcome::kWithheld);
}

TEST(WriteProducts, WithholdsACorrectionThatTearsTheSwathsApart) {
  const TemporaryDir folder;
  std::vector<Pose2> torn = Drifting().truth;
  for (std::size_t i = 0; i < torn.size(); ++i) torn[i].y += 60.0 * static_cast<double>(i);
  const Survey survey = Collect(Drifting(), folder.path(), SolutionAt(torn), {LoopEdge(0, 5)});
  EXPECT_EQ(WriteProducts(survey, {}, folder.path()).outcome, Outcome::kWithheld);
}

TEST(WriteProducts, WithholdsASolutionTooWildToGrid) {
  const TemporaryDir folder;
  std::vector<Pose2> wild = Drifting().truth;
  wild.back().x = 1e12;
  const Survey survey = Collect(Drifting(), folder.path(), SolutionAt(wild), {LoopEdge(0, 5)});
  const ProductSummary summary = WriteProducts(survey, {}, folder.path());
  EXPECT_EQ(summary.outcome, Outcome::kWithheld);
  EXPECT_EQ(summary.cell_m, 1.0);
  EXPECT_THAT(summary.statement, HasSubstr("scattered"));
}

TEST(WriteProducts, SaysPlainlyThatNothingOverlaps) {
  const TemporaryDir folder;
  const DriftingSurvey line = MakeDriftingSurvey(1, 3, 0.0);
  const Survey survey =
      Collect(line,
              folder.path(),
              SolutionAt(DeadReckonedPoses(Collect(line, folder.path(), {}, {})).T_map_level),
              {});
  const ProductSummary summary = WriteProducts(survey, {}, folder.path());
  EXPECT_EQ(summary.outcome, Outcome::kNothingToCorrect);
  EXPECT_THAT(summary.statement, HasSubstr("no two passes of this survey overlap"));
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("Nothing could be corrected"));
}

TEST(WriteProducts, SaysPlainlyThatNoRegistrationWasTrusted) {
  const TemporaryDir folder;
  const Survey survey =
      Collect(Drifting(), folder.path(), PoseGraph{}, {LoopEdge(0, 5, LoopVerdict::kDegenerate)});
  const ProductSummary summary = WriteProducts(survey, {}, folder.path());
  EXPECT_EQ(summary.outcome, Outcome::kNothingToCorrect);
  EXPECT_THAT(summary.statement, HasSubstr("none became a loop closure"));
}

TEST(WriteProducts, MapsASingleSubmap) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 1), folder.path(), {}, {});
  const ProductSummary summary = WriteProducts(survey, OptionsWithDatum(), folder.path());
  EXPECT_EQ(summary.before_all.point.cells, 0u);
  EXPECT_TRUE(Json(folder / "report.json")["consistency_rms_m"]["before"].is_null());
  for (const std::string& name : kFiles) EXPECT_TRUE(fs::exists(folder / name)) << name;
}

TEST(WriteProducts, OfNothingIsOneClearLine) {
  const TemporaryDir folder;
  EXPECT_EQ(ErrorOf({}, {}, folder.path()), "no submap: there is nothing to map");
  SurveyCollector collector(folder.path());
  Submap empty;
  empty.id.value = 0;
  collector.Add(empty);
  EXPECT_EQ(ErrorOf(collector.Finish(), {}, folder.path()),
            "no submap has a point: there is nothing to map");
  EXPECT_FALSE(fs::exists(folder / "elevation.tif"));
}

TEST(WriteProducts, RefusesUnusableOptions) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 1), folder.path(), {}, {});
  ProductOptions options;
  options.cell_m = -1.0;
  EXPECT_THAT(ErrorOf(survey, options, folder.path()), HasSubstr("cell_m = -1"));
  options.cell_m = 0.001;
  EXPECT_THAT(ErrorOf(survey, options, folder.path()), HasSubstr("cell_m = 0.001: the map would"));
  options = OptionsWithDatum();
  options.axes = MapAxes::kEastNorthUp;
  EXPECT_THAT(ErrorOf(survey, options, folder.path()), HasSubstr("a datum needs"));
  EXPECT_THAT(ErrorOf(survey, {}, "/proc/none"), HasSubstr("/proc/none"));
}

TEST(WriteProducts, MakesADefaultCellLargerThanTheLimitAllows) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 3), folder.path(), {}, {});
  ProductOptions options;
  options.max_cells = 400;
  EXPECT_EQ(WriteProducts(survey, options, folder.path()).cell_m, 5.0);
}

TEST(WriteProducts, OfAZUpSurveyHasElevationsPositiveUpAndNorthUp) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  Submap submap;
  submap.id.value = 0;
  submap.T_map_submap.translation() = Eigen::Vector3d(100.0, 200.0, -30.0);
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 20; ++j) {
      submap.cloud.Add(Eigen::Vector3f(0.5f * static_cast<float>(i),
                                       0.5f * static_cast<float>(j),
                                       -5.0f - 0.1f * static_cast<float>(j)));
    }
  }
  collector.Add(submap);
  ProductOptions options;
  options.axes = MapAxes::kEastNorthUp;
  options.cell_m = 1.0;
  WriteProducts(collector.Finish(), options, folder.path());
  GDALAllRegister();
  GDALDataset* tif =
      static_cast<GDALDataset*>(GDALOpen((folder / "elevation.tif").c_str(), GA_ReadOnly));
  ASSERT_NE(tif, nullptr);
  EXPECT_GT(tif->GetRasterXSize(), tif->GetRasterYSize());  // longer in x, which is east
  float north_edge = 0, south_edge = 0;
  ASSERT_EQ(tif->GetRasterBand(1)->RasterIO(
                GF_Read, 5, 1, 1, 1, &north_edge, 1, 1, GDT_Float32, 0, 0, nullptr),
            CE_None);
  ASSERT_EQ(tif->GetRasterBand(1)->RasterIO(GF_Read,
                                            5,
                                            tif->GetRasterYSize() - 2,
                                            1,
                                            1,
                                            &south_edge,
                                            1,
                                            1,
                                            GDT_Float32,
                                            0,
                                            0,
                                            nullptr),
            CE_None);
  EXPECT_LT(south_edge, -34.9f);
  EXPECT_LT(north_edge, south_edge);  // deeper towards larger y
  GDALClose(tif);
}

TEST(WriteProducts, RemovesSubmapsOfALongerRunBefore) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 2), folder.path(), {}, {});
  WriteAtomically(folder / "submaps/submap_77.pcd", "old");
  WriteAtomically(folder / "submaps/notes.txt", "mine");
  WriteProducts(survey, {}, folder.path());
  EXPECT_FALSE(fs::exists(folder / "submaps/submap_77.pcd"));
  EXPECT_TRUE(fs::exists(folder / "submaps/notes.txt"));
  EXPECT_TRUE(fs::exists(folder / "submaps/submap_1.pcd"));
}

TEST(WriteProducts, NamesASubmapFileThatIsGone) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 2), folder.path(), {}, {});
  fs::remove(folder / "submaps/submap_1.pcd");
  EXPECT_THAT(ErrorOf(survey, {}, folder.path()), HasSubstr("submap_1.pcd"));
}

TEST(WriteProducts, KeepsPicturesSmallOfASurveyOfAnyShape) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  for (int id = 0; id < 4; ++id) {
    const Pose2 at{0.0, 700.0 * id, 0.5 * kPi};
    collector.Add(testing::SeenFrom(id, at, at, testing::Hills, 700, 10, 2.0, 0.02));
  }
  ProductOptions options;
  options.cell_m = 1.0;
  WriteProducts(collector.Finish(), options, folder.path());
  GDALAllRegister();
  GDALDataset* png =
      static_cast<GDALDataset*>(GDALOpen((folder / "depth.png").c_str(), GA_ReadOnly));
  ASSERT_NE(png, nullptr);
  EXPECT_LE(png->GetRasterXSize(), 1600);
  EXPECT_LE(png->GetRasterYSize(), 1600);
  EXPECT_GE(png->GetRasterYSize(), 400);
  GDALClose(png);
}

}  // namespace
}  // namespace seastitch
