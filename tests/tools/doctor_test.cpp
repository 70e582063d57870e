// What the doctor finds of a computer, part by part: faults that a test cannot bring about are
// handed to it. doctor_process_test.cpp has the others.

#include "tests/tools/doctor_machine.hpp"

namespace seastitch {
namespace {

class DoctorMachine : public testing::Test {
 protected:
  DoctorMachine() {
    machine.proc = dir.path();
    machine.network_links = dir.path() / "links";
    machine.network_dirs = {dir.path() / "etc", dir.path() / "lib"};
    machine.run = [this](const Words& command) {
      commands.push_back(command);
      return answer;
    };
  }
  // systemctl's answer: what text_of() returns for each unit, with its name.
  void AnswerUnits(std::function<std::string(const std::string& unit)> text_of) {
    machine.run = [text_of](const Words& command) {
      std::string text;
      for (auto unit = std::find(command.begin(), command.end(), "--") + 1; unit != command.end();
           ++unit)
        text += (text.empty() ? "" : "\n") + text_of(*unit) + "Id=" + *unit + "\n";
      return text;
    };
  }
  void AnswerLink(const std::string& flags, const std::string& linkinfo) {
    answer =
        R"([{"ifindex":7,"ifname":"can0","flags":[)" + flags + R"(],"linkinfo":)" + linkinfo + "}]";
  }

  const TemporaryDir dir;
  Machine machine;
  std::optional<std::string> answer;
  std::vector<Words> commands;
};

constexpr char kController[] =
    R"({"info_kind":"can","info_data":{"state":"ERROR-ACTIVE","restart_ms":100,)"
    R"("bittiming":{"bitrate":250000,"sample_point":"0.875"}}})";

// networkd itself matched the file with the interface, whatever its [Match] says.
TEST_F(DoctorMachine, ComparesTheBitRateWithTheNetworkFileThatNetworkdUses) {
  AnswerLink(R"("NOARP","UP","LOWER_UP")", kController);
  const auto lines = [this] { return Lines(CheckCan(machine, "can0")); };
  const std::string file = (dir.path() / "lib/80-can.network").string();
  for (const char* folder : {"lib", "links", "etc/80-can.network.d", "lib/80-can.network.d"})
    std::filesystem::create_directories(dir.path() / folder);
  dir.Write("lib/80-can.network", "[Match]\nName=can*\n\n[CAN]\n# of the devices\nBitRate=1M\n");
  EXPECT_THAT(lines(), ElementsAre("ok CAN can0: up, ERROR-ACTIVE", "ok CAN can0: 250000 bit/s"))
      << "networkd does not run";
  EXPECT_THAT(commands.front(),
              ElementsAre("ip", "-json", "-details", "link", "show", "dev", "can0"));
  dir.Write("links/7", "# private\nADMIN_STATE=unmanaged\n");
  EXPECT_EQ(lines()[1], "ok CAN can0: 250000 bit/s") << "brought up by hand";

  dir.Write("links/7", "ADMIN_STATE=configured\nNETWORK_FILE=" + file + "\nDNS=\n");
  EXPECT_EQ(lines()[1], "error CAN can0: 250000 bit/s, where its .network file says 1000000");
  dir.Write("lib/80-can.network.d/20-rate.conf", "[CAN]\nBitRate = 500K\n");
  dir.Write("lib/80-can.network.d/10-other.conf", "[CAN]\nBitRate=125K\n");
  EXPECT_EQ(lines()[1], "error CAN can0: 250000 bit/s, where its .network file says 500000")
      << "the last drop-in counts";
  dir.Write("etc/80-can.network.d/20-rate.conf", "[CAN]\nBitRate=250K\n");
  EXPECT_EQ(lines()[1], "ok CAN can0: 250000 bit/s") << "in /etc it stands for that of its name";
  dir.Write("links/7", "NETWORK_FILE=" + (dir.path() / "gone.network").string() + "\n");
  EXPECT_EQ(lines()[1], "ok CAN can0: 250000 bit/s");
}

TEST_F(DoctorMachine, NamesAnInterfaceThatIsMissingDownOrOffTheBus) {
  EXPECT_THAT(Lines(CheckCan(machine, "can0")), ElementsAre("error CAN can0: no such interface"));
  AnswerLink(R"("NOARP")", kController);
  EXPECT_THAT(Lines(CheckCan(machine, "can0")), ElementsAre("error CAN can0: down"));
  AnswerLink(R"("UP")", R"({"info_data":{"state":"BUS-OFF"}})");
  EXPECT_THAT(Lines(CheckCan(machine, "can0")).front(), "error CAN can0: up, controller BUS-OFF");
  AnswerLink(R"("UP")", R"({"info_kind":"vcan"})");
  EXPECT_EQ(Worst(CheckCan(machine, "can0")), Finding::Level::kOk);
  for (const char* nonsense : {"", "[]", "[3]", "{}", "[{\"flags\":7}]"}) {
    answer = nonsense;
    EXPECT_EQ(Worst(CheckCan(machine, "can0")), Finding::Level::kError) << nonsense;
  }
}

TEST_F(DoctorMachine, NamesARouteThatLeavesTheComputerOrHasAnotherSource) {
  const std::string url = "udpm://239.255.76.67:7667?ttl=0";
  EXPECT_THAT(Lines(CheckRoute(machine, url)),
              ElementsAre("error route of LCM's group 239.255.76.67: none"));
  answer = R"([{"dst":"239.255.76.67","dev":"eth0","prefsrc":"10.0.0.2"}])";
  EXPECT_THAT(Lines(CheckRoute(machine, url)).front(), HasSubstr("leaves the computer"));
  answer = R"([{"dst":"239.255.76.67","dev":"lo","prefsrc":"10.0.0.2"}])";
  EXPECT_THAT(Lines(CheckRoute(machine, url)).front(), HasSubstr("filters refuse it"));
  answer = R"([{"dst":"239.255.76.67","dev":"lo","prefsrc":"127.0.0.1"}])";
  EXPECT_EQ(Worst(CheckRoute(machine, url)), Finding::Level::kOk);
  EXPECT_EQ(Worst(CheckRoute(machine, "memq://")), Finding::Level::kOk);
}

TEST_F(DoctorMachine, NamesSmallReceiveBuffers) {
  std::filesystem::create_directories(dir.path() / "sys/net/core");
  dir.Write("sys/net/core/rmem_max", "212992\n");
  EXPECT_THAT(Lines(CheckBuffers(machine, 16 << 20)),
              ElementsAre("error receive buffers: at most 212992 bytes, where a process asks for "
                          "16777216: a burst of the sonar is lost"));
  dir.Write("sys/net/core/rmem_max", "16777216\n");
  EXPECT_EQ(Worst(CheckBuffers(machine, 16 << 20)), Finding::Level::kOk);
}

TEST_F(DoctorMachine, NamesAFreeRunningClockAndWhoDisciplinesIt) {
  machine.clock = [] { return ClockState{.synchronised = false, .error_s = 16.0}; };
  EXPECT_THAT(Lines(CheckClock(machine)),
              ElementsAre("warning clock: runs free, nobody disciplines it"));
  std::filesystem::create_directory(dir.path() / "812");
  dir.Write("812/comm", "chronyd\n");
  EXPECT_THAT(Lines(CheckClock(machine)),
              ElementsAre("warning clock: not synchronised yet by chronyd"));
  machine.clock = [] { return ClockState{.synchronised = true, .error_s = 0.0121}; };
  EXPECT_THAT(Lines(CheckClock(machine)),
              ElementsAre("ok clock: synchronised by chronyd, within 0.012 s"));
  machine.clock = [] { return ClockState{.synchronised = true, .error_s = 3.0}; };
  EXPECT_EQ(Worst(CheckClock(machine)), Finding::Level::kWarning);
}

TEST_F(DoctorMachine, NamesABusyProcessorAndLittleMemory) {
  dir.Write("loadavg", "250.00 3.00 1.00 9/600 1234\n");
  dir.Write("meminfo", "MemTotal:        2097152 kB\nMemAvailable:     102400 kB\n");
  EXPECT_THAT(Lines(CheckProcessor(machine)).front(), HasSubstr("load 250.0"));
  EXPECT_EQ(Worst(CheckProcessor(machine)), Finding::Level::kWarning);
  EXPECT_THAT(Lines(CheckMemory(machine)), ElementsAre("error memory: 100 of 2048 MB available"));
  dir.Write("loadavg", "0.10 0.00 0.00 1/100 12\n");
  dir.Write("meminfo", "MemTotal:        2097152 kB\nMemAvailable:    1048576 kB\n");
  EXPECT_EQ(Worst(CheckProcessor(machine)), Finding::Level::kOk);
  EXPECT_EQ(Worst(CheckMemory(machine)), Finding::Level::kOk);
}

constexpr char kUrl[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr char kDenies[] = "ControlGroup=/system.slice/x.service\nIPAddressDeny=::/0 0.0.0.0/0\n";

TEST_F(DoctorMachine, NamesAFilterThatDoesNotHold) {
  std::string unit = kDenies;
  std::string slice;
  AnswerUnits([&](const std::string& name) { return name.ends_with(".slice") ? slice : unit; });
  std::filesystem::path asked;
  machine.cgroups = "/cgroup";
  machine.filter = [&](const std::filesystem::path& cgroup) {
    asked = cgroup;
    return FilterState{.programs = 1};
  };
  EXPECT_EQ(Worst(CheckFilter(machine, kUrl)), Finding::Level::kOk);
  EXPECT_EQ(asked, "/cgroup/system.slice/x.service");
  machine.filter = [](const auto&) { return FilterState{}; };
  EXPECT_EQ(Worst(CheckFilter(machine, kUrl)), Finding::Level::kError)
      << "a kernel that filters nothing";
  machine.filter = [](const auto&) { return FilterState{.trouble = "Operation not permitted"}; };
  EXPECT_THAT(Lines(CheckFilter(machine, kUrl)).front(),
              "warning IP filter of mapper: not known, Operation not permitted");
  machine.filter = [](const auto&) { return FilterState{.programs = 1}; };
  unit = "ControlGroup=/x\nIPAddressDeny=\n";
  EXPECT_EQ(Worst(CheckFilter(machine, kUrl)), Finding::Level::kError)
      << "that of another unit above";
  unit.clear();
  EXPECT_EQ(Worst(CheckFilter(machine, kUrl)), Finding::Level::kWarning) << "no systemd";
}

// IPAddressAllow= of a drop-in, or of the slice, adds to that of the unit.
TEST_F(DoctorMachine, NamesAFilterThatLetsOthersIn) {
  const std::string ours = "IPAddressAllow=239.255.76.67/32 ::1/128 127.0.0.0/8";
  std::string allow = ours;
  std::string slice;
  AnswerUnits([&](const std::string& name) {
    return name.ends_with(".slice") ? slice : kDenies + allow + "\n";
  });
  machine.filter = [](const auto&) { return FilterState{.programs = 1}; };
  EXPECT_THAT(Lines(CheckFilter(machine, kUrl)).front(), "ok IP filter of mapper: holds");
  allow = "IPAddressAllow=::/0 0.0.0.0/0";  // any
  EXPECT_THAT(Lines(CheckFilter(machine, kUrl)).front(),
              "error IP filter of mapper: lets other computers speak on LCM, IPAddressAllow has "
              "0.0.0.0/0 ::/0");
  allow = ours + " 10.0.0.0/24";
  EXPECT_THAT(Lines(CheckFilter(machine, kUrl)).back(), HasSubstr("has 10.0.0.0/24"));
  allow = ours;
  EXPECT_THAT(Lines(CheckFilter(machine, "udpm://239.1.2.3:7667?ttl=0")).front(),
              HasSubstr("has 239.255.76.67/32"));
  slice = "IPAddressAllow=192.168.1.0/24\n";
  EXPECT_THAT(Lines(CheckFilter(machine, kUrl)).front(), HasSubstr("has 192.168.1.0/24"));
}

// The unit of nav-output reaches this computer alone, but for what a drop-in allows.
TEST_F(DoctorMachine, NamesAnOutputThatTheFilterStops) {
  std::string allow = "239.255.76.67/32 ::1/128 127.0.0.0/8";
  AnswerUnits([&](const std::string&) { return kDenies + ("IPAddressAllow=" + allow) + "\n"; });
  const auto level = [&](const std::string& url) { return Worst(CheckOutputFilter(machine, url)); };
  EXPECT_EQ(level("udp:127.0.0.1:10110"), Finding::Level::kOk);
  EXPECT_EQ(level("udp:10.0.0.7:10110"), Finding::Level::kError);
  EXPECT_THAT(Lines(CheckOutputFilter(machine, "udp:10.0.0.7:10110")).front(),
              HasSubstr("error output of nav-output: its unit may not send to 10.0.0.7"));
  for (const char* const drop_in : {"10.0.0.7/32", "10.0.0.0/24", "0.0.0.0/0"}) {
    allow = drop_in;
    EXPECT_EQ(level("udp:10.0.0.7:10110?interface=eth1"), Finding::Level::kOk) << drop_in;
  }
  allow = "10.0.0.8/29";
  EXPECT_EQ(level("udp:10.0.0.7:10110"), Finding::Level::kError);
  AnswerUnits([](const std::string&) { return "IPAddressDeny=\n"; });
  EXPECT_EQ(level("udp:10.0.0.7:10110"), Finding::Level::kOk) << "no filter";
}

class DoctorDataDisk : public DoctorMachine {
 protected:
  DoctorDataDisk() {
    AnswerUnits([this](const std::string& unit) { return "LoadState=loaded\n" + drop_ins[unit]; });
    machine.root = "/proc";  // another device
  }
  std::vector<std::string> Alarms() {
    Findings findings = CheckDataDisk(machine, dives);
    std::erase_if(findings, [](const Finding& f) { return f.level == Finding::Level::kOk; });
    return Lines(findings);
  }
  const std::filesystem::path dives = "/data/seastitch/dives";
  const std::string logger = "seastitch-logger.service";
  const std::string mapper = "seastitch-mapper.service";
  // As the documentation has them, and as systemd shows them among what it adds.
  std::map<std::string, std::string> drop_ins{
      {logger,
       "ReadWritePaths=/x /data/seastitch\nRequiresMountsFor=/var/tmp /data/seastitch\n"
       "After=-.mount data.mount\nWants=\n"},
      {mapper,
       "ReadWritePaths=-/data/seastitch\nRequiresMountsFor=/var/lib/seastitch /tmp\n"
       "Wants=data.mount\nAfter=-.mount seastitch-logger.service data.mount\n"}};
};

TEST_F(DoctorDataDisk, OfTheDocumentationIsInPlace) {
  EXPECT_THAT(CheckDataDisk(machine, "/var/lib/seastitch/dives"), IsEmpty());
  EXPECT_THAT(Lines(CheckDataDisk(machine, dives)),
              UnorderedElementsAre("ok drop-in of mapper for /data/seastitch/dives: in place",
                                   "ok drop-in of logger for /data/seastitch/dives: in place"));
}

TEST_F(DoctorDataDisk, ThatUnitsMayNotWriteToOrDoNotWaitForIsNamed) {
  drop_ins[logger] = "ReadWritePaths=\nRequiresMountsFor=/var/lib/seastitch\n";
  EXPECT_THAT(Alarms(),
              ElementsAre(HasSubstr(
                  "error drop-in of logger for /data/seastitch/dives: no ReadWritePaths")));
  drop_ins[logger] = "ReadWritePaths=/data/seastitch\nRequiresMountsFor=/var/lib\n";
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("warning drop-in of logger")));
  drop_ins[logger] = "ReadWritePaths=/data\nRequiresMountsFor=/data\n";
  EXPECT_THAT(Alarms(), IsEmpty());
  for (const char* mounts : {"After=-.mount data.mount\nWants=\n",
                             "After=-.mount\nWants=data.mount\n",
                             "After=-.mount x.mount\nWants=-.mount x.mount\n"}) {
    drop_ins[mapper] = std::string("ReadWritePaths=/data\n") + mounts;
    EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("no Wants and After of the disk's mount unit")))
        << mounts;
  }
}

TEST_F(DoctorDataDisk, WhoseMountPointHasADashIsFound) {
  for (auto& [unit, text] : drop_ins)
    text =
        "ReadWritePaths=/mnt/my-disk\nWants=mnt-my\\x2ddisk.mount\nAfter=mnt-my\\x2ddisk.mount\n";
  drop_ins[logger] += "RequiresMountsFor=/mnt/my-disk\n";
  EXPECT_EQ(Worst(CheckDataDisk(machine, "/mnt/my-disk/dives")), Finding::Level::kOk);
  EXPECT_EQ(Worst(CheckDataDisk(machine, "/mnt/my/disk/dives")), Finding::Level::kError);
}

// A disk that drops out must not end the navigation.
TEST_F(DoctorDataDisk, ThatProcessesBesideTheLoggerRequireIsNamed) {
  for (const std::string process : {"mapper", "imu-driver", "nav-driver"}) {
    std::string& text = drop_ins["seastitch-" + process + ".service"];
    const std::string before = std::exchange(text, drop_ins[logger]);
    EXPECT_THAT(Alarms(),
                ElementsAre("warning drop-in of " + process +
                            " for /data/seastitch/dives: RequiresMountsFor, so that systemd stops "
                            "it when the disk drops out"));
    text = before;
  }
}

TEST_F(DoctorDataDisk, ThatIsNotMountedIsNamed) {
  machine.root = "/";
  EXPECT_THAT(Alarms(),
              ElementsAre(HasSubstr("warning data disk of /data/seastitch/dives: not "
                                    "mounted")));
}

// Of a folder on the computer's own disk, without a data disk.
TEST_F(DoctorDataDisk, ThatNobodyAskedForIsNotMissed) {
  machine.root = "/";
  drop_ins[logger] = "ReadWritePaths=/data/seastitch\n";
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("no RequiresMountsFor")));
}

std::string DiveJson(int number, std::int64_t last_utime, bool mapper_stopped) {
  const nlohmann::json process{
      {"version", "0.1.0"}, {"starts", 1}, {"start_utime", 1}, {"last_sign_of_life_utime", 2}};
  nlohmann::json dive{{"format", 1},
                      {"number", number},
                      {"host", "vehicle"},
                      {"start_utime", 1},
                      {"last_sign_of_life_utime", last_utime},
                      {"closed", false}};
  for (const char* name : {"logger", "mapper"}) {
    dive["processes"][name] = process;
    dive["processes"][name]["stopped"] = mapper_stopped || name == std::string("logger");
  }
  return dive.dump();
}

TEST_F(DoctorMachine, NamesALastDiveThatDidNotEndInOrder) {
  constexpr std::int64_t kNow = 1'800'000'000'000'000;
  EXPECT_THAT(Lines(CheckLastDive(dir.path(), kNow)), ElementsAre("ok last dive: none yet"));
  for (const char* name : {"A", "B", "C"}) std::filesystem::create_directory(dir.path() / name);
  dir.Write("A/dive.json", DiveJson(1, kNow - 7'200'000'000, true));
  dir.Write("C/dive.json", "cut");
  EXPECT_THAT(Lines(CheckLastDive(dir.path(), kNow)),
              ElementsAre("ok last dive A: ended in order"));
  dir.Write("B/dive.json", DiveJson(2, kNow - 3'600'000'000, false));
  EXPECT_THAT(
      Lines(CheckLastDive(dir.path(), kNow)),
      ElementsAre("warning last dive B: not ended in order by mapper (power cut, or crash)"));
  dir.Write("B/dive.json", DiveJson(2, kNow - 5'000'000, false));
  EXPECT_THAT(Lines(CheckLastDive(dir.path(), kNow)), ElementsAre("ok last dive A: ended in order"))
      << "B runs";
}

TEST_F(DoctorMachine, MeasuresTheDiskAndLeavesNothingThere) {
  const Findings findings = CheckDisk(dir.path() / "dives");
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_THAT(findings[0].text, HasSubstr("GB free"));
  EXPECT_THAT(findings[1].text, HasSubstr("MB/s"));
  EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
  EXPECT_THAT(Lines(CheckDisk("/nowhere/seastitch/dives")).front(),
              HasSubstr("error folder of the dives: /nowhere/seastitch/dives is not there"));
}

}  // namespace
}  // namespace seastitch
