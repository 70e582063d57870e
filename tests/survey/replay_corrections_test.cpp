#include "tests/support/files.hpp"
#include "tests/survey/replay_fixture.hpp"

namespace seastitch {
namespace {

// Over a flat seabed nothing but fixes can correct the drift.
class ReplayWithFixes : public Replay {
 protected:
  struct PositionRms {
    double before_m;
    double after_m;
  };
  PositionRms After(const std::string& position_fixes) {
    std::ofstream(dir_.path() / "survey.yaml")
        << "seed: 3\n"
           "terrain: {depth_m: 22.0, relief: {rms_m: 0.01, longest_m: 60.0, shortest_m: 2.0}}\n"
           "plan: {lines: 4, line_length_m: 120.0, spacing_m: 25.0, crosslines: 1}\n"
           "errors: {class: mems}\n"
           "mbes: {beams: 32, ping_rate_hz: 3.0}\n"
           "position_fixes: " +
               position_fixes + "\n";
    const fs::path log = dir_.path() / "survey.lcmlog";
    const CommandResult made = RunCommand(Seastitch(
        "bench --survey " + (dir_.path() / "survey.yaml").string() + " --log " + log.string()));
    EXPECT_EQ(made.exit_code, 0) << made.output;
    // Of sensors that are better than the simulated ones: dead reckoning drifts.
    const fs::path config = dir_.path() / "config";
    fs::remove_all(config);
    fs::copy(SourceDir() / "config", config);
    std::ofstream(config / "mapper_stated.yaml")
        << "vehicle: vehicle.yaml\nnavigation: {start_at_first_fix: false}\n";
    const CommandResult result =
        ReplayOf(log, "--config " + (config / "mapper_stated.yaml").string());
    EXPECT_EQ(result.exit_code, 0) << result.output;
    const auto rms = nlohmann::json::parse(TextOf(Out("report.json"))).at("position_rms_m");
    return {rms.at("before"), rms.at("after")};
  }
};

TEST_F(ReplayWithFixes, RightOnesBoundTheDriftAndWrongOnesAmongThemDoNotMatter) {
  const PositionRms right = After("{interval_s: 20.0, sigma_m: 1.0}");
  EXPECT_GT(right.before_m, 4.0);
  EXPECT_LT(right.after_m, 1.0);
  const PositionRms mixed =
      After("{interval_s: 20.0, sigma_m: 1.0, wrong_rate: 0.3, wrong_m: 15.0}");
  EXPECT_LT(mixed.after_m, 1.25 * right.after_m);
}

TEST_F(ReplayWithFixes, NothingButWrongOnesDoNoHarm) {
  const PositionRms wrong =
      After("{interval_s: 200.0, sigma_m: 1.0, wrong_rate: 1.0, wrong_m: 60.0}");
  EXPECT_LE(wrong.after_m, 1.02 * wrong.before_m);
}

TEST_F(Replay, OfASurveyWithoutOverlapSaysThatNavigationAloneCorrectsTheMap) {
  const fs::path log = dir_.path() / "single.lcmlog";
  const CommandResult made =
      RunCommand(Seastitch("bench --survey " + ConfigFile("bench/single_line.yaml") + " --log ") +
                 log.string());
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const CommandResult result = ReplayOf(log);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("corrected by what navigation learnt later"), std::string::npos)
      << result.output;
  EXPECT_TRUE(fs::exists(Out("elevation.tif")));
}

// The sonar stands half a metre further back, and 0.3 m further to port, than vehicle.yaml says.
TEST_F(Replay, FindsASonarThatStandsElsewhereThanItWasTold) {
  const auto report_of = [&](const std::string& sonar_mounting_m) {
    const fs::path config = dir_.path() / ("config" + sonar_mounting_m);
    fs::copy(SourceDir() / "config", config, fs::copy_options::recursive);
    std::string vehicle = TextOf(config / "vehicle.yaml");
    const std::string told = "position_m: [0.45, 0, 0.2]";
    const std::size_t at = vehicle.find(told);
    EXPECT_NE(at, std::string::npos);
    vehicle.replace(at, told.size(), "position_m: [0.95, 0.30, 0.20]");
    std::ofstream(config / "vehicle.yaml") << vehicle;
    std::ofstream(config / "mapper_mems.yaml", std::ios::app)
        << "\n  start_at_first_fix: false\nsonar_mounting_sigma_m: " << sonar_mounting_m << "\n";
    const CommandResult result = ReplayOf(ShortLog(),
                                          "--config " + (config / "mapper_mems.yaml").string() +
                                              " --truth " + ShortLog().string() + ".truth.csv");
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return nlohmann::json::parse(TextOf(Out("report.json")));
  };
  const nlohmann::json blind = report_of("0.0");
  EXPECT_FALSE(blind["mounting"].contains("sonar_forward_m"));
  const nlohmann::json found = report_of("0.5");
  EXPECT_NEAR(found["mounting"]["sonar_forward_m"]["value"].get<double>(), -0.5, 0.15);
  EXPECT_NEAR(found["mounting"]["sonar_starboard_m"]["value"].get<double>(), -0.3, 0.15);
  const auto shape = [](const nlohmann::json& report) {
    return report["truth"]["aligned_position_rms_m"]["after"].get<double>();
  };
  EXPECT_LT(shape(found), 0.5 * shape(blind));
  EXPECT_LT(found["surface_rms_m"]["after"].get<double>(),
            blind["surface_rms_m"]["after"].get<double>());
}

// The paper's toy survey, as README.md of the data says.
class ToySurvey : public Replay {
 protected:
  void SetUp() override {
    if (!fs::exists(Shared("data/submaps/map_small"))) {
      GTEST_SKIP() << "needs ../shared/data/submaps, which is not here";
    }
  }
  // xy RMS [m] of poses.txt against the published frames.
  double XyRms() const {
    std::map<int, std::pair<double, double>> truth;
    double sum = 0.0;
    int n = 0;
    const auto read = [](const fs::path& path, auto&& use) {
      std::ifstream in(path);
      for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        int id = 0;
        double x = 0.0;
        double y = 0.0;
        if (line.rfind('#', 0) != 0 && words >> id >> x >> y) use(id, x, y);
      }
    };
    read(Shared("data/submaps/map_small_truth.txt"), [&](int id, double x, double y) {
      truth[id] = {x, y};
    });
    read(Out("poses.txt"), [&](int id, double x, double y) {
      sum += std::pow(x - truth.at(id).first, 2) + std::pow(y - truth.at(id).second, 2);
      ++n;
    });
    EXPECT_EQ(n, static_cast<int>(truth.size()));
    return std::sqrt(sum / n);
  }
};

TEST_F(ToySurvey, AsPublishedIsLeftWithinItsOwnError) {
  const CommandResult result = ReplayOf(Shared("data/submaps/map_small"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  // The published frames of the second leg fit the first only after 0.25 m: no better can be asked.
  EXPECT_LT(XyRms(), 0.5);
}

TEST_F(ToySurvey, CorruptedComesCloserThanTheReferenceEverDid) {
  double sum = 0.0;
  for (int seed = 1; seed <= 5; ++seed) {
    const fs::path corrupted = dir_.path() / ("seed" + std::to_string(seed));
    const CommandResult made = RunCommand(
        "python3 " + Shared("tools/set_submap_frames.py").string() + " " +
        Shared("data/submaps/map_small").string() + " " +
        Shared("data/submaps/map_small_seeds/seed" + std::to_string(seed) + ".txt").string() + " " +
        corrupted.string());
    ASSERT_EQ(made.exit_code, 0) << made.output;
    const CommandResult result = ReplayOf(corrupted);
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const double rms = XyRms();
    std::printf("seed %d: xy RMS %.3f m\n", seed, rms);
    sum += rms;
  }
  // The reference's best configuration, tuned on these very seeds: 1.02 m.
  EXPECT_LT(sum / 5.0, 1.02);
}

}  // namespace
}  // namespace seastitch
