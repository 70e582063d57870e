// The doctor beside real processes, real sensors' bytes and a real bus: a vehicle without a fault,
// then one fault after the other.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "drivers/socket/file_descriptor.hpp"
#include "drivers/socket/udp_socket.hpp"
#include "seastitch/health_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/support/files.hpp"
#include "tests/support/run_command.hpp"
#include "tests/survey/short_survey.hpp"
#include "tools/vehicle/doctor.hpp"
#include "tools/vehicle/machine_checks.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

void Replace(const fs::path& file, const std::string& from, const std::string& to) {
  std::string content = TextOf(file);
  const std::size_t at = content.find(from);
  ASSERT_NE(at, std::string::npos) << file << ": " << from;
  content.replace(at, from.size(), to);
  std::ofstream(file) << content;
}

const std::string kSource = "source: \"";
const std::string kCan = kSource + "can:can0";
std::string Udp(int port) { return "udp:127.0.0.1:" + std::to_string(port); }
std::string Target(int port) { return "127.0.0.1:" + std::to_string(port); }

// A computer without a fault, but for what is real: network, disk, processes.
Machine GoodMachine(const TemporaryDir& dir) {
  Machine machine;
  machine.proc = dir.path() / "proc";
  fs::create_directories(machine.proc / "77");
  dir.Write("proc/loadavg", "0.00 0.00 0.00 1/100 12\n");
  dir.Write("proc/meminfo", "MemTotal: 2097152 kB\nMemAvailable: 1048576 kB\n");
  dir.Write("proc/77/comm", "chronyd\n");
  machine.clock = [] { return ClockState{.synchronised = true, .error_s = 0.001}; };
  machine.filter = [](const auto&) { return FilterState{.programs = 1}; };
  const auto really = machine.run;
  machine.run = [really](const std::vector<std::string>& command) -> std::optional<std::string> {
    if (command.front() != "systemctl") return really(command);
    std::string units;
    for (const std::string& word : command)
      units += "Id=" + word +
               "\nControlGroup=/unit\nIPAddressDeny=::/0 0.0.0.0/0\n"
               "IPAddressAllow=239.255.76.67/32 ::1/128 127.0.0.0/8\n\n";
    return std::optional(units);
  };
  return machine;
}

// The six processes and the bench, each with its own output.
class DoctorVehicle : public DriverProcess {
 protected:
  // Whether it can be had here.
  bool Launch() {
    if (!OpenBus() || Worst(CheckRoute(Machine{}, lcm_url)) != Finding::Level::kOk) return false;
    fs::copy(ConfigFile(""), config, fs::copy_options::recursive);
    Replace(config / "imu_driver.yaml", kCan, kSource + Udp(imu_port));
    Replace(config / "dvl_driver.yaml", kCan, kSource + Udp(dvl_port));
    Replace(
        config / "mbes_driver.yaml", kSource + "udp:224.1.20.40:6020", kSource + Udp(mbes_port));
    std::ofstream(config / "bench/short.yaml")
        << ShortSurveyUnderWater() << "position_fixes: {interval_s: 2.0}\n";
    Replace(config / "bench/short.yaml", "lines: 3", "lines: 30");
    options.config_dir = config;
    options.lcm_url = lcm_url;
    options.under_water = true;
    for (const char* name : kProcesses) StartOne(name);
    StartBench({"--epoch", "now"});
    bus->Subscribe<health_t>(
        "HEALTH", 0, [this](const health_t& msg) { states[msg.process] = msg.state; });
    return true;
  }
  void StartBench(const std::vector<std::string>& more) {
    std::vector<std::string> args{"bench", "--survey", (config / "bench/short.yaml").string()};
    args.insert(args.end(), {"--config-dir", config.string(), "--lcm-url", lcm_url});
    args.insert(args.end(), {"--imu", Target(imu_port), "--dvl", Target(dvl_port)});
    args.insert(args.end(), {"--mbes", Target(mbes_port)});
    args.insert(args.end(), more.begin(), more.end());
    bench.reset();
    bench =
        std::make_unique<Process>(Program("seastitch"), args, (dir.path() / "bench.txt").string());
  }
  void StartOne(const std::string& name) {
    std::string file = name + ".yaml";
    std::replace(file.begin(), file.end(), '-', '_');
    processes[name] = Start("seastitch-" + name, (config / file).string());
  }
  void Stop(const std::string& name) {
    EXPECT_EQ(processes.at(name)->Stop(), EXIT_SUCCESS) << processes.at(name)->Output();
    states.erase(name);
  }
  bool AllBecomeOk() {
    return HandleUntil(
        [this] {
          return std::all_of(kProcesses.begin(), kProcesses.end(), [this](const char* name) {
            const auto found = states.find(name);
            return found != states.end() && found->second == health_t::STATE_OK;
          });
        },
        90'000);
  }
  // What is not ok, but for what this machine may be too busy for: "CHECK: TEXT".
  // Not at once after the last look: a process says its configuration once in 10 s.
  // consequences: what the mapper says of the fault, sooner or later.
  std::vector<std::string> Alarms(const std::vector<std::string>& consequences = {}) {
    HandleUntil([] { return false; }, 2'000);
    std::vector<std::string> alarms;
    for (const Finding& finding : Examine(options, machine).findings) {
      const bool load =
          finding.text.find("event loop was busy") != std::string::npos ||
          finding.text.find("kernel dropped datagrams") != std::string::npos ||
          finding.text.find("messages are missing in the log") != std::string::npos ||
          finding.text.find("writing to the disk takes too long") != std::string::npos ||
          finding.check == "disk_speed";
      const bool follows = std::any_of(
          consequences.begin(), consequences.end(), [&](const std::string& consequence) {
            return finding.text.find(consequence) != std::string::npos;
          });
      if (finding.level != Finding::Level::kOk && !load && !follows)
        alarms.push_back(finding.check + ": " + finding.text);
    }
    while (WaitReadable(bus->fd(), 0)) bus->HandleReady();
    return alarms;
  }

  const int imu_port = FreeUdpPort(), dvl_port = FreeUdpPort(), mbes_port = FreeUdpPort();
  const fs::path config = dir.path() / "config";
  DoctorOptions options;
  Machine machine = GoodMachine(dir);
  std::map<std::string, std::unique_ptr<Process>> processes;
  std::map<std::string, std::int8_t> states;
  std::unique_ptr<Process> bench;
};

TEST_F(DoctorVehicle, NamesEachFaultAndGivesNoFalseAlarm) {
  if (!Launch()) GTEST_SKIP() << "needs a network of its own, with a multicast route by lo";
  ASSERT_TRUE(AllBecomeOk()) << processes["mapper"]->Output();
  EXPECT_THAT(Alarms(), IsEmpty()) << "nothing is wrong";

  options.under_water = false;
  EXPECT_THAT(Alarms(), testing::ElementsAre(HasSubstr("value: depth, at the surface: ")));
  options.under_water = true;

  const std::string optimizer = (config / "optimizer.yaml").string();
  fs::copy_file(optimizer, optimizer + ".right");
  Replace(optimizer, "max_iterations: ", "max_iterations: 1");
  EXPECT_THAT(Alarms(),
              testing::ElementsAre("running_configuration: optimizer: runs with another "
                                   "optimizer.yaml than the file's"));
  std::ofstream(optimizer, std::ios::app) << "no_such_key: 1\n";
  EXPECT_THAT(Alarms(),
              testing::ElementsAre(HasSubstr("optimizer.yaml: no_such_key: unknown key")));
  fs::rename(optimizer + ".right", optimizer);

  {
    std::atomic<bool> stop = false;
    std::thread other([&] {
      Bus planner(lcm_url);
      health_t health{};
      health.process = "planner";
      health.version = "9.9";
      for (; !stop; ++health.seq) {
        planner.Publish("HEALTH", health);
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
      }
    });
    EXPECT_THAT(Alarms(),
                testing::ElementsAre(
                    testing::AllOf(HasSubstr("versions differ: "), HasSubstr("9.9 (planner)"))));
    stop = true;
    other.join();
  }

  Stop("optimizer");
  EXPECT_THAT(Alarms({"mapper: the newest graph is not solved",
                      "mapper: a process that was there is silent: optimizer"}),
              testing::ElementsAre("process: optimizer: not heard"));
  StartOne("optimizer");
  ASSERT_TRUE(AllBecomeOk());

  Stop("mbes-driver");
  {
    const UdpSocket occupant(Udp(mbes_port), 65'536);
    const auto alarms = Alarms({"mapper: a sensor that was there is silent: MBES_PING",
                                "mapper: a process that was there is silent: mbes-driver"});
    EXPECT_THAT(alarms, Contains(HasSubstr("of mbes-driver: Address already in use")));
    EXPECT_THAT(alarms, Contains("process: mbes-driver: not heard"));
    EXPECT_THAT(alarms, Contains("sensor: MBES_PING: not heard"));
    EXPECT_EQ(alarms.size(), 3u) << testing::PrintToString(alarms);
  }
  StartOne("mbes-driver");

  ASSERT_TRUE(AllBecomeOk());
  EXPECT_THAT(Alarms(), IsEmpty()) << "everything was mended";

  // What follows disturbs the survey: the doctor says more than the cause.
  Replace(config / "logger.yaml", "dives_dir: ../dives", "dives_dir: ../elsewhere");
  EXPECT_THAT(Alarms(), Contains(HasSubstr("one dive becomes two folders")));
  Replace(config / "logger.yaml", "dives_dir: ../elsewhere", "dives_dir: ../dives");

  fs::create_directory(dir.path() / "second");
  fs::copy(config, dir.path() / "second/config", fs::copy_options::recursive);
  {
    const auto second =
        Start("seastitch-mapper", (dir.path() / "second/config/mapper.yaml").string());
    EXPECT_TRUE(HandleUntil([&] { return fs::exists(dir.path() / "second/dives"); }, 20'000));
    EXPECT_THAT(Alarms(), Contains("process_twice: mapper: runs twice"));
    EXPECT_EQ(second->Stop(), EXIT_SUCCESS) << second->Output();
  }

  bench->Stop();
  const auto alarms = Alarms();
  for (const char* sensor : {"IMU", "DVL", "DEPTH", "MBES_PING"})
    EXPECT_THAT(alarms, Contains("sensor: " + std::string(sensor) + ": not heard"));
}

// Stamps of a device whose clock nobody disciplines.
TEST_F(DoctorVehicle, NamesASensorWhoseClockIsOff) {
  if (!Launch()) GTEST_SKIP() << "needs a network of its own, with a multicast route by lo";
  StartBench({});
  ASSERT_TRUE(HandleUntil([&] { return states["mbes-driver"] == health_t::STATE_OK; }, 60'000));
  EXPECT_THAT(Alarms(),
              Contains(testing::ContainsRegex("sensor: IMU: .* stamps .* behind receipt")));
}

TEST_F(DoctorVehicle, IsPackedIntoABugReport) {
  if (!Launch()) GTEST_SKIP() << "needs a network of its own, with a multicast route by lo";
  ASSERT_TRUE(HandleUntil([&] { return states.size() == kProcesses.size(); }, 60'000));
  EXPECT_EQ(processes.at("imu-driver")->Stop(SIGKILL), -SIGKILL);
  // They said their configurations as they started: the next time in 10 s.
  HandleUntil([] { return false; }, 12'000);
  const std::string file = (dir.path() / "report.tar.gz").string();
  const std::string command = Program("seastitch") + " bug-report --config-dir " + config.string() +
                              " --lcm-url '" + lcm_url + "' --out " + file;
  const CommandResult made = RunCommand(command);
  ASSERT_EQ(made.exit_code, 0) << made.output;
  ASSERT_EQ(RunCommand("tar -C " + dir.path().string() + " -xzf " + file +
                       " --transform=s,^[^/]*,report,")
                .exit_code,
            0);
  const fs::path report = dir.path() / "report";
  for (const char* name : {"versions.txt",
                           "doctor.txt",
                           "machine.txt",
                           "systemd.txt",
                           "journal.txt",
                           "config/mapper.yaml",
                           "config/sbg_ecan.dbc",
                           "running/mapper/vehicle.yaml",
                           "running/optimizer/optimizer.yaml"})
    EXPECT_GT(fs::file_size(report / name), 10u) << name;
  EXPECT_FALSE(fs::is_empty(report / "dives"));
  std::ifstream in(report / "health.json");
  const auto health = nlohmann::json::parse(in);
  for (const char* process : kProcesses) EXPECT_FALSE(health[process]["text"].empty()) << process;
  EXPECT_EQ(health["mapper"]["from"], "bus");
  EXPECT_THAT(health["imu-driver"]["from"], HasSubstr("/log/000.lcmlog")) << "the one that died";
  const std::string versions = TextOf(report / "versions.txt");
  EXPECT_THAT(versions, HasSubstr("\nliblcm1")) << "no package has the name linux-image-*";
  EXPECT_THAT(versions, HasSubstr("(exit status 1)"));
  const CommandResult again = RunCommand(command);
  EXPECT_EQ(again.exit_code, EXIT_FAILURE);
  EXPECT_THAT(again.output, HasSubstr("report.tar.gz: exists already"));
}

struct DoctorCommand : testing::Test {
  // `seastitch doctor --json` in a shell with commands before it.
  nlohmann::json Run(const std::string& unshare,
                     const std::string& before,
                     const std::string& as_user = "") {
    result = RunCommand("unshare " + unshare + " sh -c '" + before + " exec " + as_user +
                        Program("seastitch") + " doctor --json --config-dir " +
                        (dir.path() / "config").string() +
                        " --lcm-url udpm://239.255.76.67:7822?ttl=0 2>/dev/null'");
    return nlohmann::json::parse(result.output, nullptr, false);
  }
  std::string TextOf(const nlohmann::json& json, const std::string& check) {
    if (json.is_discarded()) return "";
    for (const auto& finding : json["checks"])
      if (finding["check"] == check)
        return finding["level"].get<std::string>() + " " + finding["text"].get<std::string>();
    return "";
  }
  void SetUp() override {
    fs::copy(ConfigFile(""), dir.path() / "config", fs::copy_options::recursive);
  }
  const TemporaryDir dir;
  CommandResult result;
};

TEST_F(DoctorCommand, NamesAMissingRouteAndCanInterface) {
  const auto json = Run("--net", "ip link set lo up;");
  if (json.is_discarded()) GTEST_SKIP() << "unshare --net is not allowed here: " << result.output;
  EXPECT_EQ(TextOf(json, "lcm_route"), "error route of LCM's group 239.255.76.67: none");
  EXPECT_THAT(TextOf(json, "lcm_loopback"), HasSubstr("error LCM: "));
  EXPECT_EQ(TextOf(json, "can_interface"), "error CAN can0: no such interface");
  EXPECT_EQ(json["result"], "error");
  EXPECT_EQ(result.exit_code, 2);
}

TEST_F(DoctorCommand, NamesARouteToTheSensorsNetworkAndAnInterfaceThatIsDown) {
  const auto json = Run("--net",
                        "ip link set lo up; ip link add can0 type dummy; ip link add eth7 type "
                        "dummy; ip link set eth7 up; ip address add 10.9.8.7/24 dev eth7; ip route "
                        "add 224.0.0.0/4 dev eth7;");
  if (json.is_discarded() || TextOf(json, "can_interface").find("no such") != std::string::npos)
    GTEST_SKIP() << "no dummy interface can be made here: " << result.output;
  EXPECT_EQ(
      TextOf(json, "lcm_route"),
      "error route of LCM's group 239.255.76.67: by eth7, source 10.9.8.7: what the processes "
      "say leaves the computer");
  EXPECT_EQ(TextOf(json, "can_interface"), "error CAN can0: down");
}

TEST_F(DoctorCommand, SaysToAPlainUserWhatNeedsMoreRights) {
  const fs::path hidden = dir.path() / "hidden";
  fs::create_directories(hidden / "dives");
  fs::permissions(dir.path(),
                  fs::perms::owner_all | fs::perms::others_read | fs::perms::others_exec);
  fs::permissions(hidden, fs::perms::owner_all);
  Replace(dir.path() / "config/logger.yaml",
          "dives_dir: ../dives",
          "dives_dir: " + hidden.string() + "/dives");
  const auto json = Run("--net",
                        "ip link set lo up; ip route add 239.255.76.67/32 dev lo;",
                        "setpriv --reuid 65534 --regid 65534 --clear-groups ");
  if (json.is_discarded()) GTEST_SKIP() << "no other user can be had here: " << result.output;
  EXPECT_EQ(TextOf(json, "disk_free"),
            "warning folder of the dives: " + hidden.string() + "/dives: Permission denied");
}

// A disk of which every access hangs: a FUSE file system that nobody serves.
class HungDisk {
 public:
  explicit HungDisk(const fs::path& folder) : folder_(folder) {
    fs::create_directory(folder_);
    fuse_ = FileDescriptor(open("/dev/fuse", O_RDWR | O_CLOEXEC));
    const std::string options =
        "fd=" + std::to_string(fuse_.get()) + ",rootmode=40000,user_id=0,group_id=0";
    mounted_ = mount("hung", folder_.c_str(), "fuse", 0, options.c_str()) == 0;
  }
  ~HungDisk() {
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  HungDisk(const HungDisk&) = delete;
  HungDisk& operator=(const HungDisk&) = delete;
  bool mounted() const { return mounted_; }

 private:
  const fs::path folder_;
  FileDescriptor fuse_;
  bool mounted_ = false;
};

TEST_F(DoctorCommand, DoesNotHangWithTheDisk) {
  const HungDisk disk(dir.path() / "dives");
  if (!disk.mounted()) GTEST_SKIP() << "no FUSE file system can be mounted here";
  const auto begin = std::chrono::steady_clock::now();
  const auto json =
      Run("--net", "ip link set lo up; ip route add 239.255.76.67/32 dev lo;", "timeout 60 ");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(12));
  if (json.is_discarded()) GTEST_SKIP() << "unshare --net is not allowed here: " << result.output;
  EXPECT_EQ(TextOf(json, "disk_free"),
            "error disk of " + (dir.path() / "dives").string() + ": does not respond");
  EXPECT_EQ(TextOf(json, "lcm_loopback"), "ok LCM: what is sent here is heard here");
}

// At moments of which some are within the write test.
TEST_F(DoctorCommand, LeavesNothingOnTheDiskWhenItIsInterrupted) {
  const fs::path dives = dir.path() / "dives";
  fs::create_directory(dives);
  for (int after_ms = 10; after_ms <= 400; after_ms += 10) {
    Process doctor(
        Program("seastitch"),
        {"doctor", "--config-dir", (dir.path() / "config").string(), "--lcm-url", "memq://"},
        (dir.path() / "output").string());
    std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
    EXPECT_EQ(doctor.Stop(SIGKILL), -SIGKILL) << "before its end";
    EXPECT_TRUE(fs::is_empty(dives)) << after_ms;
  }
}

TEST_F(DoctorCommand, NamesAFullDisk) {
  const std::string dives = (dir.path() / "dives").string();
  fs::create_directory(dives);
  const auto json =
      Run("--mount --net",
          "ip link set lo up; mount -t tmpfs -o size=4m none " + dives + " || exit 9;");
  if (json.is_discarded()) GTEST_SKIP() << "no disk can be mounted here: " << result.output;
  EXPECT_THAT(TextOf(json, "disk_free"), HasSubstr("error disk of " + dives + ": 0.0 GB free"));
  EXPECT_THAT(TextOf(json, "disk_speed"),
              HasSubstr("error disk of " + dives + ": cannot be written: No space left"));
}

}  // namespace
}  // namespace seastitch
