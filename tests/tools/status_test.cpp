#include "tools/vehicle/status.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/ioctl.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "common/core/health/conditions.hpp"
#include "common/core/pose.hpp"
#include "tests/drivers/driver_process.hpp"

namespace seastitch {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr std::int64_t kNow = 1'763'806'500'000'000;  // 2025-11-22T10:15:00Z

counter_t Counter(const std::string& name, std::int64_t value) {
  counter_t counter{};
  counter.name = name;
  counter.value = value;
  return counter;
}

health_t Ok(const std::string& process) {
  health_t health{};
  health.process = process;
  health.state = health_t::STATE_OK;
  health.text = "all is well with " + process;
  return health;
}

std::string LineOf(const std::vector<std::string>& lines, const std::string& process) {
  for (const std::string& line : lines)
    if (line.starts_with(process + " ")) return line;
  return "";
}

TEST(Status, HasOneLineAProcessAndNoneIsWider) {
  ProcessRoll roll;
  for (const char* process : kProcesses) {
    health_t health = Ok(process);
    health.text += " " + std::string(300, 'x') + "\x1b[31m\n";
    health.counters = {Counter("socket_drops", 1200), Counter("events_dropped", 34)};
    health.rate_names = {"imu", "can_frames"};
    health.rate_hz = {100.2, 1234.0};
    roll.Add(health, 1.0);
  }
  for (const std::size_t columns : {40, 80, 200}) {
    const auto lines = StatusLines({roll, {}, 2.0, kNow}, columns);
    EXPECT_EQ(lines.size(), 2 + kProcesses.size());
    for (const std::string& line : lines) {
      EXPECT_LE(line.size(), columns);
      EXPECT_EQ(line.find('\x1b'), std::string::npos);
    }
  }
  EXPECT_THAT(LineOf(StatusLines({roll, {}, 2.0, kNow}, 80), "mapper"),
              AllOf(StartsWith("mapper       ok        1234  imu 100, can_fram...  "),
                    HasSubstr("  all is well with mapper")));
  EXPECT_TRUE(AllOk(roll, 2.0));
}

TEST(Status, SaysTheDiveAndTheDisk) {
  ProcessRoll roll;
  EXPECT_THAT(StatusLines({roll, {}, 1.0, kNow}, 80).front(),
              StartsWith("10:15:00 UTC  no dive is recorded: no logger"));
  health_t logger = Ok("logger");
  logger.counters = {Counter("disk_free_mb", 12'345),
                     Counter("dive_start_utime", kNow - 8'100'000'000)};
  roll.Add(logger, 1.0);
  EXPECT_EQ(StatusLines({roll, {}, 1.0, kNow}, 100).front(),
            "10:15:00 UTC  dive since 2025-11-22 08:00:00 (2 h 15 min), 12.3 GB of disk left");
  EXPECT_LE(StatusLines({roll, {}, 1.0, kNow}, 80).front().size(), 80u);
}

TEST(Status, SaysWhereTheVehicleIs) {
  nav_corrected_t nav{};
  nav.p_map_vehicle_m[0] = 120.04;
  nav.p_map_vehicle_m[1] = -35.5;
  nav.p_map_vehicle_m[2] = 12.3;
  nav.q_map_vehicle[0] = std::cos(-kPi / 4.0);
  nav.q_map_vehicle[3] = std::sin(-kPi / 4.0);
  nav.v_map_mps[1] = -1.5;
  nav.covariance_ned_rpy[0][0] = 0.09;
  nav.covariance_ned_rpy[1][1] = 0.16;
  const VehiclePlace place = PlaceOf(nav, 11.0);
  EXPECT_EQ(VehicleLine(place),
            "vehicle: north 120.0 m, east -35.5 m of the map origin (1 sigma 0.5 m), depth 12.3 m, "
            "altitude 11.0 m, heading 270.0 deg, 1.50 m/s");
  EXPECT_THAT(VehicleLine(PlaceOf(nav, std::nullopt)), Not(HasSubstr("altitude")));
  const auto lines = StatusLines({ProcessRoll(), place, 1.0, kNow}, 80);
  EXPECT_THAT(lines[1], StartsWith("vehicle: north 120.0 m"));
  EXPECT_LE(lines[1].size(), 80u);
}

TEST(Status, NamesFaultsWithWhatToDo) {
  ProcessRoll roll;
  for (const char* process : kProcesses) roll.Add(Ok(process), 9.5);
  health_t dvl = Ok("dvl-driver");
  dvl.seq = 1;
  dvl.state = health_t::STATE_LOST;
  condition_t silent{};
  silent.name = conditions::kNoDeviceData.name;
  silent.sentence = "no usable data from the device: for 7 s";
  dvl.conditions = {silent};
  dvl.text = silent.sentence + "; can:can0";
  roll.Add(dvl, 9.9);
  const auto lines = StatusLines({roll, {}, 10.0, kNow}, 80);
  EXPECT_THAT(LineOf(lines, "dvl-driver"), ContainsRegex("^dvl-driver   lost .*no usable data"));
  EXPECT_THAT(lines, testing::Contains("dvl-driver: no usable data from the device: for 7 s"));
  EXPECT_THAT(lines, testing::Contains(StartsWith("    Check its power, its cable")));
  EXPECT_FALSE(AllOk(roll, 10.0));
}

TEST(Status, IsSaidToProgramsToo) {
  ProcessRoll roll;
  for (const char* process : kProcesses) roll.Add(Ok(process), 9.5);
  health_t logger = Ok("logger");
  logger.seq = 1;
  logger.counters = {Counter("disk_free_mb", 12'345), Counter("dive_start_utime", kNow - 1000)};
  condition_t full{};
  full.name = conditions::kDiskSpaceLow.name;
  full.sentence = "the disk \xff is full \x1b[31m";
  logger.conditions = {full};
  logger.state = health_t::STATE_DEGRADED;
  logger.rate_names = {"events"};
  logger.rate_hz = {120.0};
  roll.Add(logger, 9.9);
  VehiclePlace place;
  place.north_m = 120.0;
  place.sigma_m = 0.5;
  const auto json = nlohmann::json::parse(StatusJson({roll, place, 10.0, kNow}));
  EXPECT_EQ(json["utime"], kNow);
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["dive"]["start_utime"], kNow - 1000);
  EXPECT_EQ(json["dive"]["disk_free_mb"], 12'345);
  EXPECT_EQ(json["vehicle"]["north_m"], 120.0);
  EXPECT_EQ(json["vehicle"]["sigma_m"], 0.5);
  EXPECT_TRUE(json["vehicle"]["altitude_m"].is_null());
  ASSERT_EQ(json["processes"].size(), kProcesses.size());
  const auto& last = json["processes"].back();
  EXPECT_EQ(last["name"], "logger");
  EXPECT_EQ(last["state"], "degraded");
  EXPECT_EQ(last["rates_hz"]["events"], 120.0);
  EXPECT_EQ(last["conditions"][0]["name"], "disk_space_low");
  EXPECT_EQ(last["conditions"][0]["remedy"], conditions::kDiskSpaceLow.remedy);

  const auto silent = nlohmann::json::parse(StatusJson({ProcessRoll(), {}, 10.0, kNow}));
  EXPECT_TRUE(silent["vehicle"].is_null() && silent["dive"].is_null());
  EXPECT_EQ(silent["processes"][0]["state"], "silent");
}

TEST(Status, NamesASilentProcessAndASecondOne) {
  ProcessRoll roll;
  roll.Add(Ok("imu-driver"), 1.0);
  for (int i = 0; i < 3; ++i)
    for (const std::int64_t start : {0, 500}) {
      health_t mapper = Ok("mapper");
      mapper.seq = start + i;
      roll.Add(mapper, 6.0 + i);
    }
  const auto lines = StatusLines({roll, {}, 8.0, kNow}, 80);
  EXPECT_THAT(LineOf(lines, "imu-driver"), ContainsRegex("silent .* not heard for 7 s"));
  EXPECT_THAT(LineOf(lines, "dvl-driver"), ContainsRegex("- .* not heard"));
  EXPECT_THAT(LineOf(lines, "mapper"), HasSubstr("runs twice; "));
}

// `seastitch status` beside real processes.
class StatusCommand : public DriverProcess {
 protected:
  std::unique_ptr<Process> StartStatus(const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{"status", "--lcm-url", lcm_url};
    args.insert(args.end(), more.begin(), more.end());
    return std::make_unique<Process>(
        Program("seastitch"), args, (dir.path() / "status.txt").string());
  }
  const std::string source = "udp:127.0.0.1:" + std::to_string(FreeUdpPort());
};

TEST_F(StatusCommand, IsPlainWhereTheOutputIsNoTerminal) {
  if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
  std::filesystem::create_directory(dir.path() / "dives");
  const auto logger = Start("seastitch-logger", dir.Write("logger.yaml", "dives_dir: dives\n"));
  const auto mbes = Start("seastitch-mbes-driver", WithSource(dir, "mbes_driver.yaml", source));
  int heard = 0;
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t&) { ++heard; });
  ASSERT_TRUE(HandleUntil([&] { return heard >= 2; }, 20'000)) << logger->Output();
  const auto status = StartStatus();
  EXPECT_EQ(status->Wait(), EXIT_FAILURE) << "not all are there";
  const std::string shown = status->Output();
  EXPECT_THAT(shown, ContainsRegex("UTC  dive since 2.* \\(0 h 00 min\\), .* GB of disk left\n"));
  EXPECT_THAT(shown, ContainsRegex("\nlogger       ok "));
  EXPECT_THAT(shown, ContainsRegex("\nmbes-driver  starting .*" + source.substr(0, 10)));
  EXPECT_THAT(shown, ContainsRegex("\nmapper       -  .*not heard\n"));
  EXPECT_THAT(shown, Not(HasSubstr("\x1b")));
  EXPECT_EQ(logger->Stop(), EXIT_SUCCESS) << logger->Output();
}

// A terminal of 80 columns: it refreshes until Ctrl-C, and gives the screen back.
TEST_F(StatusCommand, RefreshesInATerminal) {
  if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
  const auto mbes = Start("seastitch-mbes-driver", WithSource(dir, "mbes_driver.yaml", source));
  winsize size{};
  size.ws_col = 80;
  size.ws_row = 24;
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    const std::string program = Program("seastitch");
    execl(program.c_str(), program.c_str(), "status", "--lcm-url", lcm_url.c_str(), nullptr);
    _exit(127);
  }
  ASSERT_GT(child, 0);
  std::string shown;
  const auto read_until = [&](const auto& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    char bytes[4096];
    while (!done() && std::chrono::steady_clock::now() < end && WaitReadable(terminal)) {
      const ssize_t got = read(terminal, bytes, sizeof bytes);
      if (got <= 0) break;
      shown.append(bytes, static_cast<std::size_t>(got));
    }
    return done();
  };
  const auto screens = [&] {
    std::size_t n = 0;
    for (std::size_t at = 0; (at = shown.find("\x1b[H", at)) != std::string::npos; ++at) ++n;
    return n;
  };
  EXPECT_TRUE(read_until([&] { return shown.find("udp:127") != std::string::npos; })) << shown;
  const std::size_t before = screens();
  EXPECT_TRUE(read_until([&] { return screens() > before + 1; })) << shown;
  const std::regex escape("\x1b\\[[?0-9]*[a-zA-Z]");
  std::istringstream lines(std::regex_replace(shown, escape, ""));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 81u) << line;  // \r
  EXPECT_EQ(write(terminal, "\x03", 1), 1);
  EXPECT_TRUE(read_until([&] { return shown.find("\x1b[?1049l") != std::string::npos; })) << shown;
  int code = 0;
  ASSERT_EQ(waitpid(child, &code, 0), child);
  EXPECT_TRUE(WIFEXITED(code));
  close(terminal);
}

}  // namespace
}  // namespace seastitch
