#include "tools/vehicle/doctor.hpp"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "common/runtime/health.hpp"
#include "tools/vehicle/bus_checks.hpp"
#include "tools/vehicle/machine_checks.hpp"
#include "tools/vehicle/piped_child.hpp"
#include "tools/vehicle/setup.hpp"

namespace seastitch {
namespace {

// HEALTH is sent once a second. A process answers CONFIG_REQUEST at most every 10 s.
constexpr double kListenS = 3.5;
// Times since the begin [s]: the last start of another program, which may take kProgramS; the end
// of the disk's checks, which take 2 s on a disk that can be used; the end of all.
constexpr double kLastProgramS = 2.5;
constexpr double kDiskS = 6.0;
constexpr double kAtMostS = 9.0;
constexpr char kCheckDisk[] =
    "Check the data disk's cable and power, and the kernel's log (dmesg); then mount it again.";
constexpr char kDefaultUrl[] = "udpm://239.255.76.67:7667?ttl=0";

std::string UrlOf(const DoctorOptions& options) {
  if (!options.lcm_url.empty()) return options.lcm_url;
  const char* const url = std::getenv("LCM_DEFAULT_URL");
  return url != nullptr && *url != '\0' ? url : kDefaultUrl;
}

// Nothing if the bus cannot be opened; the reason is then a finding.
std::unique_ptr<BusWatch> OpenBus(const std::string& url, Findings* findings) {
  try {
    return std::make_unique<BusWatch>(url);
  } catch (const std::exception& e) {
    findings->push_back(Error("lcm_loopback",
                              std::string("LCM: ") + e.what(),
                              "Check the multicast route (lcm_route) and the LCM URL."));
    return nullptr;
  }
}

// The machine with a time after which it starts no more programs. `late` is set when one is not
// started, or takes too long.
Machine WithDeadline(const Machine& machine, double last_program_s, bool* late) {
  Machine limited = machine;
  limited.run = [run = machine.run, last_program_s, late](
                    const std::vector<std::string>& command) -> std::optional<std::string> {
    const double begin_s = MonotonicSeconds();
    std::optional<std::string> answer;
    if (begin_s < last_program_s) answer = run(command);
    *late |= !answer && (begin_s >= last_program_s || MonotonicSeconds() - begin_s >= kProgramS);
    return answer;
  };
  return limited;
}

void CheckMachine(const Setup& setup,
                  const std::string& url,
                  const Machine& machine,
                  Findings* findings) {
  for (const std::string& interface : setup.can_interfaces())
    Append(CheckCan(machine, interface), findings);
  Append(CheckBuffers(machine, setup.largest_buffer_bytes()), findings);
  Append(CheckRoute(machine, url), findings);
  Append(CheckFilter(machine, url), findings);
  if (!setup.nav_output_udp.empty())
    Append(CheckOutputFilter(machine, setup.nav_output_udp), findings);
  if (!setup.page_listen.empty()) Append(CheckPage(setup.page_listen), findings);
  Append(CheckClock(machine), findings);
  Append(CheckProcessor(machine), findings);
  Append(CheckMemory(machine), findings);
}

Findings CheckDives(const Machine& machine, const std::filesystem::path& dives_dir) try {
  // Before the write test: programs are started for a short time only.
  const Findings data_disk = CheckDataDisk(machine, dives_dir);
  Findings findings = CheckDisk(dives_dir);
  Append(data_disk, &findings);
  Append(CheckLastDive(dives_dir, NowUtime()), &findings);
  return findings;
} catch (const std::exception& e) {
  return {Error("disk_free", std::string("folder of the dives: ") + e.what(), kCheckDisk)};
}

// The checks of the dives' disk, in a process of its own: a disk that hangs does not hang the
// doctor.
class DiskChecks {
 public:
  DiskChecks(const Machine& machine, const std::filesystem::path& dives_dir)
      : dives_dir_(dives_dir), child_([&machine, &dives_dir](int out) {
          return WriteText(out, ToJson(CheckDives(machine, dives_dir)));
        }) {}
  Findings WaitUntil(double end_s) {
    return FromJson(child_.WaitUntil(end_s).output)
        .value_or(Findings{Error(
            "disk_free", "disk of " + dives_dir_.string() + ": does not respond", kCheckDisk)});
  }

 private:
  const std::filesystem::path dives_dir_;
  PipedChild child_;
};

void CheckBus(const Setup& setup, bool at_surface, BusWatch* watch, Findings* findings) {
  Append(CheckLoopback(*watch), findings);
  for (const auto& [process, driver] : setup.drivers) {
    if (driver.source.starts_with("serial:")) Append(CheckSerial(process, driver.source), findings);
    if (driver.source.starts_with("udp:") && watch->roll.Find(process) == nullptr)
      Append(CheckPort(process, driver.source), findings);
  }
  if (!setup.nav_output_serial.empty())
    Append(CheckSerial(kNavOutput, setup.nav_output_serial), findings);
  Append(CheckProcesses(*watch, setup, MonotonicSeconds()), findings);
  Append(CheckRunningConfigs(*watch, setup), findings);
  Append(CheckSensors(*watch, setup, at_surface), findings);
}

}  // namespace

Examination Examine(const DoctorOptions& options, const Machine& machine) {
  const double begin_s = MonotonicSeconds();
  Examination result;
  const Setup setup = LoadSetup(options.config_dir, &result.findings);
  Append(CheckTogether(setup), &result.findings);
  bool late = false;
  const Machine limited = WithDeadline(machine, begin_s + kLastProgramS, &late);
  std::optional<DiskChecks> disk;  // before the bus, which has threads
  if (const auto logger = setup.dives.find("logger"); logger != setup.dives.end())
    disk.emplace(limited, logger->second.dives_dir);
  const std::string url = UrlOf(options);
  const std::unique_ptr<BusWatch> watch = OpenBus(url, &result.findings);
  CheckMachine(setup, url, limited, &result.findings);
  if (late)
    result.findings.push_back(Warning(
        "computer",
        "this computer: ip and systemctl respond too slowly, some of the above is not known",
        "Look at its load (top), and run the doctor again."));
  if (watch) watch->Listen(kListenS);
  if (disk) Append(disk->WaitUntil(begin_s + kDiskS), &result.findings);
  if (!watch) return result;
  while (!watch->AllAnswered(setup) && MonotonicSeconds() - begin_s < kAtMostS) watch->Listen(0.2);
  CheckBus(setup, !options.under_water, watch.get(), &result.findings);
  result.roll = watch->roll;
  result.configs = watch->configs;
  return result;
}

int RunDoctor(const DoctorOptions& options) {
  const Findings findings = Examine(options).findings;
  constexpr std::size_t kColumns = 100;
  std::fputs((options.json ? ToJson(findings) : ToText(findings, kColumns)).c_str(), stdout);
  return static_cast<int>(Worst(findings));
}

}  // namespace seastitch
