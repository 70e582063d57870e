#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "common/convert/convert.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/health_t.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

void WriteDepth(EventLogWriter* log, std::int64_t utime, std::int64_t seq) {
  depth_t msg{};
  msg.utime = utime;
  msg.seq = seq;
  log->Write(utime, "DEPTH", msg);
}

nlohmann::json InfoOf(const std::string& log) {
  const CommandResult result = RunCommand(Program("seastitch") + " info --json " + log);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  return nlohmann::json::parse(result.output);
}

TEST(Info, AFolderOfNeitherMapNorDiveIsRefused) {
  const TemporaryDir dir;
  const CommandResult result = RunCommand(Program("seastitch") + " info " + dir.path().string());
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
}

TEST(Info, SaysHowAReplayWouldUseSurveyFiles) {
  const std::filesystem::path files = Shared("data/mbes");
  if (!std::filesystem::exists(files)) GTEST_SKIP() << "no " << files;
  const nlohmann::json json =
      InfoOf((files / "em2040_OS01.kmall").string() + " " + (files / "r2sonic2026.xtf").string());
  ASSERT_EQ(json["dives"].size(), 2u);
  const auto& kongsberg = json["dives"][json["dives"][0]["sonar"] == "" ? 1 : 0];
  EXPECT_EQ(kongsberg["sonar"], "EM 2042");
  EXPECT_EQ(kongsberg["serial"], "5001");
  EXPECT_EQ(kongsberg["problem"], "");
  EXPECT_TRUE(kongsberg["raw_times_and_angles"]);
  EXPECT_GT(kongsberg["depth_below_sonar_m"], 1.0);
}

// A log of the bench has its truth beside it, and is replaced; another file is not.
TEST(Bench, OverwritesNothingThatItDidNotMake) {
  const TemporaryDir dir;
  const std::string log = dir.Write("dive.lcmlog", "somebody's dive");
  const std::string bench =
      Program("seastitch") + " bench --survey " + ConfigFile("bench/short.yaml") + " --log " + log;
  EXPECT_EQ(RunCommand(bench).exit_code, 64);
  EXPECT_EQ(std::filesystem::file_size(log), 15U) << "untouched";
  EXPECT_EQ(RunCommand(bench + " --overwrite").exit_code, 0);
  EXPECT_EQ(RunCommand(bench).exit_code, 0) << "its own";
}

TEST(Info, CountsWhatTheSequenceNumbersMiss) {
  const TemporaryDir dir;
  const std::string path = (dir.path() / "a.lcmlog").string();
  {
    EventLogWriter log(path);
    for (const std::int64_t seq : {0, 1, 2, 5, 6}) WriteDepth(&log, 1'000'000 + seq * 100'000, seq);
  }
  const auto info = InfoOf(path);
  EXPECT_EQ(info["channels"]["DEPTH"]["events"], 5);
  EXPECT_EQ(info["channels"]["DEPTH"]["lost"], 2);
  EXPECT_EQ(info["damaged_bytes"], 0);
}

TEST(Info, NumbersOfADamagedLogDoNotWrapAround) {
  const TemporaryDir dir;
  const std::string path = (dir.path() / "a.lcmlog").string();
  {
    EventLogWriter log(path);
    WriteDepth(&log, INT64_MIN, 0);
    WriteDepth(&log, INT64_MAX, INT64_MAX - 1);
    WriteDepth(&log, INT64_MIN + 1, 0);
    WriteDepth(&log, INT64_MAX, INT64_MAX - 1);
  }
  const auto depth = InfoOf(path)["channels"]["DEPTH"];
  EXPECT_EQ(depth["events"], 4);
  EXPECT_EQ(depth["lost"], 0) << "no number that another one goes on from";
  EXPECT_EQ(depth["clock_steps_back"], 1);
  EXPECT_GT(depth["longest_gap_s"].get<double>(), 9e12);
}

TEST(Info, TellsOfSeveralLogsAsOneWithSendersStepsAndConfiguration) {
  const TemporaryDir dir;
  const auto health = [](EventLogWriter* log, std::int64_t at_s, const char* process, int seq) {
    health_t msg{};
    msg.utime = at_s * 1'000'000;
    msg.seq = seq;
    msg.process = process;
    log->Write(msg.utime, "HEALTH", msg);
  };
  {
    EventLogWriter log(dir / "b.lcmlog");
    for (const config_t& part : ToLcm({"mapper", "1.2.3", "mapper.yaml", "a: 1"}, FromUtime(1), 0))
      log.Write(1'000'000, "CONFIG", part);
    for (int seq = 0; seq < 10; ++seq) health(&log, 100 + seq, "mapper", seq);
    for (int seq = 10; seq < 20; ++seq) health(&log, 4'000 + seq, "mapper", seq);  // forward
  }
  {
    EventLogWriter log(dir / "a.lcmlog");
    for (int seq = 20; seq < 30; ++seq) health(&log, 100 + seq, "mapper", seq);  // back
    for (int seq = 0; seq < 3; ++seq) health(&log, 130 + 2 * seq, "logger", 2 * seq);
    health(&log, 1'000, "mapper", 90);  // silence, and loss: no step
  }
  const auto info = InfoOf((dir / "a.lcmlog").string() + " " + (dir / "b.lcmlog").string());
  EXPECT_EQ(info["logs"][0], (dir / "b.lcmlog").string());
  EXPECT_EQ(info["start"], "1970-01-01T00:00:01.000Z");
  EXPECT_EQ(info["end"], "1970-01-01T00:16:40.000Z");
  const auto& senders = info["channels"]["HEALTH"]["senders"];
  EXPECT_EQ(senders["mapper"]["lost"], 60);
  EXPECT_EQ(senders["logger"]["lost"], 2);
  ASSERT_EQ(info["clock_steps"].size(), 3u) << info["clock_steps"];
  EXPECT_EQ(info["clock_steps"][1]["step_s"], 3901.0);
  EXPECT_EQ(info["clock_steps"][2]["step_s"], -3899.0);
  EXPECT_EQ(info["configuration"][0]["name"], "mapper.yaml");
  EXPECT_EQ(info["configuration"][0]["version"], "1.2.3");
  const CommandResult text =
      RunCommand(Program("seastitch") + " info " + (dir / "b.lcmlog").string());
  EXPECT_NE(text.output.find("mapper.yaml of mapper 1.2.3"), std::string::npos) << text.output;
  const CommandResult two = RunCommand(Program("seastitch") + " info " + (dir / "*").string() +
                                       " --repair " + (dir / "c.lcmlog").string());
  EXPECT_EQ(two.exit_code, 64) << two.output;
}

// A message whose first 8 bytes are of no type that there is.
void WriteForeign(EventLogWriter* log, std::int64_t utime, const std::string& channel) {
  const std::vector<std::uint8_t> bytes(40, 0x11);
  log->Write(utime, channel, bytes.data(), bytes.size());
}

TEST(Info, NamesAChannelOfWhichNoEventCanBeReadAndGoesOn) {
  const TemporaryDir dir;
  const std::string path = (dir.path() / "a.lcmlog").string();
  {
    EventLogWriter log(path);
    WriteForeign(&log, 1, "IMU");
    WriteForeign(&log, 2, "SOMEBODY_ELSES");
    WriteForeign(&log, 3, "DEPTH");
    WriteDepth(&log, 4, 0);
  }
  const CommandResult text = RunCommand(Program("seastitch") + " info " + path);
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.output.find("IMU: fingerprint 1111111111111111, expected imu_t ("),
            std::string::npos)
      << text.output;
  EXPECT_EQ(text.output.find("DEPTH: fingerprint"), std::string::npos) << text.output;
  EXPECT_EQ(text.output.find("SOMEBODY_ELSES: "), std::string::npos) << text.output;
  const auto info = InfoOf(path);
  EXPECT_EQ(info["channels"]["DEPTH"]["undecodable"], 1);
  EXPECT_EQ(info["channels"]["SOMEBODY_ELSES"]["undecodable"], 0);
  ASSERT_EQ(info["unreadable"].size(), 1u);
  EXPECT_EQ(info["unreadable"][0]["channel"], "IMU");
  EXPECT_EQ(info["unreadable"][0]["expected"], "imu_t");
}

TEST(Info, RepairKeepsEveryWholeEventOfATornLog) {
  const TemporaryDir dir;
  const std::string path = (dir.path() / "a.lcmlog").string();
  {
    EventLogWriter log(path);
    for (int seq = 0; seq < 100; ++seq) WriteDepth(&log, 1'000'000 + seq, seq);
  }
  std::string bytes = TextOf(path);
  const std::size_t event_size = bytes.size() / 100;
  // One length that is wrong in the middle, half an event at the end.
  bytes[50 * event_size + 24] = '\x7f';
  bytes.resize(bytes.size() - event_size / 2);
  const std::string torn = dir.Write("torn.lcmlog", bytes);

  const std::string mended = (dir.path() / "mended.lcmlog").string();
  const CommandResult repair =
      RunCommand(Program("seastitch") + " info " + torn + " --repair " + mended);
  EXPECT_EQ(repair.exit_code, 0) << repair.output;
  EXPECT_EQ(InfoOf(torn)["torn_places"], 2);
  const auto info = InfoOf(mended);
  EXPECT_EQ(info["channels"]["DEPTH"]["events"], 98);
  EXPECT_EQ(info["damaged_bytes"], 0);
}

TEST(Help, EveryCommandHasAnExampleThatNamesIt) {
  const CommandResult all = RunCommand(Program("seastitch") + " help");
  EXPECT_EQ(all.exit_code, 0);
  std::istringstream lines(all.output.substr(all.output.find("Subcommands:")));
  int commands = 0;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string name;
    if (!line.starts_with("  ") || line.starts_with("   ") || !(words >> name)) continue;
    const CommandResult help = RunCommand(Program("seastitch") + " help " + name);
    EXPECT_EQ(help.exit_code, 0) << name;
    EXPECT_NE(help.output.find("Example:\n  seastitch " + name), std::string::npos) << help.output;
    ++commands;
  }
  EXPECT_GE(commands, 8);
}

TEST(Help, AnUnknownCommandNamesTheNearest) {
  for (const auto& [typed, meant] : {std::pair("relpay", "replay"), std::pair("inf", "info")}) {
    const CommandResult result = RunCommand(Program("seastitch") + " " + typed);
    EXPECT_EQ(result.exit_code, 64);
    EXPECT_NE(result.output.find(std::string("did you mean '") + meant + "'?"), std::string::npos)
        << result.output;
  }
  const CommandResult result = RunCommand(Program("seastitch") + " help photosynthesis");
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_EQ(result.output.find("did you mean"), std::string::npos) << result.output;
}

}  // namespace
}  // namespace seastitch
