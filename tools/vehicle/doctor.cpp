#include "tools/vehicle/doctor.hpp"

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "common/runtime/health.hpp"
#include "tools/vehicle/bus_checks.hpp"
#include "tools/vehicle/machine_checks.hpp"
#include "tools/vehicle/setup.hpp"

namespace seastitch {
namespace {

// HEALTH is sent once a second. A process answers CONFIG_REQUEST at most every 10 s.
constexpr double kListenS = 3.5;
constexpr double kAtMostS = 9.5;
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

void CheckMachine(const Setup& setup,
                  const std::string& url,
                  const Machine& machine,
                  Findings* findings) {
  for (const std::string& interface : setup.can_interfaces())
    Append(CheckCan(machine, interface), findings);
  Append(CheckBuffers(machine, setup.largest_buffer_bytes()), findings);
  Append(CheckRoute(machine, url), findings);
  Append(CheckFilter(machine), findings);
  Append(CheckClock(machine), findings);
  Append(CheckProcessor(machine), findings);
  Append(CheckMemory(machine), findings);
  if (const auto logger = setup.dives.find("logger"); logger != setup.dives.end()) {
    const std::filesystem::path dives_dir = logger->second.dives_dir;
    Append(CheckDisk(dives_dir), findings);
    Append(CheckDataDisk(machine, dives_dir), findings);
    Append(CheckLastDive(dives_dir, NowUtime()), findings);
  }
}

void CheckBus(const Setup& setup, bool at_surface, BusWatch* watch, Findings* findings) {
  Append(CheckLoopback(*watch), findings);
  for (const auto& [process, driver] : setup.drivers) {
    if (driver.source.starts_with("serial:")) Append(CheckSerial(process, driver.source), findings);
    if (driver.source.starts_with("udp:") && watch->roll.Find(process) == nullptr)
      Append(CheckPort(process, driver.source), findings);
  }
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
  const std::string url = UrlOf(options);
  const std::unique_ptr<BusWatch> watch = OpenBus(url, &result.findings);
  CheckMachine(setup, url, machine, &result.findings);
  if (!watch) return result;
  watch->Listen(kListenS);
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
