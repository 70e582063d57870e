#include "tests/support/files.hpp"
#include "tests/survey/replay_fixture.hpp"

namespace seastitch {
namespace {

// Files named in any order, cut anywhere, messages of different channels in another order.
class ShuffledReplay : public Replay {
 protected:
  // Each message up to 0.2 s later, in the order of its channel.
  static std::vector<LogEvent> Shuffled(const fs::path& log, std::mt19937* random) {
    std::uniform_int_distribution<std::int64_t> delay_us(0, 200'000);
    std::vector<std::pair<std::int64_t, LogEvent>> delayed;
    std::map<std::string, std::int64_t> last;
    EventLogReader reader(log);
    while (auto event = reader.Next()) {
      std::int64_t& at = last[event->channel];
      at = std::max(at, event->utime + delay_us(*random));
      event->utime = at;
      delayed.emplace_back(at, std::move(*event));
    }
    std::stable_sort(delayed.begin(), delayed.end(), [](const auto& a, const auto& b) {
      return a.first < b.first;
    });
    std::vector<LogEvent> events;
    for (auto& [at, event] : delayed) events.push_back(std::move(event));
    return events;
  }

  // Into up to six files whose names tell nothing; in half of the cases the clock goes back by an
  // hour on the way.
  fs::path Cut(const std::vector<LogEvent>& events, int run, std::mt19937* random) {
    const fs::path folder = dir_.path() / ("cut" + std::to_string(run));
    fs::create_directory(folder);
    std::vector<std::string> names{"a", "b", "c", "d", "e", "f"};
    std::shuffle(names.begin(), names.end(), *random);
    std::uniform_int_distribution<std::size_t> place(0, events.size());
    std::set<std::size_t> cuts{events.size()};
    while (cuts.size() < names.size()) cuts.insert(place(*random));
    const std::size_t step_back = run % 2 == 0 ? events.size() : place(*random);
    std::size_t i = 0;
    for (const std::size_t end : cuts) {
      if (end == 0) continue;
      EventLogWriter out(folder / (names.back() + ".lcmlog"));
      names.pop_back();
      for (; i < end; ++i) {
        const std::int64_t back_us = i < step_back ? 0 : 3'600'000'000;
        out.Write(events[i].utime - back_us,
                  events[i].channel,
                  events[i].data.data(),
                  events[i].data.size());
      }
    }
    return folder;
  }

  std::map<std::string, std::string> ProductsOf(const std::string& inputs) {
    fs::remove_all(dir_.path() / "out");
    const CommandResult result = ReplayOf(inputs, "--truth " + ShortLog().string() + ".truth.csv");
    EXPECT_EQ(result.exit_code, 0) << result.output;
    std::map<std::string, std::string> products;
    for (const auto& entry : fs::recursive_directory_iterator(dir_.path() / "out")) {
      const std::string name = fs::relative(entry.path(), dir_.path() / "out").string();
      // These name the files; the report's costs are others each time.
      const bool names_files = name.ends_with(".png") || name.starts_with("report.") ||
                               name == "survey.bag" || name == "survey.qgs" ||
                               name == "export/lines.csv" || name == "survey.bin";
      if (entry.is_regular_file() && !names_files) products[name] = TextOf(entry.path());
    }
    return products;
  }
};

TEST_F(ShuffledReplay, TwentyTimesGivesTheSameBytes) {
  const auto expected = ProductsOf(ShortLog().string());
  std::mt19937 random(7);
  for (int run = 0; run < 20; ++run) {
    const fs::path folder = Cut(Shuffled(ShortLog(), &random), run, &random);
    const auto products = ProductsOf(folder.string() + "/*");
    ASSERT_EQ(products.size(), expected.size());
    for (const auto& [name, bytes] : expected)
      ASSERT_TRUE(products.at(name) == bytes) << name << ", run " << run;
    fs::remove_all(folder);
  }
}

// Frames of the submaps, in their order.
std::vector<std::array<double, 3>> PlacesIn(const fs::path& poses) {
  std::vector<std::array<double, 3>> places;
  std::ifstream in(poses);
  for (std::string line; std::getline(in, line);) {
    std::istringstream numbers(line);
    double id = 0.0;
    std::array<double, 3> p{};
    if (numbers >> id >> p[0] >> p[1] >> p[2]) places.push_back(p);
  }
  return places;
}

// The clock of the vehicle's computer goes back by ten minutes in the middle of the survey.
TEST_F(Replay, OfALogWhoseClockSteppedGivesTheSameMap) {
  ASSERT_EQ(ReplayOf(ShortLog()).exit_code, 0);
  const auto without = PlacesIn(Out("poses.txt"));
  ASSERT_GE(without.size(), 5U);
  const fs::path stepped = dir_.path() / "stepped.lcmlog";
  std::int64_t events = 0;
  for (EventLogReader all(ShortLog()); all.Next();) ++events;
  EventLogReader all(ShortLog());
  EventLogWriter out(stepped);
  for (std::int64_t i = 0; auto event = all.Next(); ++i) {
    const Channel* channel = FindChannel(event->channel);
    const std::int64_t step_us = 2 * i < events ? 0 : -600'000'000;
    if (channel != nullptr && channel->role == ChannelRole::kSensor) {
      for (const std::size_t at : {8U, 16U}) {  // utime and recv_utime, big endian
        std::uint64_t stamp = 0;
        for (std::size_t k = 0; k < 8; ++k) stamp = stamp << 8 | event->data[at + k];
        stamp += static_cast<std::uint64_t>(step_us);
        for (std::size_t k = 0; k < 8; ++k)
          event->data[at + k] = static_cast<std::uint8_t>(stamp >> (56 - 8 * k));
      }
    }
    out.Write(event->utime + step_us, event->channel, event->data.data(), event->data.size());
  }
  out.Flush();
  const CommandResult result = ReplayOf(stepped);
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto with = PlacesIn(Out("poses.txt"));
  ASSERT_EQ(with.size(), without.size());
  for (std::size_t i = 0; i < with.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(with[i][axis], without[i][axis], 0.05) << "submap " << i;
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  EXPECT_EQ(report["mapper_counters"]["clock_steps_computer"], 1);
}

TEST_F(Replay, OfAMissingFileSaysSo) {
  ExpectOneClearLine(ReplayOf(dir_.path() / "nothing.lcmlog"), "no such file");
}

TEST_F(Replay, OfAnEmptyLogSaysSo) {
  ExpectOneClearLine(ReplayOf(dir_.Write("empty.lcmlog", "")), "empty.lcmlog");
}

TEST_F(Replay, OfSomethingThatIsNoLogSaysSo) {
  ExpectOneClearLine(ReplayOf(dir_.Write("noise.lcmlog", std::string(5000, 'x'))), "noise.lcmlog");
}

TEST_F(Replay, OfPingsWithoutNavigationSaysWhatIsMissing) {
  const fs::path pings = dir_.path() / "pings.lcmlog";
  EventLogReader all(ShortLog());
  EventLogWriter some(pings);
  while (const std::optional<LogEvent> event = all.Next()) {
    if (event->channel == "MBES_PING") {
      some.Write(event->utime, event->channel, event->data.data(), event->data.size());
    }
  }
  some.Flush();
  ExpectOneClearLine(ReplayOf(pings, "--config " + ConfigFile("mapper.yaml")),
                     "waiting for navigation: no usable inertial samples");
}

TEST_F(Replay, OfAChannelOfAnotherTypeEndsWith65) {
  const fs::path log = dir_.path() / "foreign.lcmlog";
  CopyWithForeign(ShortLog(), log, "DVL", 1);
  const CommandResult result = ReplayOf(log);
  ExpectOneClearLine(result, "DVL: fingerprint ");
  EXPECT_NE(result.output.find(", expected dvl_t ("), std::string::npos) << result.output;
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_FALSE(fs::exists(Out("elevation.tif")));
}

TEST_F(Replay, SkipsAndCountsSingleEventsOfAnotherType) {
  const fs::path log = dir_.path() / "foreign.lcmlog";
  CopyWithForeign(ShortLog(), log, "DVL", 50);
  const CommandResult result = ReplayOf(log);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("skipped: of_another_type_DVL "), std::string::npos)
      << result.output;
}

TEST_F(Replay, OfADirectoryWithoutSubmapsSaysSo) {
  fs::create_directory(dir_.path() / "empty");
  ExpectOneClearLine(ReplayOf(dir_.path() / "empty"), "no submaps");
  ExpectOneClearLine(ReplayOf(dir_.path() / "empty"), "it is empty");
  fs::create_directory(dir_.path() / "photos");
  for (const char* const name : {"b.jpg", "a.jpg"}) dir_.Write(std::string("photos/") + name, "");
  ExpectOneClearLine(ReplayOf(dir_.path() / "photos"), "it holds a.jpg, b.jpg");
}

TEST_F(Replay, OfADamagedSubmapNamesTheFile) {
  fs::create_directory(dir_.path() / "maps");
  dir_.Write("maps/submap_0.pcd", "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n");
  ExpectOneClearLine(ReplayOf(dir_.path() / "maps"), "submap_0.pcd");
}

TEST_F(Replay, WithAnUnknownKeyNamesFileAndKey) {
  fs::copy(SourceDir() / "config", dir_.path() / "config", fs::copy_options::recursive);
  std::ofstream(dir_.path() / "config/mapper.yaml", std::ios::app) << "\nvoxels: 3\n";
  const CommandResult result =
      ReplayOf(ShortLog(), "--config " + (dir_.path() / "config/mapper.yaml").string());
  ExpectOneClearLine(result, "voxels: unknown key");
}

TEST_F(Replay, LeavesEveryProduct) {
  const CommandResult result = ReplayOf(ShortLog());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  for (const char* file : {"elevation.tif",
                           "elevation_as_navigated.tif",
                           "mismatch.tif",
                           "mismatch_as_navigated.tif",
                           "depth.png",
                           "depth_as_navigated.png",
                           "mismatch.png",
                           "mismatch_as_navigated.png",
                           "track.csv",
                           "poses.txt",
                           "graph.g2o",
                           "report.json",
                           "report.html",
                           "survey.gpkg"}) {
    EXPECT_TRUE(fs::exists(Out(file))) << file;
  }
  const auto report = nlohmann::json::parse(TextOf(Out("report.json")));
  for (const char* key : {"consistency_rms_m",
                          "submaps",
                          "loop_closures",
                          "soundings",
                          "wall_s",
                          "cpu_s",
                          "peak_rss_mb",
                          "realtime_factor",
                          "position_rms_m",
                          "position_max_m",
                          "yaw_rms_deg"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_FALSE(fs::exists(Out(".store")));
}

TEST_F(Replay, OfTheSameLogGivesTheSameBytes) {
  ASSERT_EQ(ReplayOf(ShortLog()).exit_code, 0);
  const fs::path first = dir_.path() / "first";
  fs::rename(dir_.path() / "out", first);
  // On one processor instead of all.
  const CommandResult second =
      RunCommand("taskset -c 0 " + Seastitch("replay " + ShortLog().string() + " --quiet --out " +
                                             (dir_.path() / "out").string()));
  ASSERT_EQ(second.exit_code, 0) << second.output;

  int compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(first)) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), first);
    if (name == "report.json") continue;  // what the run cost
    EXPECT_EQ(TextOf(entry.path()), TextOf(Out(name.string()))) << name;
    ++compared;
  }
  EXPECT_GT(compared, 12);
}

}  // namespace
}  // namespace seastitch
