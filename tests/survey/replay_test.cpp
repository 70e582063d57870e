// `seastitch` as a user types it: what it makes of good and of bad input.

#include "tests/support/files.hpp"
#include "tests/survey/replay_fixture.hpp"

namespace seastitch {
namespace {

// Largest speed [m/s] between the rows of a CSV with a head: of each the time [s] and the place
// [m].
double LargestSpeed(
    const fs::path& csv,
    const std::function<Eigen::Vector3d(const std::vector<std::string>&)>& time_and_place) {
  std::ifstream in(csv);
  std::string line;
  std::getline(in, line);
  double largest = 0.0;
  std::optional<Eigen::Vector3d> last;
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::istringstream columns(line);
    for (std::string field; std::getline(columns, field, ',');) fields.push_back(field);
    const Eigen::Vector3d now = time_and_place(fields);
    if (last && now.x() > last->x())
      largest = std::max(largest, (now - *last).tail<2>().norm() / (now.x() - last->x()));
    last = now;
  }
  return largest;
}

// The yaw of a sensor in vehicle.yaml is wrong by so many degrees: what the mapper says at the end.
TEST_F(Replay, ADopplerLogThatIsTurnedIsNamedAndNoOtherSensor) {
  struct Case {
    const char* sensor;
    const char* wrong_deg;
    bool is_named;
  };
  for (const auto& [sensor, wrong_deg, is_named] : {Case{"dvl", "10", true},
                                                    Case{"dvl", "-6", true},
                                                    Case{"dvl", "0.5", false},
                                                    Case{"mbes", "3", false}}) {
    const fs::path config = dir_ / (sensor + std::string(wrong_deg));
    fs::copy(ConfigFile(""), config, fs::copy_options::recursive);
    std::string vehicle = TextOf(config / "vehicle.yaml");
    const std::size_t section = vehicle.find(std::string("\n") + sensor + ":");
    const std::string angles = "roll_pitch_yaw_deg: [0, 0, ";
    vehicle.replace(vehicle.find(angles, section) + angles.size(), 1, wrong_deg);
    std::ofstream(config / "vehicle.yaml") << vehicle;
    ASSERT_EQ(ReplayOf(ShortLog(), "--config " + (config / "mapper_mems.yaml").string()).exit_code,
              0);
    const nlohmann::json report = nlohmann::json::parse(TextOf(Out("report.json")));
    const std::string said = report["navigation"]["conditions_at_end"].dump();
    EXPECT_EQ(said.find("the Doppler log is turned") != std::string::npos, is_named)
        << wrong_deg << " " << said;
    if (is_named) {
      ASSERT_EQ(report["advice"].size(), 1u) << report["advice"];
      EXPECT_EQ(report["advice"][0]["key"], "dvl.roll_pitch_yaw_deg");
      const std::string suggested = report["advice"][0]["suggested"];
      EXPECT_NEAR(std::stod(suggested.substr(suggested.rfind(' '))), 0.0, 1.5) << "the true yaw";
    }
    for (const char* other : {"accelerometer", "gyro", "attitude", "depth"})
      EXPECT_EQ(said.find(other), std::string::npos) << wrong_deg << " " << said;
    fs::remove_all(Out(""));
  }
}

// The corrected track is smooth: fixes and the ends of submaps are no steps in it.
TEST_F(Replay, TheExportedTrackMovesNoFasterThanTheVehicle) {
  ASSERT_EQ(ReplayOf(ShortLog()).exit_code, 0);
  const double exported_mps =
      LargestSpeed(Out("export/navigation.csv"), [](const std::vector<std::string>& row) {
        constexpr double kDegM = 111'200.0;
        constexpr double kLatitudeRad = Deg2Rad(43.07);  // of config/vehicle.yaml
        const std::string& iso = row[0];                 // 2026-01-01T00:00:00.000Z
        const double time_s = 3600.0 * std::stod(iso.substr(11, 2)) +
                              60.0 * std::stod(iso.substr(14, 2)) + std::stod(iso.substr(17));
        return Eigen::Vector3d(
            time_s, kDegM * std::stod(row[1]), kDegM * std::cos(kLatitudeRad) * std::stod(row[2]));
      });
  const double true_mps =
      LargestSpeed(ShortLog().string() + ".truth.csv", [](const std::vector<std::string>& row) {
        return Eigen::Vector3d(1e-6 * std::stod(row[0]), std::stod(row[1]), std::stod(row[2]));
      });
  EXPECT_GT(true_mps, 1.0);
  EXPECT_LT(exported_mps, true_mps + 0.15);
}

TEST_F(Replay, DiveNewClosesTheNewestDive) {
  const fs::path dives = dir_.path() / "dives";
  const DiveFolder dive({dives, 1800.0}, "logger", 1'000'000);
  const std::string config = dir_.Write("logger.yaml", "dives_dir: " + dives.string() + "\n");
  const CommandResult result = RunCommand(Seastitch("dive new --config " + config));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find(dive.path().string() + " is closed"), std::string::npos);
  EXPECT_TRUE(ReadDiveRecord(dive.path()).closed);
}

TEST_F(Replay, TakesADiveWithTheConfigurationRecordedInIt) {
  const fs::path dives = dir_.path() / "dives";
  const DiveFolder dive({dives, 1800.0}, "logger", 1'000'000);
  fs::copy_file(ShortLog(), dive.log() / "000.lcmlog");
  std::ofstream(dive.log() / "001.lcmlog");  // of a logger that was killed at its start
  const CommandResult result = ReplayOf(dive.path());
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("001.lcmlog: holds no LCM event: skipped"), std::string::npos);
  EXPECT_NE(TextOf(Out("config/mapper.yaml")).find("vehicle: vehicle.yaml"), std::string::npos);
  const CommandResult inside = RunCommand(Seastitch(
      "replay " + dive.path().string() + " --quiet --out " + (dive.path() / "map").string()));
  EXPECT_EQ(inside.exit_code, 64) << inside.output;
}

TEST_F(Replay, OfALogWithoutConfigurationAsksForOne) {
  const fs::path log = dir_.path() / "bare.lcmlog";
  EventLogReader all(ShortLog());
  EventLogWriter bare(log);
  while (const auto event = all.Next())
    if (event->channel != "CONFIG")
      bare.Write(event->utime, event->channel, event->data.data(), event->data.size());
  bare.Flush();
  const CommandResult result = ReplayOf(log);
  ExpectOneClearLine(result, "bare.lcmlog: holds no configuration (channel CONFIG): name the");
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_FALSE(fs::exists(dir_.path() / "out"));
  EXPECT_FALSE(fs::exists(dir_.path() / "out.partial"));
}

// Of the short log the events of every channel but these.
void CopyWithout(const fs::path& from, const fs::path& to, const std::set<std::string>& channels) {
  EventLogReader all(from);
  EventLogWriter some(to);
  while (const std::optional<LogEvent> event = all.Next())
    if (!channels.contains(event->channel))
      some.Write(event->utime, event->channel, event->data.data(), event->data.size());
  some.Flush();
}

TEST_F(Replay, OfNavigationAloneGivesItsTrackAndAReport) {
  const fs::path log = dir_.path() / "track.lcmlog";
  CopyWithout(ShortLog(), log, {"MBES_PING"});
  const CommandResult result = ReplayOf(log, "--truth " + ShortLog().string() + ".truth.csv");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("nothing was sounded"), std::string::npos) << result.output;
  const nlohmann::json report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["outcome"], "track_alone");
  EXPECT_GT(report["track"]["distance_m"], 50.0);
  EXPECT_LT(report["position_rms_m"]["before"], 5.0);
  EXPECT_GT(report["navigation"]["stated_at_end"]["sigma_north_m"], 0.1);
  EXPECT_TRUE(report["navigation"].contains("counters"));
  const std::string track = TextOf(Out("track.csv"));
  EXPECT_GT(std::count(track.begin(), track.end(), '\n'), 500);
  EXPECT_EQ(track.find(",,"), std::string::npos) << "a sigma is missing";
  EXPECT_NE(TextOf(Out("report.html")).find("Navigation"), std::string::npos);
  for (const char* file : {"survey.gpkg", "export/navigation.csv", "export/navigation.sbet"})
    EXPECT_TRUE(fs::exists(Out(file))) << file;
  for (const char* file : {"elevation.tif", "graph.g2o", "poses.txt"})
    EXPECT_FALSE(fs::exists(Out(file))) << file;
}

// Messages of an INS on the track that is in a track.csv: it drifts to the east by 1 cm/s, and its
// heading is 1 degree larger.
std::map<std::int64_t, navigation_t> InsAlong(const std::string& track_csv) {
  constexpr double kMetresPerRadianEast = 6'388'000.0 * 0.7305;  // at 43.07 N
  std::map<std::int64_t, navigation_t> messages;
  std::istringstream lines(track_csv);
  std::string line;
  std::getline(lines, line);  // names of the columns
  std::int64_t first = 0;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::vector<double> values;
    std::int64_t utime = 0;
    char comma = 0;
    cells >> utime;
    for (double value = 0.0; cells >> comma >> value;) values.push_back(value);
    if (values.size() != 15) {
      ADD_FAILURE() << line;
      break;
    }
    if (messages.empty()) first = utime;
    const double t_s = 1e-6 * static_cast<double>(utime - first);
    NavigationSample sample;
    sample.time = FromUtime(utime);
    sample.position = GeoPosition{
        Deg2Rad(values[13]), Deg2Rad(values[14]) + 0.01 * t_s / kMetresPerRadianEast, {0.0, 0.0}};
    sample.depth = InsVertical{values[2], 0.0};
    sample.attitude = Attitude{Eigen::Quaterniond(
        RotationFromRpy(Deg2Rad(values[3]), Deg2Rad(values[4]), Deg2Rad(values[5] + 1.0)))};
    const auto seq = static_cast<std::int64_t>(messages.size());
    messages[utime] = ToLcm(sample, {sample.time, seq});
  }
  return messages;
}

// A log of a vehicle whose inertial unit also computes poses.
TEST_F(Replay, ComparesBothNavigationsWhereTheLogHasTheInputOfBoth) {
  const fs::path track = dir_.path() / "track.lcmlog";
  CopyWithout(ShortLog(), track, {"MBES_PING"});
  ASSERT_EQ(ReplayOf(track).exit_code, 0);
  const auto navigation = [this] {
    return nlohmann::json::parse(TextOf(Out("report.json")))["navigation"];
  };
  EXPECT_FALSE(navigation().contains("other_navigation")) << "there is no INS";

  const std::map<std::int64_t, navigation_t> ins = InsAlong(TextOf(Out("track.csv")));
  ASSERT_GT(ins.size(), 1000u);
  const double duration_s = 1e-6 * static_cast<double>(ins.rbegin()->first - ins.begin()->first);
  const fs::path both = dir_.path() / "both.lcmlog";
  {
    EventLogReader all(track);
    EventLogWriter out(both);
    auto next = ins.begin();
    while (const std::optional<LogEvent> event = all.Next()) {
      for (; next != ins.end() && next->first <= event->utime; ++next)
        out.Write(event->utime, "INS", next->second);
      out.Write(event->utime, event->channel, event->data.data(), event->data.size());
    }
    out.Flush();
  }
  ASSERT_EQ(ReplayOf(both).exit_code, 0);
  const nlohmann::json given = navigation()["other_navigation"];
  EXPECT_EQ(given["source"], "given");
  EXPECT_GT(given["duration_s"], 0.9 * duration_s);
  EXPECT_NEAR(given["heading_mean_deg"], 1.0, 0.02);
  // Besides, the lever arm of 0.2 m is turned by 1 degree.
  EXPECT_NEAR(given["max_m"], 0.01 * duration_s, 0.15);
  EXPECT_NEAR(given["rms_m"], 0.01 * duration_s / std::sqrt(3.0), 0.1);
  EXPECT_NE(TextOf(Out("report.html")).find("navigation_source: given, difference"),
            std::string::npos);

  const std::string config = dir_.Write(
      "given.yaml", "vehicle: " + ConfigFile("vehicle.yaml") + "\nnavigation_source: given\n");
  ASSERT_EQ(ReplayOf(both, "--config " + config).exit_code, 0);
  const nlohmann::json dead_reckoning = navigation()["other_navigation"];
  EXPECT_EQ(dead_reckoning["source"], "dead_reckoning");
  EXPECT_NEAR(dead_reckoning["heading_mean_deg"], -1.0, 0.3);
  EXPECT_GT(dead_reckoning["duration_s"], 0.8 * duration_s);
  EXPECT_LT(dead_reckoning["max_m"], 0.01 * duration_s + 2.0);
}

TEST_F(Replay, ThatFailsLeavesTheMapBeforeAsItWas) {
  ASSERT_EQ(ReplayOf(ShortLog()).exit_code, 0);
  const std::string before = TextOf(Out("report.json"));
  std::ofstream(Out("notes.txt")) << "mine";
  std::ofstream(Out("submaps/submap_77.pcd")) << "of a longer run";
  const fs::path foreign = dir_.path() / "foreign.lcmlog";
  CopyWithForeign(ShortLog(), foreign, "DVL", 1);
  EXPECT_EQ(ReplayOf(foreign).exit_code, 65);
  EXPECT_EQ(TextOf(Out("report.json")), before);
  EXPECT_EQ(ReplayOf(ShortLog(), "--config " + ConfigFile("mapper.yaml")).exit_code, 0);
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["configuration"], "mapper.yaml by --config, in place of the recorded one");
  EXPECT_EQ(report["partial"], false);
  EXPECT_EQ(TextOf(Out("notes.txt")), "mine");
  EXPECT_FALSE(fs::exists(Out("submaps/submap_77.pcd")));
  EXPECT_FALSE(fs::exists(Out(".partial")));
}

// The drivers were at fault: what they published is not in the log.
TEST_F(Replay, FromRawBytesMakesAnewWhatTheDriversShouldHavePublished) {
  const fs::path log = dir_.path() / "raw.lcmlog";
  EventLogReader all(ShortLog());
  EventLogWriter raw(log);
  std::map<std::string, int> lost;
  while (const auto event = all.Next()) {
    const std::set<std::string> made{"IMU", "DVL", "DEPTH", "MBES_PING", "SVP"};
    if (made.contains(event->channel)) {
      ++lost[event->channel];
      continue;
    }
    raw.Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
  raw.Flush();
  EXPECT_EQ(lost.size(), 5u);
  EXPECT_NE(ReplayOf(log).exit_code, 0);
  const CommandResult result =
      ReplayOf(log, "--from-raw --truth " + ShortLog().string() + ".truth.csv");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["submaps"], 12);
  EXPECT_LT(report["position_rms_m"]["after"].get<double>(), 0.4);
  EXPECT_TRUE(fs::exists(Out("config/imu_driver.yaml")));

  // A wrong setting is mended the same way: here one is made.
  const fs::path config = dir_.path() / "config";
  fs::copy(SourceDir() / "config", config, fs::copy_options::recursive);
  std::ofstream(config / "dvl_driver.yaml", std::ios::app) << "no_such_key: 1\n";
  const CommandResult wrong =
      ReplayOf(log, "--from-raw --dvl-config " + (config / "dvl_driver.yaml").string());
  ExpectOneClearLine(wrong, "no_such_key: unknown key");
  EXPECT_EQ(wrong.exit_code, 78);
}

// The oldest raw bytes were deleted to make room, and the drivers failed later.
TEST_F(Replay, FromRawBytesTakesWhatWasPublishedWhereNoneAreLeft) {
  const fs::path log = dir_.path() / "half.lcmlog";
  EventLogReader all(ShortLog());
  EventLogWriter half(log);
  const std::set<std::string> made{"IMU", "DVL", "DEPTH", "MBES_PING"};
  std::int64_t start = 0;
  while (const auto event = all.Next()) {
    if (start == 0) start = event->utime;
    const bool early = event->utime < start + 100'000'000;
    const bool left_out =
        early ? event->channel.starts_with("RAW_") : made.contains(event->channel);
    if (!left_out) half.Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
  half.Flush();
  const CommandResult result =
      ReplayOf(log, "--from-raw --truth " + ShortLog().string() + ".truth.csv");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["submaps"], 12);
  EXPECT_LT(report["position_rms_m"]["after"].get<double>(), 0.4);
}

// The inertial unit's clock is set 20 s after the start. Its stamps before are by a wrong clock.
TEST_F(Replay, AnInertialClockThatIsWrongAtTheStartCostsThatTimeAlone) {
  const std::string truth = " --truth " + ShortLog().string() + ".truth.csv";
  const auto position_m = [&](const fs::path& log) {
    const CommandResult result = ReplayOf(log, truth);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return nlohmann::json::parse(TextOf(Out("report.json")))["position_rms_m"]["after"]
        .get<double>();
  };
  const double undisturbed_m = position_m(ShortLog());
  for (const double ahead_s : {-3.2e8, 100.0}) {
    const fs::path altered = dir_.path() / "altered.lcmlog";
    fs::remove(altered);
    {
      EventLogReader all(ShortLog());
      EventLogWriter log(altered);
      std::int64_t start = 0;
      while (const auto event = all.Next()) {
        if (start == 0) start = event->utime;
        imu_t imu{};
        const bool is_wrong = event->channel == "IMU" && event->utime < start + 20'000'000;
        if (!is_wrong) {
          log.Write(event->utime, event->channel, event->data.data(), event->data.size());
          continue;
        }
        ASSERT_GT(imu.decode(event->data.data(), 0, static_cast<int>(event->data.size())), 0);
        imu.utime += static_cast<std::int64_t>(1e6 * ahead_s);
        log.Write(event->utime, event->channel, imu);
      }
    }
    EXPECT_LT(position_m(altered), 1.5 * undisturbed_m + 0.1) << ahead_s;
  }
}

TEST_F(Replay, FromRawBytesNeedsSome) {
  const fs::path log = dir_.path() / "noraw.lcmlog";
  EventLogReader all(ShortLog());
  EventLogWriter out(log);
  while (const auto event = all.Next())
    if (!event->channel.starts_with("RAW_"))
      out.Write(event->utime, event->channel, event->data.data(), event->data.size());
  out.Flush();
  const CommandResult result = ReplayOf(log, "--from-raw");
  ExpectOneClearLine(result, "no raw bytes (RAW_*)");
  EXPECT_EQ(result.exit_code, 65);
}

// A replay in this process, where Ctrl-C comes at the first submap.
class InterruptedReplay : public Replay {
 protected:
  ReplayOptions Options(std::function<void()> at_first_submap) {
    ReplayOptions options;
    options.inputs = {ShortLog()};
    options.out = dir_.path() / "out";
    options.default_config_dir = SourceDir() / "config";
    options.quiet = true;
    options.interruptible = true;
    options.on_event = [at_first_submap](const MapperEvent& event) {
      if (std::holds_alternative<std::shared_ptr<const Submap>>(event)) at_first_submap();
      // Time for it to be seen, however busy the machine.
      if (std::holds_alternative<NavState>(event)) usleep(1'000);
    };
    return options;
  }
};

TEST_F(InterruptedReplay, LeavesAMapOfWhatWasReadThatSaysSo) {
  bool sent = false;
  const ProductSummary summary = RunReplay(Options([&] {
    if (!std::exchange(sent, true)) kill(getpid(), SIGINT);
  }));
  EXPECT_TRUE(summary.partial);
  EXPECT_LT(summary.submaps, 11u);
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["partial"], true);
  EXPECT_NE(report["statement"].get<std::string>().find("the replay was interrupted after "),
            std::string::npos);
  EXPECT_NE(TextOf(Out("report.html")).find("the replay was interrupted after "),
            std::string::npos);
  EXPECT_FALSE(fs::exists(Out(".store")));

  // As an input of another replay it says so, too; that replay itself is complete.
  ReplayOptions with_map = Options([] {});
  with_map.inputs = {Out("")};
  with_map.out = dir_.path() / "again";
  const ProductSummary again = RunReplay(with_map);
  EXPECT_FALSE(again.partial);
  EXPECT_EQ(again.submaps, summary.submaps);
  const auto lacks = nlohmann::json::parse(TextOf(with_map.out / "report.json"))["dives_not_read"];
  ASSERT_EQ(lacks.size(), 1u);
  EXPECT_NE(lacks[0]["reason"].get<std::string>().find("the replay was interrupted after "),
            std::string::npos);
}

TEST_F(InterruptedReplay, WhileTheLastPairsAreLookedAtAgainSaysSo) {
  ReplayOptions options = Options([] {});
  options.on_event = [](const MapperEvent& event) {
    const auto* step = std::get_if<GraphStep>(&event);
    if (step == nullptr || !step->update.final) return;
    kill(getpid(), SIGINT);
    usleep(500'000);
  };
  EXPECT_TRUE(RunReplay(options).partial);
}

TEST_F(InterruptedReplay, TwiceEndsAtOnceAndLeavesNothing) {
  const auto insist = [] {
    for (int i = 0; i < 1'000; ++i) {
      kill(getpid(), SIGINT);
      usleep(10'000);
    }
  };
  EXPECT_EXIT(RunReplay(Options(insist)), testing::ExitedWithCode(130), "Ctrl-C again");
  EXPECT_FALSE(fs::exists(dir_.path() / "out"));
  EXPECT_FALSE(fs::exists(dir_.path() / "out.partial"));
}

}  // namespace
}  // namespace seastitch
