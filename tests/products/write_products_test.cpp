#include "tests/products/product_fixtures.hpp"

namespace seastitch {
namespace {

TEST(WriteProducts, CorrectsTheMapAndSaysByHowMuch) {
  const TemporaryDir folder;
  const std::vector<GraphEdge> edges = {
      LoopEdge(0, 5), LoopEdge(1, 4), LoopEdge(2, 3, LoopVerdict::kAmbiguous)};
  PoseGraph solution = SolutionAt(Drifting().truth);
  for (const GraphEdge& e : edges) solution.loop_edges.push_back({e.from, e.to, 1.0});
  const Survey survey = Collect(Drifting(), folder.path(), solution, edges);
  ProductOptions options = OptionsWithDatum();
  for (const NavState& s : Drifting().true_track) {
    options.truth.push_back({s.time, LevelPose(s.T_map_vehicle)});
  }
  options.run_figures = [] { return RunFigures{10.0, 12.0, 100.0, 27.0}; };
  const ProductSummary summary = WriteProducts(survey, options, folder.path());

  EXPECT_EQ(summary.outcome, Outcome::kCorrected) << summary.statement;
  EXPECT_LT(summary.after().point.rms_m, 0.95 * summary.before.point.rms_m);
  EXPECT_LT(summary.after().surface.rms_m, 0.5 * summary.before.surface.rms_m);
  EXPECT_EQ(summary.cell_m, 1.0);
  for (const std::string& name : kFiles) EXPECT_GT(fs::file_size(folder / name), 0u) << name;
  for (const fs::directory_entry& e : fs::recursive_directory_iterator(folder.path())) {
    EXPECT_THAT(e.path().string(), Not(HasSubstr("partial")));
  }
  const auto poses = PosesIn(folder / "poses.txt");
  ASSERT_EQ(poses.size(), 9u);
  EXPECT_NEAR((poses.at(8) - Drifting().truth[8].Translation()).norm(), 0.0, 1e-12);

  const nlohmann::json report = Json(folder / "report.json");
  EXPECT_LT(report["consistency_rms_m"]["after"], report["consistency_rms_m"]["before"]);
  EXPECT_EQ(report["submaps"], 9);
  EXPECT_EQ(report["loop_closures"]["accepted"], 2);
  EXPECT_EQ(report["loop_closures"]["rejected"], 1);
  EXPECT_EQ(report["loop_closures"]["verdicts"]["ambiguous"], 1);
  EXPECT_EQ(report["soundings"]["used"].get<std::uint64_t>(),
            report["soundings"]["read"].get<std::uint64_t>() - 9 * 7);
  EXPECT_GT(report["position_rms_m"]["before"], 0.5);
  EXPECT_LT(report["position_rms_m"]["after"], 0.1);
  EXPECT_LT(report["surface_rms_m"]["after"], report["surface_rms_m"]["before"]);
  EXPECT_GT(report["position_max_m"]["before"], report["position_rms_m"]["before"]);
  EXPECT_LT(report["yaw_rms_deg"]["after"], report["yaw_rms_deg"]["before"]);
  for (const char* key : {"wall_s", "cpu_s", "peak_rss_mb", "realtime_factor"}) {
    EXPECT_EQ(report[key], report["run"][key]);
    EXPECT_THAT(report["not_reproducible"].dump(), HasSubstr(key));
  }
  EXPECT_EQ(report["truth"]["loop_closures"]["accepted"], 2);
  EXPECT_EQ(report["truth"]["loop_closures"]["degrees_of_freedom"], 6);
  EXPECT_EQ(report["seeds"]["bench"], 42);
  const std::string html = TextOf(folder / "report.html");
  EXPECT_THAT(html, HasSubstr("A &lt;test&gt; survey"));
  EXPECT_THAT(html, HasSubstr("The map is corrected by 2 loop closures"));
  EXPECT_THAT(html, HasSubstr("depth_as_navigated.png\"><img"));
  EXPECT_THAT(html,
              HasSubstr("2023-11-14 22:13 to 2023-11-14 22:17 UTC &middot; 5&#8239;437 m&sup2; "
                        "&middot; depths 38.8 to 43.4 m &middot; cell 1.00 m &middot; EPSG:32632"));
  EXPECT_THAT(html, HasSubstr("tile good\"><b>corrected</b>"));
  EXPECT_THAT(html, HasSubstr("<b>2 of 3</b>"));
  EXPECT_THAT(html, HasSubstr("of the 2 accepted closures"));
}

TEST(WriteProducts, NamesThePositionFixesThatCorrected) {
  GraphEdge fix;
  fix.kind = EdgeKind::kPositionFix;
  fix.from = fix.to = SubmapId{8};
  fix.T_from_to = Drifting().truth[8];
  fix.information.topLeftCorner<2, 2>().setIdentity();
  const auto statement = [&](const std::vector<GraphEdge>& edges) {
    const TemporaryDir folder;
    const Survey survey = Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), edges);
    return WriteProducts(survey, {}, folder.path()).statement;
  };
  EXPECT_THAT(statement({fix}), HasSubstr("corrected by up to 1 position fix:"));
  EXPECT_THAT(statement({LoopEdge(0, 5), fix}),
              HasSubstr("corrected by 1 loop closure and up to 1 position fix:"));
}

TEST(WriteProducts, RewritesSubmapsWithTheirCorrectedFrames) {
  const TemporaryDir folder;
  const Survey survey =
      Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)});
  WriteProducts(survey, {}, folder.path());
  const SubmapPcd pcd = ReadSubmapPcd(folder / "submaps/submap_8.pcd");
  const Pose2& truth = Drifting().truth[8];
  EXPECT_NEAR(pcd.T_map_submap.translation().x(), truth.x, 1e-4);
  EXPECT_NEAR(pcd.T_map_submap.translation().z(),
              Drifting().submaps[8].T_map_submap.translation().z(),
              1e-4);
  EXPECT_NEAR(WrapAngle(LevelPose(pcd.T_map_submap).yaw - truth.yaw), 0.0, 1e-5);
  EXPECT_EQ(pcd.cloud.points, Drifting().submaps[8].cloud.points);
}

TEST(WriteProducts, WithoutRoomOnTheDiskGivesOneLineAndKeepsTheOldFile) {
  const TemporaryDir folder;
  WriteAtomically(folder / "elevation.tif", "the old map");
  struct rlimit old {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto old_handler = ::signal(SIGXFSZ, SIG_IGN);
  const struct rlimit small { 1000, old.rlim_max };
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string error = "no error";
  try {
    WriteAtomically(folder / "elevation.tif", std::string(5000, 'x'));
  } catch (const std::runtime_error& e) {
    error = e.what();
  }
  ::setrlimit(RLIMIT_FSIZE, &old);
  ::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(error, HasSubstr("elevation.tif: cannot be written: "));
  EXPECT_EQ(TextOf(folder / "elevation.tif"), "the old map");
  EXPECT_FALSE(fs::exists(folder / "elevation.tif.partial"));
}

TEST(WriteProducts, GivesTheSameBytesTwice) {
  const TemporaryDir a, b;
  for (const TemporaryDir* folder : {&a, &b}) {
    const Survey survey =
        Collect(Drifting(), folder->path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)});
    WriteProducts(survey, OptionsWithDatum(), folder->path());
  }
  for (const std::string& name : kFiles) EXPECT_EQ(TextOf(a / name), TextOf(b / name)) << name;
  EXPECT_EQ(TextOf(a / "submaps/submap_3.pcd"), TextOf(b / "submaps/submap_3.pcd"));
}

TEST(WriteProducts, SaysPlainlyThatTheGraphBelievesNoClosure) {
  const TemporaryDir folder;
  const DriftingSurvey& drifting = Drifting();
  PoseGraph solution =
      SolutionAt(DeadReckonedPoses(Collect(drifting, folder.path(), {}, {})).T_map_level);
  solution.loop_edges = {{SubmapId{0}, SubmapId{5}, 0.0}};
  solution.mounting[0].covariance.setIdentity();
  const Survey survey = Collect(drifting, folder.path(), solution, {LoopEdge(0, 5)});
  const ProductSummary summary = WriteProducts(survey, {}, folder.path());
  EXPECT_EQ(summary.outcome, Outcome::kNothingToCorrect);
  EXPECT_THAT(summary.statement, HasSubstr("the graph accepts none"));
  const nlohmann::json report = Json(folder / "report.json");
  EXPECT_EQ(report["loop_closures"]["refused_by_graph"], 1);
  EXPECT_TRUE(report["mounting"].empty());  // nothing was learned of it
}

TEST(WriteProducts, SaysWhatTheGraphFoundOfTheMounting) {
  const TemporaryDir folder;
  PoseGraph solution = SolutionAt(Drifting().truth);
  solution.mounting[0].sonar_m = {-0.25, 0.125};
  solution.mounting[0].dvl_yaw_rad = Deg2Rad(0.5);
  solution.mounting[0].covariance = Eigen::Vector3d(0.01, 0.04, 1e-6).asDiagonal();
  WriteProducts(Collect(Drifting(), folder.path(), solution, {LoopEdge(0, 5)}), {}, folder.path());
  const nlohmann::json mounting = Json(folder / "report.json")["mounting"];
  EXPECT_DOUBLE_EQ(mounting["sonar_forward_m"]["value"], -0.25);
  EXPECT_DOUBLE_EQ(mounting["sonar_forward_m"]["sigma"], 0.1);
  EXPECT_DOUBLE_EQ(mounting["sonar_starboard_m"]["value"], 0.125);
  EXPECT_DOUBLE_EQ(mounting["dvl_yaw_deg"]["value"], 0.5);
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("-0.250 m"));

  WriteProducts(Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)}),
                {},
                folder.path());
  EXPECT_TRUE(Json(folder / "report.json")["mounting"].empty());
  EXPECT_THAT(TextOf(folder / "report.html"), Not(HasSubstr("Mounting")));
}

TEST(WriteProducts, SaysWhatTheGraphFoundOfTheMountingOfEachDive) {
  const TemporaryDir folder;
  PoseGraph solution = SolutionAt(Drifting().truth);
  for (const int chain : {0, 1, 2}) {
    solution.mounting[chain].sonar_m = {-0.25 + chain, 0.0};
    solution.mounting[chain].covariance = Eigen::Vector3d(0.01, 0.04, 0.0).asDiagonal();
  }
  Survey survey = Collect(Drifting(), folder.path(), solution, {LoopEdge(0, 5)});
  survey.dives = {"north", "south", "far"};
  for (std::size_t i = 0; i < survey.submaps.size(); ++i)
    survey.submaps[i].chain = i < 4 ? 0 : i < 8 ? 1 : 2;
  WriteProducts(survey, {}, folder.path());
  const nlohmann::json report = Json(folder / "report.json");
  EXPECT_FALSE(report.contains("mounting"));
  EXPECT_DOUBLE_EQ(report["dives"][0]["mounting"]["sonar_forward_m"]["value"], -0.25);
  EXPECT_DOUBLE_EQ(report["dives"][1]["mounting"]["sonar_forward_m"]["value"], 0.75);
  EXPECT_TRUE(report["dives"][2]["mounting"].empty()) << "no closure";
  const std::string html = TextOf(folder / "report.html");
  EXPECT_THAT(html, HasSubstr("north, against its vehicle.yaml"));
  EXPECT_THAT(html, HasSubstr("0.750 m"));
  EXPECT_THAT(html, Not(HasSubstr("far, against its vehicle.yaml")));
}

TEST(WriteProducts, SaysWhatTheSurveyShowsOfItsNoiseBesideWhatIsConfigured) {
  const TemporaryDir folder;
  const Survey survey =
      Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)});
  ProductOptions options;
  options.noise.components = {
      {1.0, 2.56, 0.1}, {0.0003, 0.0024, 0.2}, {0.002, 0.0021, 0.1}, {2e-4, 2e-4, 0.1}, 12};
  options.noise.timing.configured_s = 0.010;
  options.noise.timing.roll = {0.012, 0.001, 900, 2e-4, 1e-4};
  const ProductSummary summary = WriteProducts(survey, options, folder.path());
  EXPECT_THAT(summary.noise_findings,
              ElementsAre("Soundings are 1.6 x noisier than stated.",
                          "Neighbouring soundings share an error of 0.24 % of the altitude where "
                          "0.03 % is configured: sound speed or roll.",
                          "The sonar's stamps are 12.0 ms too early for the roll (1 sigma 1.0 ms): "
                          "set sonar_time_offset_s to 0.022."));
  const nlohmann::json noise = Json(folder / "report.json")["noise"];
  EXPECT_EQ(noise["closures"], 12);
  EXPECT_DOUBLE_EQ(noise["sounding_noise_ratio"]["value"], 1.6);
  EXPECT_DOUBLE_EQ(noise["sounding_noise_ratio"]["sigma"], 0.08);
  EXPECT_DOUBLE_EQ(noise["shared_error_percent_of_altitude"]["configured"], 0.03);
  EXPECT_DOUBLE_EQ(noise["sonar_time_offset"]["by_roll"]["add_s"], 0.012);
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("1.6 x noisier"));

  // What a sensor's clock does to the pings is no latency of the sonar.
  options.warnings = {{WarningCode::kSensorClock, "attitude 1.7 s ahead"}};
  EXPECT_EQ(WriteProducts(survey, options, folder.path()).noise_findings.size(), 2u);

  // Where nothing is known, nothing is said.
  EXPECT_THAT(WriteProducts(survey, {}, folder.path()).noise_findings, ElementsAre());
  EXPECT_EQ(Json(folder / "report.json")["noise"]["closures"], 0);
  EXPECT_FALSE(Json(folder / "report.json")["noise"].contains("sounding_noise_ratio"));
}

std::vector<std::string> FindingsOf(const NoiseEstimate& components,
                                    const SonarTimingEstimate& timing = {}) {
  return NoiseFindings({components, timing});
}

TEST(NoiseReport, HasASentenceForEachComponentThatDiffers) {
  const ComponentEstimate same{1.0, 1.1, 0.1};
  const ComponentEstimate smaller_walk{0.002, 0.0005, 0.1};
  EXPECT_THAT(FindingsOf({{1.0, 0.25, 0.1}, {0.0003, 0.0001, 0.2}, smaller_walk, smaller_walk, 9}),
              ElementsAre("Soundings have 0.5 times the noise that is stated.",
                          "Neighbouring soundings share an error of 0.01 % of the altitude where "
                          "0.03 % is configured."))
      << "a walk that is smaller than expected needs no attention";
  EXPECT_THAT(
      FindingsOf({same, same, {0.002, 0.008, 0.2}, {2e-4, 6e-4, 0.2}, 9}),
      ElementsAre("Inside a submap the position drifts by 0.04 m over 25 m where 0.01 m is "
                  "expected: the Doppler log is noisier, or was not used.",
                  "Inside a submap the heading drifts by 0.17 deg over 25 m where 0.057 deg "
                  "is expected: gyro or heading is noisier."));
  // Three times as much, but within 2 sigma; and by less than a quarter, however certain.
  EXPECT_THAT(FindingsOf({{1.0, 1.5, 0.01}, {0.0003, 0.0009, 0.6}, same, same, 9}), ElementsAre());
  EXPECT_THAT(FindingsOf({{1.0, 9.0, 0.01}, same, same, same, 0}), ElementsAre()) << "no closure";
}

TEST(NoiseReport, StatesABoundWhereAnEstimateIsAnEndOfItsRange) {
  const ComponentEstimate same{1.0, 1.0, 0.1};
  const NoiseEstimate noise{same,
                            {0.0003, 0.0096, 1.0, RangeEnd::kHigh},
                            {0.002, 0.016, 1.0, RangeEnd::kHigh},
                            {2e-4, 1.6e-3, 1.0, RangeEnd::kHigh},
                            9};
  EXPECT_THAT(FindingsOf(noise),
              ElementsAre(HasSubstr("share an error of at least 0.96 % of the altitude where"),
                          HasSubstr("the position drifts by at least 0.08 m over 25 m where"),
                          HasSubstr("the heading drifts by at least 0.46 deg over 25 m where")));
  EXPECT_THAT(FindingsOf({same, {0.0003, 2.3e-6, 1.0, RangeEnd::kLow}, same, same, 9}),
              ElementsAre(HasSubstr("share an error of at most 0.00023 % of the altitude")));
  const TemporaryDir folder;
  ProductOptions options;
  options.noise.components = noise;
  WriteProducts(Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)}),
                options,
                folder.path());
  const nlohmann::json json = Json(folder / "report.json")["noise"];
  EXPECT_EQ(json["position_walk_m_per_sqrt_m"]["bound"], "at least");
  EXPECT_TRUE(json["sounding_noise_ratio"]["bound"].is_null());
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("at least 0.01600"));
}

TEST(NoiseReport, StatesATimeOffsetOfEitherSign) {
  SonarTimingEstimate timing;
  timing.configured_s = 0.010;
  timing.roll = {-0.012, 0.001, 900, 2e-4, 1e-4};
  EXPECT_THAT(
      FindingsOf({}, timing),
      ElementsAre("The sonar's stamps are 12.0 ms too late for the roll (1 sigma 1.0 ms): set "
                  "sonar_time_offset_s to -0.002."));
  timing.roll = {0.020, 0.002, 900, 0.1, 0.05};
  EXPECT_THAT(FindingsOf({}, timing),
              ElementsAre("The sonar's stamps are 20.0 ms too early for the roll (1 sigma 2.0 ms): "
                          "set sonar_time_offset_s to 0.030."));
  timing.placed_by_source = true;
  EXPECT_THAT(
      FindingsOf({}, timing),
      ElementsAre(HasSubstr("(1 sigma 2.0 ms): correct them in the program that computed the "
                            "soundings.")));
  timing.roll->add_s = 0.0019;  // too small to matter
  timing.roll->sigma_s = 1e-4;
  EXPECT_THAT(FindingsOf({}, timing), ElementsAre());
  timing.roll_scale = {-1.2, 0.1};
  EXPECT_THAT(FindingsOf({}, timing),
              ElementsAre("Slopes across the track change with the roll as if roll were 1.2 % too "
                          "large (1 sigma 0.1 %), or the sound speed at the sonar wrong by 6 m/s: "
                          "only overlapping lines tell which."));
  timing.roll_scale = {-1.2, 0.4};
  EXPECT_THAT(FindingsOf({}, timing), ElementsAre());
}

// A replay of recorded results, or with estimate_noise off, estimates nothing. That is not the same
// as an estimate that agrees with the configuration, and not the same as no closure.
TEST(WriteProducts, StatesWhyTheNoiseWasNotEstimated) {
  const TemporaryDir folder;
  const Survey survey =
      Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {LoopEdge(0, 5)});
  const auto page = [&] { return TextOf(folder / "report.html"); };
  ProductOptions options;
  options.noise_not_estimated = "estimate_noise is off";
  options.noise.timing.roll = {0.0, 0.001, 900, 2e-4, 2e-4};
  WriteProducts(survey, options, folder.path());
  const nlohmann::json noise = Json(folder / "report.json")["noise"];
  EXPECT_EQ(noise["not_estimated"], "estimate_noise is off");
  EXPECT_FALSE(noise.contains("closures"));
  EXPECT_FALSE(noise["sonar_time_offset"]["by_roll"].is_null());
  EXPECT_THAT(page(), HasSubstr("The noise was not estimated: estimate_noise is off."));
  EXPECT_THAT(page(), Not(HasSubstr("Nothing differs")));
  EXPECT_THAT(page(), Not(HasSubstr("no closure was")));
  EXPECT_THAT(page(), HasSubstr("Estimated from the height differences")) << "the time offset";

  WriteProducts(survey, {}, folder.path());
  EXPECT_THAT(page(), HasSubstr("no accepted closure has statistics of its overlap"));
  EXPECT_THAT(page(), Not(HasSubstr("Estimated from the height differences"))) << "no empty table";
  const Survey without = Collect(Drifting(), folder.path(), SolutionAt(Drifting().truth), {});
  WriteProducts(without, {}, folder.path());
  EXPECT_THAT(page(), HasSubstr("no closure was accepted"));
  options = {};
  options.noise.components.closures = 1;
  WriteProducts(survey, options, folder.path());
  EXPECT_THAT(page(), HasSubstr("Nothing differs clearly from the configuration."));
}

// Each dive has its own vehicle, and so its own clocks and navigation.
TEST(WriteProducts, ReportsNavigationAndTimeOffsetsOfEachDive) {
  const TemporaryDir folder;
  Survey survey = Collect(Drifting(), folder.path(), {}, {});
  DiveReport first;
  first.counters = {{"nav_dvl_gated", 7}, {"beams_read", 100}};
  first.conditions = {"the DVL is refused: 12 %"};
  first.sonar.configured_s = 0.010;
  first.sonar.roll = {0.012, 0.001, 900, 2e-4, 1e-4};
  first.stamp_offsets = {{"navigation.dvl_time_offset_s", 0.01, -0.2, 0.004, 350.0}};
  first.other_navigation = NavigationDifference{"given", 900, 90.0, 1.5, 3.25, -0.4};
  const auto expect_first = [](const nlohmann::json& navigation) {
    EXPECT_EQ(navigation["counters"]["nav_dvl_gated"], 7);
    EXPECT_FALSE(navigation["counters"].contains("beams_read"));
    EXPECT_EQ(navigation["conditions_at_end"][0], "the DVL is refused: 12 %");
    const nlohmann::json& offset = navigation["time_offsets"][0];
    EXPECT_EQ(offset["key"], "navigation.dvl_time_offset_s");
    EXPECT_DOUBLE_EQ(offset["configured_s"], 0.01);
    EXPECT_DOUBLE_EQ(offset["suggested_s"], -0.19);
    EXPECT_DOUBLE_EQ(offset["sigma_s"], 0.004);
    EXPECT_DOUBLE_EQ(offset["suspected_s"], 350.0);
    EXPECT_EQ(navigation["other_navigation"]["source"], "given");
    EXPECT_DOUBLE_EQ(navigation["other_navigation"]["max_m"], 3.25);
  };
  ProductOptions options;
  options.dives = {first};
  WriteProducts(survey, options, folder.path());
  expect_first(Json(folder / "report.json")["navigation"]);
  EXPECT_THAT(TextOf(folder / "report.html"), HasSubstr("10.0 ms, -190.0 ms, 4.0 ms"));

  survey.dives = {"north", "south"};
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) survey.submaps[i].chain = i < 4 ? 0 : 1;
  for (std::size_t i = 0; i < survey.track.size(); ++i)
    survey.track[i].chain = 2 * i < survey.track.size() ? 0 : 1;
  options.dives.emplace_back();
  options.conditions = {"the solution is withheld"};
  options.unread = {{"far", "it is empty"}};
  const ProductSummary summary = WriteProducts(survey, options, folder.path());
  const nlohmann::json report = Json(folder / "report.json");
  expect_first(report["dives"][0]["navigation"]);
  EXPECT_EQ(report["dives"][0]["mapper_counters"]["beams_read"], 100);
  EXPECT_DOUBLE_EQ(report["dives"][0]["sonar_time_offset"]["by_roll"]["add_s"], 0.012);
  EXPECT_TRUE(report["dives"][1]["sonar_time_offset"]["by_roll"].is_null());
  EXPECT_TRUE(report["dives"][1]["navigation"].contains("stated_at_end"));
  EXPECT_FALSE(report["noise"].contains("sonar_time_offset")) << "it is of each dive";
  EXPECT_EQ(report["navigation"]["conditions_at_end"][0], "the solution is withheld");
  EXPECT_EQ(report["dives_not_read"][0]["name"], "far");
  EXPECT_THAT(summary.noise_findings, ElementsAre(HasSubstr("north: The sonar's stamps are 12.0")));
  const std::string page = TextOf(folder / "report.html");
  EXPECT_THAT(page, HasSubstr("north: Navigation"));
  EXPECT_THAT(page, HasSubstr("south: Navigation"));
  EXPECT_THAT(page, HasSubstr("far was not read, or not to its end: it is empty"));
}

}  // namespace
}  // namespace seastitch
