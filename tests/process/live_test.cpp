// The real processes, real LCM, and other people's programs around them.

#include <gtest/gtest.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <list>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "common/storage/submap_file.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "survey/replay/replay.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/live/child_process.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

const std::string kConfig = ConfigFile("");

nlohmann::json ReadJson(const fs::path& path) {
  std::ifstream in(path);
  return nlohmann::json::parse(in);
}

TEST(Demo, CorrectsTheMapLiveAndInReplay) {
  const TemporaryDir dir;
  const fs::path out = dir.path() / "out";
  const CommandResult demo = RunCommand(Program("seastitch") + " demo --survey " + kConfig +
                                        "bench/short.yaml --speed 12 --out " + out.string());
  ASSERT_EQ(demo.exit_code, 0) << demo.output;
  for (const char* run : {"live", "replay"}) {
    const auto report = ReadJson(out / run / "report.json");
    EXPECT_GE(report["submaps"].get<int>(), 4) << run;
    EXPECT_GE(report["loop_closures"]["accepted"].get<int>(), 1) << run;
    EXPECT_LT(report["position_rms_m"]["after"].get<double>(),
              report["position_rms_m"]["before"].get<double>())
        << run << "\n"
        << demo.output;
  }
  const auto live_noise = ReadJson(out / "live" / "report.json")["noise"];
  EXPECT_EQ(live_noise["not_estimated"], "this replay uses the recorded results");
  for (const auto& finding : ReadJson(out / "replay" / "report.json")["noise"]["findings"])
    EXPECT_NE(demo.output.find(finding), std::string::npos) << finding << "\n" << demo.output;
  // A machine that is too slow for the speed drops datagrams or has late samples, and says so.
  if (demo.output.find("nothing was lost on the way") == std::string::npos) return;
  EXPECT_TRUE(
      std::regex_search(demo.output, std::regex("submaps: (\\d+) of \\1 have the same bytes")))
      << demo.output;
  std::smatch apart;
  ASSERT_TRUE(
      std::regex_search(demo.output,
                        apart,
                        std::regex("poses: at most ([0-9.]+) of the smallest stated sigma apart")))
      << demo.output;
  EXPECT_LE(std::stod(apart[1]), 1.0 / 3.0) << demo.output;

  // At the surface, where the survey ends, the sonar is off.
  std::smatch faults;
  ASSERT_TRUE(
      std::regex_search(demo.output, faults, std::regex("faults at the end of the survey: (.*)\n")))
      << demo.output;
  // A busy machine has faults of its own. These are of clocks and data.
  for (const char* fault :
       {"clock_step", "clock_drift", "no_navigation", "samples_late", "two_senders", "dvl_refused"})
    EXPECT_EQ(faults[1].str().find(fault), std::string::npos) << faults[1];
  // The same survey without processes.
  const std::string log = (dir.path() / "short.lcmlog").string();
  const fs::path map = dir.path() / "map";
  const CommandResult made =
      RunCommand(Program("seastitch") + " bench --survey " + kConfig + "bench/short.yaml --log " +
                 log + " && " + Program("seastitch") + " replay " + log + " --out " + map.string());
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const auto position_m = [](const fs::path& run) {
    return ReadJson(run / "report.json")["position_rms_m"]["after"].get<double>();
  };
  EXPECT_NEAR(position_m(out / "replay"), position_m(map), 0.1 * position_m(map)) << demo.output;
  EXPECT_LT(ReadJson(map / "report.json")["truth"]["position_change_m"]["after"], 0.1);
}

// The command lines of the processes that have `word` in theirs.
std::vector<std::string> ProcessesWith(const std::string& word) {
  std::vector<std::string> found;
  for (const fs::directory_entry& process : fs::directory_iterator("/proc")) {
    std::string command_line = TextOf(process.path() / "cmdline");
    std::replace(command_line.begin(), command_line.end(), '\0', ' ');
    if (command_line.find(word) != std::string::npos) found.push_back(command_line);
  }
  return found;
}

// How long a process may take for what it does at once on an idle machine.
constexpr seconds kPatience(60);

bool Eventually(const std::function<bool()>& happened, seconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!happened()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    usleep(20'000);
  }
  return true;
}

TEST(Demo, LeavesNoProcessBehindWhenItIsKilled) {
  const TemporaryDir dir;
  const std::string out = (dir.path() / "out").string();
  const fs::path said = dir.path() / "demo.txt";
  constexpr std::size_t kDemoAndItsProcesses = 8;
  {
    const ChildProcess demo(
        "demo",
        {Program("seastitch"), "demo", "--survey", kConfig + "bench/short.yaml", "--out", out},
        said);
    ASSERT_TRUE(
        Eventually([&] { return ProcessesWith(out).size() == kDemoAndItsProcesses; }, kPatience))
        << testing::PrintToString(ProcessesWith(out)) << "\n"
        << TextOf(said);
  }  // SIGKILL
  EXPECT_TRUE(Eventually([&] { return ProcessesWith(out).empty(); }, kPatience))
      << testing::PrintToString(ProcessesWith(out));
}

// Of a submap that a live mapper stored; empty: it has none.
fs::path FileOf(const fs::path& map, SubmapId id) {
  for (const auto& entry : fs::recursive_directory_iterator(map))
    if (entry.path().filename() == SubmapFileName(id)) return entry.path();
  return {};
}

// The submaps of the first map in a dive have the bytes that a replay of the log gives them.
void ExpectSubmapsOfReplay(const fs::path& log, const fs::path& config, const fs::path& map) {
  const fs::path closed = config / "closed.pcd";
  int compared = 0;
  ReplayOptions options;
  options.inputs = {log};
  options.mapper_config = config / "mapper.yaml";
  options.optimizer_config = config / "optimizer.yaml";
  options.out = config / "replayed";
  options.on_event = [&](const MapperEvent& event) {
    const auto* const submap = std::get_if<std::shared_ptr<const Submap>>(&event);
    if (submap == nullptr || (*submap)->cloud.empty()) return;
    WriteSubmapPcd(closed, (*submap)->cloud, (*submap)->T_map_submap);
    EXPECT_TRUE(ReadWholeFile(closed) == ReadWholeFile(FileOf(map, (*submap)->id)))
        << "submap " << (*submap)->id.value;
    ++compared;
  };
  RunReplay(options);
  EXPECT_GE(compared, 4);
}

// On a bus of its own, with a log of the bench played by Debian's lcm-logplayer, and played again.
TEST(LogPlayer, FeedsAMapperThatBeginsANewMapWhenItBeginsAgain) {
  const TemporaryDir dir;
  const std::string log = (dir.path() / "short.lcmlog").string();
  const CommandResult made = RunCommand(Program("seastitch") + " bench --survey " + kConfig +
                                        "bench/short.yaml --log " + log);
  ASSERT_EQ(made.exit_code, 0) << made.output;

  const std::string url = "udpm://239.255.76.67:7821?ttl=0&recv_buf_size=4194304";
  fs::copy(kConfig, dir.path() / "config", fs::copy_options::recursive);
  Bus bus(url);
  struct Graph {
    std::set<std::int32_t> submaps;
    std::int64_t version = 0;
    std::size_t solved = 0;
    std::int64_t solved_version = 0;
  };
  std::map<std::int64_t, Graph> graphs;  // by id
  std::vector<std::int64_t> ids;         // in their order
  std::set<std::string> alive;
  std::set<std::string> said;  // conditions of the mapper
  bus.Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) {
    alive.insert(m.process);
    if (m.process != "mapper") return;
    for (const condition_t& condition : m.conditions) said.insert(condition.name);
  });
  bus.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [&](const graph_update_t& m) {
    if (!graphs.contains(m.graph_id)) ids.push_back(m.graph_id);
    Graph& graph = graphs[m.graph_id];
    for (const graph_vertex_t& vertex : m.vertices) graph.submaps.insert(vertex.id);
    graph.version = std::max(graph.version, m.version);
  });
  bus.Subscribe<pose_graph_t>("POSE_GRAPH", 0, [&](const pose_graph_t& m) {
    Graph& graph = graphs[m.graph_id];
    graph.solved = static_cast<std::size_t>(m.num_vertices);
    graph.solved_version = m.graph_version;
  });
  const auto is_solved = [&] {
    const Graph& last = graphs[ids.back()];
    return last.version > 0 && last.solved_version == last.version;
  };
  const auto listen_until = [&](const auto& done, seconds patience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!done() && std::chrono::steady_clock::now() < deadline) {
      bus.HandleAll();
      usleep(10'000);
    }
    return done();
  };

  const auto start = [&](const std::string& name) {
    return ChildProcess(name,
                        {Program("seastitch-" + name),
                         "--config",
                         (dir.path() / "config" / (name + ".yaml")).string(),
                         "--lcm-url",
                         url},
                        dir.path() / (name + ".txt"));
  };
  ChildProcess optimizer = start("optimizer");
  ChildProcess mapper = start("mapper");
  ASSERT_TRUE(listen_until([&] { return alive.size() == 2; }, kPatience));

  const auto play = [&](const std::string& speed) {
    ChildProcess player("lcm-logplayer",
                        {"/usr/bin/lcm-logplayer", "--speed=" + speed, "--lcm-url=" + url, log},
                        dir.path() / "player.txt");
    ASSERT_TRUE(listen_until([&] { return player.ExitCode().has_value(); }, seconds(120)));
    EXPECT_EQ(player.ExitCode(), 0);
  };
  play("12");
  ASSERT_EQ(ids.size(), 1u);
  EXPECT_TRUE(listen_until(is_solved, kPatience));
  EXPECT_FALSE(said.contains("map_begun_anew"));
  play("30");
  EXPECT_EQ(mapper.Stop(seconds(30)), 0);
  ExpectSubmapsOfReplay(
      log, dir.path() / "config", NewestDive(dir.path() / "dives").value() / "map");
  ASSERT_EQ(ids.size(), 2u);
  EXPECT_TRUE(listen_until(is_solved, kPatience));
  EXPECT_EQ(optimizer.Stop(kPatience), 0);
  EXPECT_TRUE(said.contains("map_begun_anew"));
  for (const std::int64_t id : ids) {
    EXPECT_GE(graphs[id].submaps.size(), 4u);
    EXPECT_EQ(graphs[id].solved, graphs[id].submaps.size());
  }
}

TEST(Mapper, RefusesToStartBesideAnother) {
  const TemporaryDir dir;
  fs::copy(kConfig, dir.path() / "config", fs::copy_options::recursive);
  const std::string command = Program("seastitch-mapper") + " --config " +
                              (dir.path() / "config" / "mapper.yaml").string() +
                              " --lcm-url memq://";
  const auto start = [&](const std::string& name) {
    return ChildProcess(name,
                        {Program("seastitch-mapper"),
                         "--config",
                         (dir.path() / "config" / "mapper.yaml").string(),
                         "--lcm-url",
                         "udpm://239.255.76.67:7823?ttl=0"},
                        dir.path() / (name + ".txt"));
  };
  const auto is_locked = [&] {
    for (const auto& entry : fs::recursive_directory_iterator(dir.path() / "dives"))
      if (entry.path().filename() == "lock" && fs::file_size(entry.path()) > 0) return true;
    return false;
  };
  const ChildProcess first = start("first");
  ASSERT_TRUE(
      Eventually([&] { return fs::exists(dir.path() / "dives") && is_locked(); }, kPatience));
  const CommandResult second = RunCommand(command);
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.output.find("map: in use by process "), std::string::npos) << second.output;
  EXPECT_EQ(std::count(second.output.begin(), second.output.end(), '\n'), 1) << second.output;
  const fs::path dive = NewestDive(dir.path() / "dives").value();
  const auto starts = [&] { return ReadDiveRecord(dive).processes["mapper"].starts; };
  ASSERT_TRUE(Eventually([&] { return starts() > 0; }, kPatience));
  EXPECT_EQ(starts(), 1) << "the second leaves no trace in the dive's record";
}

// NAV does not depend on a disk.
TEST(Mapper, WithoutItsDiskStartsInMemoryAndSaysSo) {
  const TemporaryDir dir;
  fs::copy(kConfig, dir.path() / "config", fs::copy_options::recursive);
  const fs::path config = dir.path() / "config" / "mapper.yaml";
  const fs::path disk = dir.path() / "disk";
  MapperConfig changed = LoadMapperConfig(config.string());
  changed.dive.dives_dir = disk / "dives";
  std::ofstream(config) << PrintConfig(changed);
  const std::string url = "udpm://239.255.76.67:7824?ttl=0";
  Bus bus(url);
  std::optional<health_t> health;
  bus.Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { health = m; });
  // Starts it, and gives the names of its first conditions.
  const auto run = [&] {
    health.reset();
    ChildProcess mapper("mapper",
                        {"/usr/bin/env",
                         "RUNTIME_DIRECTORY=" + (dir.path() / "run").string(),
                         Program("seastitch-mapper"),
                         "--config",
                         config.string(),
                         "--lcm-url",
                         url},
                        dir.path() / "mapper.txt");
    EXPECT_TRUE(Eventually(
        [&] {
          bus.HandleAll();
          return health.has_value();
        },
        kPatience));
    EXPECT_EQ(mapper.Stop(kPatience), 0);
    std::set<std::string> names;
    if (health)
      for (const condition_t& condition : health->conditions) names.insert(condition.name);
    return names;
  };
  EXPECT_TRUE(run().contains("map_in_memory"));
  EXPECT_TRUE(NewestDive(dir.path() / "run" / "dives"));
  fs::create_directory(disk);
  EXPECT_FALSE(run().contains("map_in_memory")) << "the next start uses the disk";
  EXPECT_TRUE(NewestDive(disk / "dives"));
}

TEST(TypesJar, IsFoundByLcmSpy) {
  if (RunCommand("which java").exit_code != 0 || !fs::exists("/usr/share/java/lcm.jar")) {
    GTEST_SKIP() << "needs java and liblcm-java, which are not here";
  }
  const std::string build = BuildDir().string();
  const CommandResult jar = RunCommand("cmake --build " + build + " --target lcmtypes_jar");
  ASSERT_EQ(jar.exit_code, 0) << jar.output;
  const CommandResult found = RunCommand(
      "java -cp /usr/share/java/lcm.jar:" + build + "/share/seastitch_lcmtypes.jar " +
      (SourceDir() / "tests/process/SpyTypes.java").string() +
      " imu_t dvl_t depth_t mbes_ping_t raw_bytes_t nav_t submap_t "
      "submap_points_t graph_update_t graph_request_t pose_graph_t health_t position_fix_t "
      "sound_velocity_profile_t covariance_request_t covariances_t");
  EXPECT_EQ(found.exit_code, 0) << found.output;
  EXPECT_NE(found.output.find("found 16"), std::string::npos) << found.output;
}

TEST(LoggerConfig, MustNameChannelsThatLcmCanRead) {
  const TemporaryDir dir;
  dir.Write("logger.yaml", "channels: \"(IMU\"\n");
  const CommandResult refused =
      RunCommand(Program("seastitch-logger") + " --check-config --config " +
                 (dir.path() / "logger.yaml").string());
  EXPECT_EQ(refused.exit_code, EX_CONFIG);
  EXPECT_NE(refused.output.find("logger.yaml: channels: '\"(IMU\"' is not"), std::string::npos)
      << refused.output;
}

// Every process stops at start with one line for a configuration it cannot use.
class BadConfig : public ::testing::TestWithParam<std::string> {};

TEST_P(BadConfig, StopsAtStartWithOneLine) {
  const TemporaryDir dir;
  fs::copy(kConfig, dir.path() / "config", fs::copy_options::recursive);
  std::string file = GetParam() + ".yaml";
  std::replace(file.begin(), file.end(), '-', '_');
  const fs::path config = dir.path() / "config" / file;
  const std::string command = Program("seastitch-" + GetParam()) + " --check-config --config ";

  EXPECT_EQ(RunCommand(command + config.string()).exit_code, 0);

  const CommandResult missing = RunCommand(command + (dir.path() / "nothing.yaml").string());
  EXPECT_EQ(missing.exit_code, EX_CONFIG);
  EXPECT_NE(missing.output.find("nothing.yaml"), std::string::npos) << missing.output;
  EXPECT_EQ(std::count(missing.output.begin(), missing.output.end(), '\n'), 1) << missing.output;

  std::ofstream(config, std::ios::app) << "\nno_such_key: 1\n";
  const CommandResult unknown = RunCommand(command + config.string());
  EXPECT_EQ(unknown.exit_code, EX_CONFIG);
  EXPECT_NE(unknown.output.find(file + ": no_such_key: unknown key"), std::string::npos)
      << unknown.output;
  EXPECT_EQ(std::count(unknown.output.begin(), unknown.output.end(), '\n'), 1) << unknown.output;

  dir.Write("broken.yaml", "a: [1, 2\nb: }");
  const CommandResult broken = RunCommand(command + (dir.path() / "broken.yaml").string());
  EXPECT_EQ(broken.exit_code, EX_CONFIG);
  EXPECT_NE(broken.output.find("broken.yaml"), std::string::npos) << broken.output;
}

INSTANTIATE_TEST_SUITE_P(
    Processes,
    BadConfig,
    ::testing::Values("imu-driver", "dvl-driver", "mbes-driver", "mapper", "optimizer", "logger"),
    [](const auto& process) {
      std::string name = process.param;
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

}  // namespace
}  // namespace seastitch
