#include "tests/tools/doctor_machine.hpp"

namespace seastitch {
namespace {

// Sensors that are heard, each with sensible values.
class DoctorSensors : public testing::Test {
 protected:
  DoctorSensors() {
    for (const char* channel : {"IMU", "DVL", "DEPTH", "MBES_PING"})
      Hear(&watch.latency_s[channel], 0.02);
    Hear(&watch.specific_force_mps2, 9.81);
    Hear(&watch.depth_m, 0.3);
    Hear(&watch.sound_speed_mps, 1490.0);
    Hear(&watch.bottom_lock, 1.0);
    Hear(&watch.speed_mps, 0.2);
    Hear(&watch.valid_beams, 0.9);
  }
  static void Hear(Heard* heard, double value) {
    *heard = Heard{};
    for (int i = 0; i < 5; ++i) heard->Add(value, 10.0 + 0.1 * i);
  }
  std::vector<std::string> Alarms(bool at_surface = true) {
    Findings alarms = CheckSensors(watch, setup, at_surface);
    std::erase_if(alarms, [](const Finding& f) { return f.level == Finding::Level::kOk; });
    return Lines(alarms);
  }
  BusWatch watch{"memq://"};
  seastitch::Setup setup;
};

TEST_F(DoctorSensors, OfAGoodVehicleRaiseNoAlarm) {
  EXPECT_THAT(Alarms(), IsEmpty());
  EXPECT_THAT(CheckSensors(watch, setup, true)[1].text,
              HasSubstr("IMU: 10.0 a second, stamps 0.020 s behind receipt, stamped on receipt"));
}

TEST_F(DoctorSensors, ThatAreSilentLateOrImplausibleAreNamed) {
  watch.latency_s.erase("DEPTH");
  EXPECT_THAT(Alarms(), ElementsAre("error DEPTH: not heard"));
  Hear(&watch.latency_s["DEPTH"], -3600.0);
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("error DEPTH: 10.0 a second, stamps -3600.000 s")));
  Hear(&watch.latency_s["DEPTH"], 0.1);
  Hear(&watch.specific_force_mps2, 1.0);  // in g
  EXPECT_THAT(Alarms(),
              ElementsAre(HasSubstr("error gravity, as the inertial unit feels it: 1.00")));
  Hear(&watch.specific_force_mps2, 9.79);
  Hear(&watch.sound_speed_mps, 343.0);
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("warning sound speed at the sonar: 343.00 m/s")))
      << "out of the water";
  Hear(&watch.sound_speed_mps, 1450.0);
  Hear(&watch.depth_m, 10.2);
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("error depth, at the surface: 10.20 m")));
  EXPECT_THAT(Alarms(false), IsEmpty()) << "under water";
  Hear(&watch.depth_m, 0.0);
  Hear(&watch.bottom_lock, 0.0);
  Hear(&watch.valid_beams, 0.0);
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("warning bottom lock"), HasSubstr("warning beams")));
}

TEST_F(DoctorSensors, OfAVehicleWithAnInsAreSonarAndIns) {
  for (const char* channel : {"IMU", "DVL", "DEPTH"}) watch.latency_s.erase(channel);
  watch.specific_force_mps2 = watch.depth_m = watch.bottom_lock = watch.speed_mps = Heard{};
  setup.given_navigation = true;
  EXPECT_THAT(Alarms(), ElementsAre("error INS: not heard"));
  Hear(&watch.latency_s["INS"], 0.01);
  EXPECT_THAT(Alarms(), IsEmpty());
  for (const Finding& finding : CheckProcesses(watch, setup, 1.0))
    EXPECT_EQ(finding.text.find("imu-driver"), std::string::npos);
}

// nav-driver reports the clock of each of its devices.
TEST_F(DoctorSensors, AreToldWithTheClockOfTheirOwnDevice) {
  setup.given_navigation = true;
  setup.nav_channels = {"INS", "DEPTH"};
  Hear(&watch.latency_s["INS"], 0.01);
  health_t nav{};
  nav.process = "nav-driver";
  const auto set = [&nav](const std::string& name, std::int64_t value) {
    nav.counters.push_back({name, value});
  };
  for (const auto& [device, offset_us] :
       {std::pair("gps", 5'000), {"ins", -2'500}, {"usbl", 7'000}}) {
    set(std::string(device) + "_clock_settled", 1);
    set(std::string(device) + "_clock_offset_us", offset_us);
    set(std::string(device) + "_clock_drift_ppb", 0);
  }
  watch.roll.Add(nav, 1.0);
  std::string all;
  for (const Finding& finding : CheckSensors(watch, setup, true)) all += finding.text + "\n";
  EXPECT_THAT(all, HasSubstr("INS: 10.0 a second, stamps 0.010 s behind receipt, clock -2.5 ms"));
  EXPECT_THAT(all, HasSubstr("DEPTH: 10.0 a second, stamps 0.020 s behind receipt, stamped on"));
}

TEST_F(DoctorSensors, OfAVehicleWithOtherInstrumentsComeFromTheNavDriver) {
  setup.nav_channels = {"INS", "DEPTH"};
  watch.latency_s.erase("DEPTH");
  EXPECT_THAT(Alarms(), ElementsAre("error DEPTH: not heard"));
  setup.given_navigation = true;
  EXPECT_THAT(Alarms(), ElementsAre("error INS: not heard", "error DEPTH: not heard"));
  const auto of_nav_driver = [&] {
    std::vector<std::string> found;
    for (const Finding& finding : CheckProcesses(watch, setup, 1.0))
      if (finding.text.starts_with("nav-driver")) found.push_back(finding.text + finding.remedy);
    return found;
  };
  EXPECT_THAT(of_nav_driver(),
              ElementsAre(HasSubstr("not heardsudo systemctl enable --now seastitch-nav-driver")));
  setup.nav_channels.clear();
  EXPECT_THAT(of_nav_driver(), IsEmpty()) << "no instrument, no process";
}

TEST_F(DoctorSensors, WithASourceOfPositionsHaveThemAtTheSurface) {
  setup.nav_channels = {"POSITION_FIX"};
  EXPECT_THAT(Alarms(), ElementsAre(HasSubstr("warning POSITION_FIX: not heard")));
  EXPECT_THAT(Alarms(false), IsEmpty()) << "under water";
  Hear(&watch.latency_s["POSITION_FIX"], 0.1);
  EXPECT_THAT(Alarms(), IsEmpty());
  EXPECT_THAT(Lines(CheckSensors(watch, setup, true)),
              testing::Contains("ok POSITION_FIX: heard, 5 positions"));
}

// GPS time in place of UTC, and a week count that overflowed.
TEST_F(DoctorSensors, PositionsByAnotherClockAreNamed) {
  setup.nav_channels = {"POSITION_FIX"};
  for (const auto& [behind_s, text] :
       {std::pair(-18.0, "POSITION_FIX: stamps -18.000 s behind"),
        {619'315'200.0, "POSITION_FIX: stamps 7168.0 days behind"}}) {
    watch.latency_s["POSITION_FIX"] = {};
    Hear(&watch.latency_s["POSITION_FIX"], behind_s);
    EXPECT_THAT(Alarms(), ElementsAre(HasSubstr(text)));
  }
}

TEST(DoctorSetup, TheNavDriverIsLookedForWhereItsFileNamesAnInstrument) {
  const TemporaryDir dir;
  std::filesystem::copy(ConfigFile(""), dir.path(), std::filesystem::copy_options::recursive);
  Findings findings;
  EXPECT_FALSE(LoadSetup(dir.path(), &findings).Needs("nav-driver"));
  dir.Write("nav_driver.yaml",
            "gps: {source: \"serial:/dev/nowhere\"}\ndepth: {source: \"serial:/dev/nowhere\"}\n"
            "ins: {source: \"udp:0.0.0.0:6020\"}\n");
  const seastitch::Setup setup = LoadSetup(dir.path(), &findings);
  EXPECT_TRUE(setup.Needs("nav-driver"));
  EXPECT_EQ(setup.drivers.count("nav-driver"), 2u) << "one a source";
  EXPECT_THAT(Lines(CheckTogether(setup)), testing::Contains(HasSubstr("both use UDP port 6020")));
  EXPECT_THAT(Lines(CheckSerial("nav-driver", "serial:/dev/nowhere")),
              ElementsAre(HasSubstr("error serial port /dev/nowhere of nav-driver: No such file")));
  EXPECT_THAT(Lines(CheckSerial("nav-driver", "serial:/dev/null")), ElementsAre(HasSubstr("ok ")));
}

TEST(DoctorSetup, TheNavOutputIsLookedForWhereItsFileNamesAnOutput) {
  const TemporaryDir dir;
  std::filesystem::copy(ConfigFile(""), dir.path(), std::filesystem::copy_options::recursive);
  Findings findings;
  EXPECT_FALSE(LoadSetup(dir.path(), &findings).Needs("nav-output"));
  dir.Write("nav_driver.yaml", "gps: {source: \"serial:/dev/nowhere\"}\n");
  dir.Write("nav_output.yaml",
            "vehicle: vehicle.yaml\nudp: \"udp:10.0.0.7:10110\"\n"
            "serial: \"serial:/dev/nowhere?baud=38400\"\n");
  const seastitch::Setup setup = LoadSetup(dir.path(), &findings);
  EXPECT_TRUE(setup.Needs("nav-output"));
  EXPECT_THAT(Lines(CheckTogether(setup)),
              testing::Contains(
                  HasSubstr("error nav-driver and nav-output both use serial port /dev/nowhere")));
}

// Two programs that read one device get half of the bytes each.
TEST(DoctorSetup, TwoSourcesOnOneSerialPortAreNamed) {
  const TemporaryDir dir;
  std::filesystem::copy(ConfigFile(""), dir.path(), std::filesystem::copy_options::recursive);
  dir.Write("ttyUSB0", "");
  std::filesystem::create_symlink("ttyUSB0", dir.path() / "by-id");
  const std::string port = (dir.path() / "ttyUSB0").string();
  const std::string by_id = (dir.path() / "by-id").string();
  const auto together = [&](const std::string& gps, const std::string& depth) {
    dir.Write("nav_driver.yaml",
              "gps: {source: \"serial:" + gps + "\"}\ndepth: {source: \"serial:" + depth + "\"}\n");
    Findings findings;
    return Lines(CheckTogether(LoadSetup(dir.path(), &findings)));
  };
  const auto named =
      testing::Contains(HasSubstr("error nav-driver and nav-driver both use serial port "));
  EXPECT_THAT(together(port, by_id), named);
  EXPECT_THAT(together(port, port + "?baud=9600"), named);
  EXPECT_THAT(together(port, port), Not(named)) << "one source of two instruments";
  EXPECT_THAT(together(port, port + "1"), Not(named));
}

TEST(DoctorDeadline, HoldsWhereEveryProgramHangs) {
  const TemporaryDir dir;
  std::filesystem::create_directory(dir.path() / "config");
  std::filesystem::copy(
      ConfigFile(""), dir.path() / "config", std::filesystem::copy_options::recursive);
  Machine machine;
  machine.run = [](const Words&) -> std::optional<std::string> {
    std::this_thread::sleep_for(std::chrono::seconds(2));
    return std::nullopt;
  };
  const auto begin = std::chrono::steady_clock::now();
  const Findings findings =
      Examine({.config_dir = dir.path() / "config", .lcm_url = "memq://"}, machine).findings;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_THAT(Lines(findings), testing::Contains(HasSubstr("ip and systemctl respond too slowly")));
}

TEST(Programs, ReturnTextAndExitStatusAndDoNotHang) {
  const ChildResult failed = RunProgram({"sh", "-c", "echo two of three; exit 3"}, 10.0);
  EXPECT_EQ(failed.output, "two of three\n");
  EXPECT_EQ(failed.exit_status, 3);
  EXPECT_EQ(RunProgram({"no-such-program"}, 10.0).exit_status, 127);
  EXPECT_EQ(RunProgram({"printf", std::string(100'000, 'x')}, 10.0).output.size(), 100'000u);
  const auto begin = std::chrono::steady_clock::now();
  const ChildResult hung = RunProgram({"sh", "-c", "trap '' TERM; echo begun; sleep 60"}, 0.5);
  EXPECT_EQ(hung.output, "begun\n");
  EXPECT_FALSE(hung.exit_status);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST(Findings, AreTextAndJson) {
  const Findings findings{
      Ok("cpu", "CPU: 2 cores"),
      Warning("clock", "clock: runs\x1b[2J free", std::string(40, 'x') + " end")};
  EXPECT_EQ(ToText(findings, 50),
            "warning  clock: runs [2J free\n"
            "         ->\n"
            "         " +
                std::string(40, 'x') +
                "\n"
                "         end\n"
                "ok       CPU: 2 cores\n"
                "0 errors, 1 warning, 1 ok\n");
  EXPECT_EQ(
      ToText({Warning("a", "one", "Look."), Error("b", "two", ""), Warning("c", "3", "Look.")}, 50),
      "error    two\n"
      "warning  one\n"
      "         -> Look.\n"
      "warning  3\n"
      "1 error, 2 warnings, 0 ok\n");
  const auto json = nlohmann::json::parse(ToJson(findings));
  EXPECT_EQ(json["result"], "warning");
  EXPECT_EQ(json["checks"][1]["check"], "clock");
  EXPECT_EQ(json["checks"][1]["level"], "warning");

  const Findings both{findings[0], findings[1], Error("disk_free", "disk: full", "Make room.")};
  const auto read = FromJson(ToJson(both));
  ASSERT_TRUE(read);
  EXPECT_EQ(ToJson(*read), ToJson(both));
  for (const char* text : {"", "{}", "[]", R"({"checks": [{}]})", R"({"checks": 3})"})
    EXPECT_FALSE(FromJson(text)) << text;
}

}  // namespace
}  // namespace seastitch
