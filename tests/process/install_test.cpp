// `cmake --install` on a machine that has Seastitch already.

#include <fnmatch.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::string InstallInto(const fs::path& root) {
  return "DESTDIR=" + root.string() + " cmake --install " + BuildDir().string() + " --prefix /usr";
}

TEST(Install, KeepsAnEditedConfigurationAndBringsWhatIsMissing) {
  const TemporaryDir root;
  const fs::path config = root.path() / "etc/seastitch";
  const std::string install = InstallInto(root.path());

  const CommandResult first = RunCommand(install);
  ASSERT_EQ(first.exit_code, 0) << first.output;
  for (const char* mapper :
       {"logger.yaml", "mapper.yaml", "mapper_mems.yaml", "mapper_ins_tactical.yaml"})
    EXPECT_NE(TextOf(config / mapper).find("dives_dir: /var/lib/seastitch/dives"),
              std::string::npos)
        << mapper;
  EXPECT_EQ(TextOf(config / "sbg_ecan.dbc"), TextOf(ConfigFile("sbg_ecan.dbc")));
  EXPECT_TRUE(fs::exists(root.path() / "usr/bin/seastitch-mapper"));

  std::ofstream(config / "vehicle.yaml") << "mine\n";
  fs::remove(config / "optimizer.yaml");
  const CommandResult second = RunCommand(install);
  ASSERT_EQ(second.exit_code, 0) << second.output;
  EXPECT_EQ(TextOf(config / "vehicle.yaml"), "mine\n");
  EXPECT_NE(second.output.find("Kept: " + (config / "vehicle.yaml").string()), std::string::npos);
  EXPECT_TRUE(fs::exists(config / "optimizer.yaml"));
  EXPECT_EQ(TextOf(root.path() / "usr/share/seastitch/config/vehicle.yaml"),
            TextOf(ConfigFile("vehicle.yaml")));
}

// The units as they lie on a vehicle, among this machine's own.
class InstalledUnits : public ::testing::Test {
 protected:
  void SetUp() override {
    if (RunCommand("systemd-analyze --version && command -v ip").exit_code != 0)
      GTEST_SKIP() << "needs systemd-analyze and ip (Debian packages systemd, iproute2)";
    const CommandResult installed = RunCommand(InstallInto(root_.path()));
    ASSERT_EQ(installed.exit_code, 0) << installed.output;
    for (const auto& entry : fs::directory_iterator(root_.path() / kUnitDir)) {
      const std::string extension = entry.path().extension();
      if (extension == ".service" || extension == ".target") units_.push_back(entry.path());
    }
    ASSERT_EQ(units_.size(), 11u);  // eight processes, the route, the target
    const std::string root = root_.path().string();
    const CommandResult copied =
        RunCommand("cp -an /usr/lib/systemd/system/. " + root + "/usr/lib/systemd/system && " +
                   "cp -L $(command -v ip) " + root + "/usr/bin/ip");
    ASSERT_EQ(copied.exit_code, 0) << copied.output;
  }

  CommandResult Analyze(const std::string& arguments) const {
    return RunCommand("systemd-analyze --root=" + root_.path().string() + " " + arguments);
  }
  // What systemd-analyze has to say of one unit.
  CommandResult Verify(const fs::path& unit) const {
    return Analyze("verify --man=no --recursive-errors=yes " + unit.string());
  }
  fs::path Path(const std::string& inside) const { return root_.path() / inside; }
  // Settings of a unit by name; the values of a list with spaces between.
  static std::map<std::string, std::string> Settings(const fs::path& unit) {
    std::map<std::string, std::string> settings;
    std::istringstream lines(TextOf(unit));
    for (std::string line; std::getline(lines, line);)
      if (const auto equals = line.find('='); equals != std::string::npos && line[0] != '#')
        settings[line.substr(0, equals)] += line.substr(equals + 1) + " ";
    return settings;
  }
  // Whether DeviceAllow has a character device of this name, as systemd matches it.
  static bool Allows(const std::map<std::string, std::string>& settings, const std::string& name) {
    std::istringstream words(settings.at("DeviceAllow"));
    for (std::string word; words >> word;)
      if (word.starts_with("char-") && fnmatch(word.c_str() + 5, name.c_str(), 0) == 0) return true;
    return false;
  }

  static constexpr char kUnitDir[] = "usr/lib/systemd/system";
  std::vector<fs::path> units_;

 private:
  const TemporaryDir root_;
};

TEST_F(InstalledUnits, AreWhatSystemdTakes) {
  for (const fs::path& unit : units_) {
    const CommandResult verified = Verify(unit);
    EXPECT_EQ(verified.exit_code, 0) << unit.filename() << ": " << verified.output;
    EXPECT_EQ(verified.output, "") << unit.filename();
  }
  // A program that is missing is seen.
  fs::remove(Path("usr/bin/seastitch-mapper"));
  EXPECT_NE(Verify(Path(kUnitDir) / "seastitch-mapper.service").exit_code, 0);
}

TEST_F(InstalledUnits, AreConfined) {
  for (const fs::path& unit : units_) {
    if (unit.extension() != ".service") continue;
    const CommandResult security = Analyze("security --offline=true --no-pager --threshold=17 " +
                                           ("/" / unit.lexically_relative(Path(""))).string());
    EXPECT_EQ(security.exit_code, 0) << security.output;
    EXPECT_NE(security.output.find("exposure level for " + unit.filename().string()),
              std::string::npos)
        << security.output;
  }
}

// systemd reads common.conf, a drop-in, after the unit: the unit's value of a setting that has one
// would not count.
TEST_F(InstalledUnits, ShareNoSettingOfOneValueWithTheDropInForAll) {
  const std::set<std::string> lists{"After", "Wants", "RestrictAddressFamilies"};
  const auto common = Settings(Path(kUnitDir) / "seastitch-.service.d/common.conf");
  EXPECT_TRUE(common.contains("ProtectSystem"));
  for (const fs::path& unit : units_) {
    if (!unit.filename().string().starts_with("seastitch-")) continue;
    const auto own = Settings(unit);
    for (const auto& [name, value] : own)
      EXPECT_TRUE(lists.contains(name) || !common.contains(name)) << unit.filename() << " " << name;
    EXPECT_TRUE(own.contains("MemoryMax")) << unit.filename();
    EXPECT_TRUE(own.contains("PrivateDevices")) << unit.filename();
  }
}

// A private /dev has no serial ports.
TEST_F(InstalledUnits, OfNavDriverAndNavOutputReachSerialPorts) {
  const auto private_devices = [&](const std::string& name) {
    const CommandResult security =
        Analyze("security --offline=true --no-pager --json=short /" + std::string(kUnitDir) + "/" +
                "seastitch-" + name + ".service");
    for (const auto& line : nlohmann::json::parse(security.output))
      if (line["name"] == "PrivateDevices=") return line["set"].get<bool>();
    ADD_FAILURE() << security.output;
    return false;
  };
  EXPECT_TRUE(private_devices("imu-driver"));
  for (const std::string process : {"nav-driver", "nav-output"}) {
    SCOPED_TRACE(process);
    EXPECT_FALSE(private_devices(process));
    const auto settings = Settings(Path(kUnitDir) / ("seastitch-" + process + ".service"));
    // By the names of /proc/devices: PC, Raspberry Pi, Jetson, i.MX, USB.
    for (const char* port : {"ttyS", "ttyAMA", "ttyTHS", "ttymxc", "ttyUSB", "ttyACM"})
      EXPECT_TRUE(Allows(settings, port)) << port;
    for (const char* other : {"tty", "mem", "input", "usb_device"})
      EXPECT_FALSE(Allows(settings, other)) << other;
    for (const char* module : {"modprobe@cdc_acm.service", "modprobe@usbserial.service"}) {
      EXPECT_NE(settings.at("Wants").find(module), std::string::npos) << module;
      EXPECT_NE(settings.at("After").find(module), std::string::npos) << module;
    }
  }
}

TEST_F(InstalledUnits, TakeTheDropInsForADataDisk) {
  for (const std::string process : {"logger", "mapper"}) {
    const fs::path drop_ins = Path("etc/systemd/system/seastitch-" + process + ".service.d");
    const fs::path drop_in = drop_ins / "data-disk.conf";
    fs::create_directories(drop_ins);
    fs::copy_file(Path("usr/share/doc/seastitch/examples/data-disk-" + process + ".conf"), drop_in);
    // As systemd makes it from /etc/fstab.
    fs::create_directories(Path("etc/systemd/system"));
    std::ofstream(Path("etc/systemd/system/data.mount"))
        << "[Mount]\nWhat=tmpfs\nWhere=/data\nType=tmpfs\n";
    const fs::path unit = Path(kUnitDir) / ("seastitch-" + process + ".service");
    const CommandResult verified = Verify(unit);
    EXPECT_EQ(verified.exit_code, 0) << verified.output;
    EXPECT_EQ(verified.output, "");
    // It is read: what is wrong in it is seen.
    std::ofstream(drop_in, std::ios::app) << "NoSuchSetting=1\n";
    EXPECT_NE(Verify(unit).output.find("NoSuchSetting"), std::string::npos);
    fs::remove(drop_in);
  }
}

// systemd stops what requires the mount of a disk when the disk fails. At sea that may be the
// logger, but not the navigation.
TEST_F(InstalledUnits, OfTheNavigationDoNotStopWithTheDataDisk) {
  const auto drop_in = [this](const std::string& process) {
    return Settings(Path("usr/share/doc/seastitch/examples/data-disk-" + process + ".conf"));
  };
  EXPECT_TRUE(drop_in("logger").contains("RequiresMountsFor"));
  for (const auto& [name, value] : drop_in("mapper"))
    EXPECT_TRUE(name == "Wants" || name == "After" || name == "ReadWritePaths") << name;
}

// On a computer with an Ethernet too, whose address the kernel would else give to what is sent to
// the group: the packets would be dropped as foreign on the loopback interface.
TEST_F(InstalledUnits, RouteLcmOverTheLoopbackInterface) {
  if (RunCommand("unshare --map-root-user --net true").exit_code != 0)
    GTEST_SKIP() << "needs a network namespace";
  const std::string unit = (Path(kUnitDir) / "lcm-loopback.service").string();
  const std::string ethernet =
      "(ip link add eth0 type veth peer name far && ip address add 192.168.1.5/24 dev eth0 && "
      "ip link set eth0 up && ip link set far up); ";
  const std::string route =
      "sed -n s/^ExecStart=//p " + unit + " | sh -e || exit; ip route get 239.255.76.67; ";
  const std::string optimizer = "timeout 5 " + Path("usr/bin/seastitch-optimizer").string() +
                                " --config " + ConfigFile("optimizer.yaml") +
                                " --lcm-url 'udpm://239.255.76.67:7667?ttl=0' & ";
  const std::string status = Path("usr/bin/seastitch").string() + " status --once";
  const CommandResult heard =
      RunCommand("unshare --map-root-user --net sh -c \"" + ethernet + route + optimizer +
                 "LCM_DEFAULT_URL='udpm://239.255.76.67:7667?ttl=0' " + status + "\"");
  EXPECT_NE(heard.output.find("239.255.76.67 dev lo src 127.0.0.1"), std::string::npos)
      << heard.output;
  EXPECT_TRUE(std::regex_search(heard.output, std::regex("\noptimizer +(starting|ok) ")))
      << heard.output;
}

}  // namespace
}  // namespace seastitch
