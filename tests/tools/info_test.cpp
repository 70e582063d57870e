#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/storage/event_log.hpp"
#include "seastitch/depth_t.hpp"
#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/runtime/temporary_dir.hpp"

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
  EXPECT_EQ(depth["lost"], INT64_MAX);
  EXPECT_EQ(depth["clock_steps_back"], 1);
  EXPECT_GT(depth["longest_gap_s"].get<double>(), 9e12);
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
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const std::size_t event_size = bytes.size() / 100;
  // One length that is wrong in the middle, half an event at the end.
  bytes[50 * event_size + 24] = '\x7f';
  bytes.resize(bytes.size() - event_size / 2);
  const std::string torn = dir.Write("torn.lcmlog", bytes);

  const std::string mended = (dir.path() / "mended.lcmlog").string();
  const CommandResult repair =
      RunCommand(Program("seastitch") + " info " + torn + " --repair " + mended);
  EXPECT_EQ(repair.exit_code, 0) << repair.output;
  const auto info = InfoOf(mended);
  EXPECT_EQ(info["channels"]["DEPTH"]["events"], 98);
  EXPECT_EQ(info["damaged_bytes"], 0);
}

}  // namespace
}  // namespace seastitch
