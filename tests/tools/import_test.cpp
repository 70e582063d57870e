#include "tools/import.hpp"
#include "tests/support/paths.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "codecs/kongsberg/kmall.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "common/storage/event_log.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/socket/candump.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "survey/errors.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000;

ImportOptions Options(const TemporaryDir& dir, std::vector<std::filesystem::path> files) {
  ImportOptions options;
  options.files = std::move(files);
  options.log = dir.path() / "out.lcmlog";
  options.imu_config = ConfigFile("imu_driver.yaml");
  options.dvl_config = ConfigFile("dvl_driver.yaml");
  options.quiet = true;
  return options;
}

// Ten pings, 100 ms apart, and a profile before them.
std::string KmallBytes() {
  std::string bytes;
  const auto add = [&bytes](const std::vector<std::uint8_t>& d) {
    bytes.append(d.begin(), d.end());
  };
  SoundVelocityProfile profile{FromUtime(kStart), {0.0, 10.0}, {1500.0, 1495.0}};
  add(EncodeSvp(profile, KmallHeader{}));
  for (int i = 0; i < 10; ++i) {
    MbesPing ping;
    ping.time = FromUtime(kStart + 100'000 * i);
    ping.ping_number = static_cast<std::uint32_t>(i);
    ping.sound_speed_mps = 1500.0;
    ping.beams.resize(50, {0.05f, 0.1f, 0, 0, 0, -20, kBeamValid | kBeamPhase});
    add(EncodeMrz(ping, KmallHeader{}));
  }
  return bytes;
}

// A second of an inertial unit and a Doppler log on one bus, with frames of a stranger.
std::string CandumpText() {
  const ImuDriverConfig imu = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  const DvlDriverConfig dvl = LoadDvlDriverConfig(ConfigFile("dvl_driver.yaml"));
  ImuCanEncoder imu_encoder(imu.can.signals, FromUtime(kStart - 1'000'000));
  const DvlCanEncoder dvl_encoder(dvl.can.signals);
  std::string text;
  for (int i = 0; i < 100; ++i) {
    const Time time = FromUtime(kStart + 10'000 * i);
    ImuSample sample;
    sample.time = time;
    sample.specific_force_mps2 = {0.0, 0.0, -9.81};
    sample.attitude.emplace().sigma_rpy_rad = {0.001, 0.001, 0.01};
    std::vector<CanFrame> frames = imu_encoder.Encode(sample);
    if (i % 20 == 0) {
      DvlSample velocity;
      velocity.time = time;
      velocity.bottom_lock = true;
      velocity.sigma_v_mps.setConstant(0.005);
      DepthSample depth{time, 0.0, 20.0, 0.02};
      for (const CanFrame& frame : dvl_encoder.Encode(velocity, depth)) frames.push_back(frame);
    }
    CanFrame stranger;
    stranger.id = 0x7FF;
    frames.push_back(stranger);
    for (std::size_t k = 0; k < frames.size(); ++k)
      text += FormatCandumpLine(
                  {time + Duration(2000 + 100 * static_cast<int>(k)), "can0", frames[k]}) +
              "\n";
  }
  return text;
}

std::vector<LogEvent> Events(const std::filesystem::path& log) {
  EventLogReader reader(log);
  std::vector<LogEvent> events;
  while (std::optional<LogEvent> event = reader.Next()) events.push_back(std::move(*event));
  EXPECT_EQ(reader.damaged_bytes(), 0);
  return events;
}

TEST(Import, KmallAndCandumpBecomeOneLogInTheOrderOfTheirStamps) {
  const TemporaryDir dir;
  const std::string kmall = dir.Write("a.kmall", KmallBytes());
  const std::string candump = dir.Write("a.log", CandumpText());
  const ImportOptions options = Options(dir, {candump, kmall});
  const ImportResult result = Import(options);
  EXPECT_EQ(result.channels.at("MBES_PING"), 10);
  EXPECT_EQ(result.channels.at("SVP"), 1);
  EXPECT_EQ(result.channels.at("RAW_MBES"), 11);
  EXPECT_EQ(result.channels.at("IMU"), 100);
  EXPECT_EQ(result.channels.at("DVL"), 5);
  EXPECT_EQ(result.channels.at("DEPTH"), 5);
  EXPECT_TRUE(result.counters.empty());

  std::int64_t last = 0;
  std::int64_t imus = 0;
  std::int64_t pings = 0;
  for (const LogEvent& event : Events(options.log)) {
    EXPECT_GE(event.utime, last);
    last = event.utime;
    const int size = static_cast<int>(event.data.size());
    if (event.channel == "IMU") {
      imu_t msg{};
      ASSERT_EQ(msg.decode(event.data.data(), 0, size), size);
      EXPECT_EQ(msg.seq, imus);
      EXPECT_EQ(msg.utime, kStart + 10'000 * imus++);
    } else if (event.channel == "MBES_PING") {
      mbes_ping_t msg{};
      ASSERT_EQ(msg.decode(event.data.data(), 0, size), size);
      EXPECT_EQ(msg.seq, pings);
      EXPECT_EQ(msg.utime, kStart + 100'000 * pings++);
    }
  }
  EXPECT_EQ(imus, 100);
  EXPECT_EQ(pings, 10);
}

TEST(Import, DamageIsCountedAndSkipped) {
  const TemporaryDir dir;
  std::string bytes = KmallBytes();
  bytes.insert(bytes.size() / 2, "rubbish in the middle of a ping");
  bytes.resize(bytes.size() - 7);
  const std::string text = "(1700000000.0 can0 not a frame\n" + CandumpText();
  const ImportResult result =
      Import(Options(dir, {dir.Write("a.kmall", bytes), dir.Write("a.log", text)}));
  EXPECT_EQ(result.channels.at("MBES_PING"), 8);
  EXPECT_GT(result.counters.at("kmall_file_damaged_bytes"), 0);
  EXPECT_EQ(result.counters.at("candump_malformed"), 1);
  EXPECT_EQ(result.channels.at("IMU"), 100);
}

// Nothing usable is no success, and leaves no log behind.
TEST(Import, ALogWithoutAUsableLineIsRefused) {
  const TemporaryDir dir;
  for (const std::string text :
       {"(what) can0 121#00\n", "  can0  110   [8]  00 00 00 00 50 B6 99 14\n"}) {
    const ImportOptions options = Options(dir, {dir.Write("a.log", text)});
    EXPECT_THROW(Import(options), DataError) << text;
    EXPECT_FALSE(std::filesystem::exists(options.log));
  }
}

// candump -tz: its times count from its start.
TEST(Import, TimesThatDoNotMeetAreRefused) {
  const TemporaryDir dir;
  const ImportOptions options =
      Options(dir,
              {dir.Write("a.kmall", KmallBytes()),
               dir.Write("z.log", "(0.001000) can0 110#0000000050B69914\n")});
  EXPECT_THAT([&] { Import(options); },
              testing::ThrowsMessage<DataError>(testing::HasSubstr("z.log begins at 1970-01-01")));
  EXPECT_FALSE(std::filesystem::exists(options.log));
}

TEST(Import, ARealFile) {
  const std::filesystem::path file = Shared("data/mbes/em2040_OS01.kmall");
  SKIP_WITHOUT(file);
  const TemporaryDir dir;
  const ImportResult result = Import(Options(dir, {file}));
  EXPECT_EQ(result.channels.at("MBES_PING"), 5);
  EXPECT_EQ(result.counters.at("kmall_ping_empty"), 1);  // the sixth
  EXPECT_GT(result.channels.at("INS"), 200);
  EXPECT_EQ(result.channels.at("SVP"), 1);
  EXPECT_FALSE(result.counters.contains("kmall_malformed"));
  EXPECT_FALSE(result.counters.contains("kmall_file_damaged_bytes"));
}

// No half log is left where the disk is full, here by a limit of the size of files.
TEST(Import, AFullDiskIsNamedAndLeavesNoLog) {
  const TemporaryDir dir;
  std::string lines;
  for (int i = 0; i < 20; ++i) lines += CandumpText();
  const std::string input = dir.Write("a.log", lines);
  const std::string full = "trap '' XFSZ; ulimit -f 64; exec " + Program("seastitch");
  const std::string log = (dir.path() / "out.lcmlog").string();
  for (const std::string& command :
       {" import " + input + " --log " + log,
        " bench --survey " + ConfigFile("bench/short.yaml") + " --log " + log}) {
    const CommandResult result = RunCommand(full + command);
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_THAT(result.output, testing::HasSubstr("File too large"));
    EXPECT_FALSE(std::filesystem::exists(log)) << command;
  }
}

TEST(Import, CommandNamesTheFileItCannotUseAndKeepsLogs) {
  const TemporaryDir dir;
  const std::string text =
      dir.Write("a.txt", "no log of any kind, and long enough to be looked at");
  const std::string log = (dir.path() / "out.lcmlog").string();
  const CommandResult wrong =
      RunCommand(Program("seastitch") + " import " + text + " --log " + log);
  EXPECT_NE(wrong.exit_code, 0);
  EXPECT_NE(wrong.output.find(text + ": neither a survey file nor a candump log"),
            std::string::npos)
      << wrong.output;

  const std::string kmall = dir.Write("a.kmall", KmallBytes());
  const std::string other = (dir.path() / "other.lcmlog").string();
  const std::string command = Program("seastitch") + " import --quiet " + kmall + " --log " + other;
  const CommandResult first = RunCommand(command);
  EXPECT_EQ(first.exit_code, 0) << first.output;
  EXPECT_NE(first.output.find("MBES_PING"), std::string::npos) << first.output;
  EXPECT_NE(RunCommand(command).exit_code, 0);  // the log is there already
}

}  // namespace
}  // namespace seastitch
