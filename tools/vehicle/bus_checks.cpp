#include "tools/vehicle/bus_checks.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/pose.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/process/process.hpp"
#include "mapper/input/sensor_clocks.hpp"
#include "seastitch/config_request_t.hpp"
#include "seastitch/config_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/navigation_t.hpp"
#include "seastitch/position_fix_t.hpp"

namespace seastitch {
namespace {

constexpr double kSilentS = 3.0;

template <class... Args>
std::string Format(const char* format, Args... args) {
  char text[200];
  std::snprintf(text, sizeof text, format, args...);
  return text;
}

double Norm(const double (&v)[3]) { return Hypotenuse(Hypotenuse(v[0], v[1]), v[2]); }

std::string RemedyOf(const std::string& condition) {
  for (const ConditionKind* kind : conditions::kAll)
    if (condition == kind->name) return kind->remedy;
  return "See docs/health.md.";
}

// Findings for the faults that a process reports.
Findings FaultsOf(const std::string& process, const health_t& health) {
  Findings findings;
  for (const condition_t& condition : health.conditions) {
    const std::string text = process + ": " + condition.sentence;
    const std::string remedy = RemedyOf(condition.name);
    const bool lost = condition.severity == health_t::STATE_LOST;
    findings.push_back(lost ? Error("process", text, remedy) : Warning("process", text, remedy));
  }
  if (findings.empty() && health.state == health_t::STATE_STARTING)
    findings.push_back(Warning("process",
                               process + ": starting, " + health.text,
                               "Wait for what it names, and run the doctor again."));
  if (findings.empty()) findings.push_back(Ok("process", process + ": ok, " + health.text));
  return findings;
}

Finding VersionFinding(const BusWatch& watch) {
  std::map<std::string, std::string> who;  // processes by version
  who[ProgramVersion()] = "seastitch";
  for (const std::string& process : watch.roll.names())
    if (const health_t* health = watch.roll.Find(process)) {
      std::string& names = who[health->version];
      names += (names.empty() ? "" : ", ") + process;
    }
  if (who.size() == 1) return Ok("versions", std::string("versions: all are ") + ProgramVersion());
  std::string text = "versions differ:";
  for (const auto& [version, names] : who) text += " " + version + " (" + names + ")";
  return Error("versions",
               text,
               "Install one version everywhere, then sudo systemctl restart seastitch.target.");
}

// The device of a channel, as its driver names it in HEALTH. nav-driver reads several.
std::string DeviceOf(const std::string& channel, const std::string& process) {
  if (process == kNavDriver) return channel == channels::kIns ? "ins" : "depth";
  return process.substr(0, process.find("-driver"));
}

// State of the clock model of a channel's device, which its driver reports.
std::string ClockText(const BusWatch& watch,
                      const std::string& channel,
                      const std::string& process) {
  const health_t* const health = watch.roll.Find(process);
  const auto figure = [&](HealthValue which) {
    return health != nullptr ? ValueIn(*health, which, DeviceOf(channel, process)) : std::nullopt;
  };
  const std::optional<std::int64_t> settled = figure(HealthValue::kClockSettled);
  if (!settled) return "stamped on receipt";
  if (*settled == 0) return "clock model not settled yet";
  return Format("clock %+.1f ms, %+.1f ppm",
                1e-3 * static_cast<double>(figure(HealthValue::kClockOffset).value_or(0)),
                1e-3 * static_cast<double>(figure(HealthValue::kClockDrift).value_or(0)));
}

// In the unit that a person would take.
std::string DurationText(double seconds) {
  constexpr double kHourS = 3600.0, kDayS = 86400.0;
  if (std::abs(seconds) >= 2.0 * kDayS) return Format("%.1f days", seconds / kDayS);
  if (std::abs(seconds) >= 2.0 * kHourS) return Format("%.1f h", seconds / kHourS);
  return Format("%.3f s", seconds);
}

Findings SensorFindings(const BusWatch& watch,
                        const std::string& channel,
                        const std::string& process) {
  const auto found = watch.latency_s.find(channel);
  if (found == watch.latency_s.end() || found->second.count == 0)
    return {Error("sensor",
                  channel + ": not heard",
                  "Check the sensor's power and cable, and what " + process + " says above.")};
  const Heard& latency = found->second;
  const std::string is = Format("%s: %.1f a second, stamps %s behind receipt, ",
                                channel.c_str(),
                                latency.rate_hz(),
                                DurationText(latency.mean()).c_str()) +
                         ClockText(watch, channel, process);
  constexpr double kMaxLatencyS = 1.0;
  if (std::abs(latency.mean()) > kMaxLatencyS)  // a single late message only shows a busy machine
    return {Error("sensor",
                  is,
                  "The sensor's clock and ours differ: discipline both (NTP, PTP, 1PPS), or set "
                  "clock: model or receive in its driver's file.")};
  return {Ok("sensor", is)};
}

// Positions come at the surface, and not at a steady rate.
Findings FixFindings(const BusWatch& watch) {
  const std::string name = channels::kPositionFix;
  const auto found = watch.latency_s.find(name);
  if (found != watch.latency_s.end() && std::abs(found->second.mean()) > kFixLatencyS)
    return {
        Error("sensor",
              name + ": stamps " + DurationText(found->second.mean()) + " behind receipt",
              "The clock of its source and ours differ (GPS time in place of UTC is 18 s ahead; "
              "an overflowed week count is 1024 weeks back): correct it, or set clock: model or "
              "receive in nav_driver.yaml.")};
  if (found != watch.latency_s.end())
    return {Ok("sensor", name + ": heard, " + std::to_string(found->second.count) + " positions")};
  return {
      Warning("sensor",
              name + ": not heard, though nav_driver.yaml has a source of positions",
              "A GPS receiver needs free sight of the sky, a USBL its transceiver in the water: "
              "check power and cable, and what nav-driver says above. Under water: seastitch "
              "doctor --under-water.")};
}

struct Plausible {
  std::string name;
  const Heard& heard;
  double low, high;
  const char* unit;
  const char* remedy;
  Finding::Level otherwise = Finding::Level::kError;
};

Findings ValueFindings(const Plausible& value) {
  if (value.heard.count == 0) return {};  // its silence is already a finding
  const std::string is = Format("%s: %.2f %s", value.name.c_str(), value.heard.mean(), value.unit);
  if (value.heard.mean() >= value.low && value.heard.mean() <= value.high) return {Ok("value", is)};
  return {{.level = value.otherwise,
           .check = "value",
           .text = is + Format(", expected %g to %g", value.low, value.high),
           .remedy = value.remedy}};
}

}  // namespace

void Heard::Add(double value, double recv_s) {
  if (count == 0) first_s = recv_s;
  last_s = recv_s;
  ++count;
  sum += value;
  high = std::max(high, value);
}

template <class Msg, class Take>
void BusWatch::Sense(const char* channel, Take take) {
  bus_.Subscribe<Msg>(channel, QueueOf(channel), [this, channel, take](const Msg& msg) {
    const double recv_s = 1e-6 * static_cast<double>(msg.recv_utime);
    latency_s[channel].Add(1e-6 * static_cast<double>(msg.recv_utime - msg.utime), recv_s);
    take(msg, recv_s);
  });
}

BusWatch::BusWatch(const std::string& lcm_url)
    : bus_(lcm_url), sender_("doctor-" + std::to_string(getpid())) {
  bus_.fd();  // throws if nothing can be received
  bus_.Subscribe<health_t>(channels::kHealth,
                           QueueOf(channels::kHealth),
                           [this](const health_t& msg) { roll.Add(msg, MonotonicSeconds()); });
  bus_.Subscribe<config_t>(channels::kConfig, 0, [this](const config_t& msg) {
    if (const auto file = files_.Add(msg)) configs[file->process][file->name] = file->text;
  });
  bus_.Subscribe<config_request_t>(
      channels::kConfigRequest, 0, [this](const auto& msg) { loopback |= msg.sender == sender_; });
  Sense<imu_t>(channels::kImu, [this](const imu_t& msg, double recv_s) {
    specific_force_mps2.Add(Norm(msg.specific_force_mps2), recv_s);
  });
  Sense<dvl_t>(channels::kDvl, [this](const dvl_t& msg, double recv_s) {
    bottom_lock.Add(msg.bottom_lock ? 1.0 : 0.0, recv_s);
    if (msg.bottom_lock) speed_mps.Add(Norm(msg.v_dvl_mps), recv_s);
  });
  Sense<navigation_t>(channels::kIns, [](const navigation_t&, double) {});
  Sense<position_fix_t>(channels::kPositionFix, [](const position_fix_t&, double) {});
  Sense<depth_t>(channels::kDepth,
                 [this](const depth_t& msg, double recv_s) { depth_m.Add(msg.depth_m, recv_s); });
  Sense<mbes_ping_t>(channels::kMbesPing, [this](const mbes_ping_t& msg, double recv_s) {
    sound_speed_mps.Add(msg.sound_speed_mps, recv_s);
    const auto valid = std::count_if(msg.flags.begin(), msg.flags.end(), [](std::uint8_t flags) {
      return (flags & mbes_ping_t::FLAG_VALID) != 0;
    });
    if (msg.num_beams > 0) valid_beams.Add(static_cast<double>(valid) / msg.num_beams, recv_s);
  });
  config_request_t request{};
  request.utime = NowUtime();
  request.sender = sender_;
  bus_.Publish(channels::kConfigRequest, request);
}

void BusWatch::Listen(double seconds) {
  const double end_s = MonotonicSeconds() + seconds;
  while (MonotonicSeconds() < end_s) {
    pollfd waiting{bus_.fd(), POLLIN, 0};
    if (poll(&waiting, 1, 100) > 0) bus_.HandleAll(Bus::kBurst);
  }
}

bool BusWatch::Answered(const std::string& process, const Setup& setup) const {
  const auto wanted = setup.texts.find(process);
  if (wanted == setup.texts.end()) return true;
  const auto said = configs.find(process);
  return said != configs.end() &&
         std::all_of(wanted->second.begin(), wanted->second.end(), [&](const auto& file) {
           return said->second.contains(file.first);
         });
}

bool BusWatch::AllAnswered(const Setup& setup) const {
  return std::all_of(setup.texts.begin(), setup.texts.end(), [&](const auto& wanted) {
    return roll.Find(wanted.first) == nullptr || Answered(wanted.first, setup);
  });
}

Findings CheckLoopback(const BusWatch& watch) {
  if (watch.loopback) return {Ok("lcm_loopback", "LCM: what is sent here is heard here")};
  return {Error("lcm_loopback",
                "LCM: what is sent here is not heard here",
                "Check the multicast route (above), a firewall (sudo nft list ruleset), and the "
                "LCM URL.")};
}

Findings CheckProcesses(const BusWatch& watch, const Setup& setup, double now_s) {
  Findings findings;
  std::vector<std::string> processes = watch.roll.names();
  for (const char* const process : kOptionalProcesses)
    if (setup.Needs(process) && watch.roll.Find(process) == nullptr) processes.push_back(process);
  for (const std::string& process : processes) {
    const health_t* const health = watch.roll.Find(process);
    const std::string unit = "seastitch-" + process;
    if (health == nullptr && !setup.Needs(process)) continue;
    if (health == nullptr || watch.roll.SilentFor(process, now_s) > kSilentS) {
      findings.push_back(Error("process",
                               process + ": not heard",
                               (IsOptional(process) ? "sudo systemctl enable --now " + unit
                                                    : "sudo systemctl start seastitch.target") +
                                   "; why it does not run: systemctl status " + unit));
      continue;
    }
    if (watch.roll.IsTwice(process, now_s))
      findings.push_back(Error("process_twice",
                               process + ": runs twice",
                               "End one: pgrep -a " + unit +
                                   " shows them; on another computer, "
                                   "its LCM reaches this one."));
    if (IsOurs(process)) Append(FaultsOf(process, *health), &findings);
  }
  findings.push_back(VersionFinding(watch));
  return findings;
}

Findings CheckRunningConfigs(const BusWatch& watch, const Setup& setup) {
  Findings findings;
  for (const auto& [process, files] : setup.texts) {
    if (watch.roll.Find(process) == nullptr) continue;  // already a finding
    const std::string unit = "seastitch-" + process;
    if (!watch.Answered(process, setup)) {
      findings.push_back(Warning("running_configuration",
                                 process + ": did not say its configuration",
                                 "Run the doctor again in 10 s; else restart " + unit + "."));
      continue;
    }
    bool same = true;
    for (const auto& [name, text] : files) {
      if (watch.configs.at(process).at(name) == text) continue;
      same = false;
      findings.push_back(Error("running_configuration",
                               process + ": runs with another " + name + " than the file's",
                               "sudo systemctl restart " + unit +
                                   ", or name its folder with "
                                   "--config-dir."));
    }
    if (same)
      findings.push_back(Ok("running_configuration", process + ": runs with what its files say"));
  }
  return findings;
}

Findings CheckSensors(const BusWatch& watch, const Setup& setup, bool at_surface) {
  std::vector<std::pair<const char*, const char*>> sensors{{channels::kMbesPing, "mbes-driver"}};
  if (setup.given_navigation)
    sensors.emplace_back(
        channels::kIns,
        setup.nav_channels.contains(channels::kIns) ? kNavDriver : "what publishes INS");
  else
    for (const char* channel : {channels::kImu, channels::kDvl, channels::kDepth})
      sensors.emplace_back(channel, channel == channels::kImu ? "imu-driver" : "dvl-driver");
  if (setup.nav_channels.contains(channels::kDepth)) {
    std::erase_if(sensors, [](const auto& s) { return s.first == channels::kDepth; });
    sensors.emplace_back(channels::kDepth, kNavDriver);
  }
  Findings findings;
  for (const auto& [channel, process] : sensors)
    Append(SensorFindings(watch, channel, process), &findings);
  if (at_surface && setup.nav_channels.contains(channels::kPositionFix))
    Append(FixFindings(watch), &findings);
  Append(ValueFindings({"gravity, as the inertial unit feels it",
                        watch.specific_force_mps2,
                        9.3,
                        10.3,
                        "m/s^2",
                        "Check the signals, their units and factors in imu_driver.yaml."}),
         &findings);
  Append(ValueFindings({"sound speed at the sonar",
                        watch.sound_speed_mps,
                        1400.0,
                        1600.0,
                        "m/s",
                        "Check the sonar's sound-speed probe. Normal out of the water.",
                        Finding::Level::kWarning}),
         &findings);
  if (at_surface)
    Append(ValueFindings({"depth, at the surface",
                          watch.depth_m,
                          -2.0,
                          2.0,
                          "m",
                          "Set the zero of the pressure sensor. Under water: seastitch doctor "
                          "--under-water."}),
           &findings);
  Append(ValueFindings({"speed of the Doppler log",
                        watch.speed_mps,
                        0.0,
                        5.0,
                        "m/s",
                        "Check the signals, their units and factors in dvl_driver.yaml."}),
         &findings);
  if (watch.bottom_lock.count > 0 && watch.bottom_lock.high < 0.5)
    findings.push_back(Warning("value",
                               "bottom lock of the Doppler log: none",
                               "Normal out of the water and above its range."));
  if (watch.valid_beams.count > 0 && watch.valid_beams.mean() < 0.2)
    findings.push_back(Warning(
        "value",
        Format("beams of the sonar with an echo: %.0f %%", 100.0 * watch.valid_beams.mean()),
        "Normal out of the water and beyond its range."));
  return findings;
}

}  // namespace seastitch
