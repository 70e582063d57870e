#include "mapper/sensor_clocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "common/core/channel_names.hpp"
#include "common/core/median.hpp"
#include "mapper/utc_text.hpp"

namespace seastitch {
namespace {

constexpr std::int32_t kSureAfter = 3;  // messages
// HEALTH is sent once a second: without it for less than this, processes do not count as silent.
constexpr double kHeardS = 3.0;
constexpr double kLongestBetweenHealthS = 1.5;
// Largest displacement of a channel's messages in their order.
constexpr std::int64_t kReordered = 16;
constexpr std::int64_t kLastSeq = std::int64_t{1} << 53;
constexpr Time kLatest = FromUtime(7'258'118'400'000'000);  // the year 2200
constexpr double kLongestUptimeS = 1e9;
constexpr double kLongestIntervalS = 10.0;
constexpr double kEventHoldsS = 60.0;
constexpr double kSilentS = 2.0;
constexpr double kSilentIntervals = 2.5;
constexpr double kSilentProcessS = 2.5;
constexpr double kDriftS = 0.2;
constexpr std::size_t kMostProcesses = 64;

constexpr std::array<const char*, kSensorChannels> kNames{channels::kImu,
                                                          channels::kDvl,
                                                          channels::kDepth,
                                                          channels::kIns,
                                                          channels::kMbesPing,
                                                          channels::kMbesSoundings,
                                                          channels::kPositionFix,
                                                          channels::kSvp};

// True for messages that come at any time, about any time before.
bool IsRare(std::size_t channel) {
  return channel == static_cast<std::size_t>(SensorChannel::kPositionFix) ||
         channel == static_cast<std::size_t>(SensorChannel::kSvp);
}

double Size(Duration d) { return std::abs(ToSeconds(d)); }

bool IsOwn(const std::string& process) {
  constexpr std::array<std::string_view, 7> kOwn{
      "imu-driver", "dvl-driver", "mbes-driver", "nav-driver", "mapper", "optimizer", "logger"};
  return std::find(kOwn.begin(), kOwn.end(), process) != kOwn.end();
}

}  // namespace

std::optional<Duration> DurationOf(const MbesPing& ping) {
  const Duration duration = LastEcho(ping) - ping.time;
  return duration > Duration::zero() ? std::optional(duration) : std::nullopt;
}

std::optional<Duration> DurationOf(const SoundingPing& ping) {
  constexpr double kSoundMps = 1500.0;
  double farthest_m = 0.0;
  for (const LevelSounding& sounding : ping.soundings)
    if ((sounding.flags & kBeamValid) != 0)
      farthest_m = std::max(farthest_m, static_cast<double>(sounding.p_level_m.norm()));
  if (farthest_m == 0.0) return std::nullopt;
  return FromSeconds(std::min<double>(2.0 * farthest_m / kSoundMps, kMaxTravelTime_s));
}

double SensorClocks::Channel::interval_s() const {
  if (intervals == 0) return 0.0;
  const auto n = std::min<std::ptrdiff_t>(intervals, kIntervals);
  return Median(std::vector<double>(intervals_s.begin(), intervals_s.begin() + n));
}

void SensorClocks::Channel::AddInterval(double interval_s) {
  // The heads of one sonar send at the same time: 0 is no interval between two measurements.
  if (interval_s <= 0.0 || interval_s > kLongestIntervalS) return;
  intervals_s[static_cast<std::size_t>(intervals) % kIntervals] = interval_s;
  // A ring: counts up to twice its size, then continues at its size.
  intervals = intervals + 1 < 2 * static_cast<std::int32_t>(kIntervals)
                  ? intervals + 1
                  : static_cast<std::int32_t>(kIntervals);
}

std::optional<double> SensorClocks::Latency::Add(const Era& message, Duration measured) {
  if (open_s.empty()) begin = message;
  open_s.push_back(ToSeconds(message.ReceivedAt() - message.At() - measured));
  if (open_s.size() < kLatencies) return std::nullopt;
  last_s = Median(std::exchange(open_s, {}));
  if (!first_s) first_s = last_s;
  const double received_s = ToSeconds(message.ReceivedAt() - begin.ReceivedAt());
  return ToSeconds(message.At() - begin.At()) / std::max(received_s, 1e-3);
}

// --- the dive's time -----------------------------------------------------------------------------

Time SensorClocks::InDiveTime(SensorChannel channel,
                              Time utime,
                              const MessageStamp& stamp,
                              std::optional<Duration> measured) {
  Channel& c = channels_[static_cast<std::size_t>(channel)];
  if (stamp.seq < 0 || stamp.seq > kLastSeq) return utime + c.era.utime_offset;  // damaged message
  // A message without receive stamp counts as received at its utime.
  const bool says_when = stamp.recv > Time() && stamp.recv < kLatest;
  const Era message{utime, says_when ? stamp.recv : utime, stamp.seq};
  if (!c.has_come) {
    Begin(&c, message);
  } else {
    const double recv_s = ToSeconds(message.recv - c.era.recv);
    const bool repeated = message.seq <= c.era.seq && c.era.seq - message.seq < kReordered &&
                          std::abs(recv_s) <= jump_s_;
    if (repeated) return utime + c.era.utime_offset;
    if (c.before && Follows(c, *c.before, message)) {
      ++counters_["stamps_damaged"];
      c.era = *std::exchange(c.before, std::nullopt);
      c.era.utime = message.utime;
      c.era.recv = message.recv;
      c.era.seq = message.seq;
    } else {
      const Era last = c.era;
      c.era = Next(channel, c, message);
      if (c.era.messages == 1 && !c.before) c.before = last;
      if (c.era.messages >= kSureAfter && !c.before && message.seq == last.seq + 1)
        c.AddInterval(ToSeconds(message.utime - last.utime));
      if (c.before && c.era.messages >= kSureAfter) Confirm(channel, &c);
    }
  }
  if (health_time_s_ > c.health_time_s) c.heard = c.era.ReceivedAt();
  c.health_time_s = health_time_s_;
  // Received during its own measurement: a time written by a program that imported a file.
  const bool is_received =
      measured && !(message.recv >= message.utime && message.recv < message.utime + *measured);
  if (is_received && !IsRare(static_cast<std::size_t>(channel)))
    if (const auto pace = c.latency.Add(c.era, *measured)) pace_ = *pace;
  return c.era.At();
}

// First message of a channel. After a step of the computer's clock its stamps may be by that clock
// or by the sensor's own: the smaller latency decides.
void SensorClocks::Begin(Channel* c, const Era& message) const {
  c->has_come = true;
  c->era = message;
  c->era.recv_offset = c->era.computer = computer_;
  c->era.messages = kSureAfter;
  const Duration late = message.recv - message.utime;
  if (Size(late) <= Size(late + computer_)) c->era.utime_offset = computer_;
}

bool SensorClocks::IsNormal(double passed_s, double typical_s) const {
  return passed_s >= -jump_s_ && passed_s <= typical_s + jump_s_;
}

// True if no clock stepped between the two messages.
bool SensorClocks::Follows(const Channel& c, const Era& era, const Era& message) const {
  if (message.seq <= era.seq) return false;
  const double typical_s = static_cast<double>(message.seq - era.seq) * c.interval_s();
  return IsNormal(ToSeconds(message.recv - era.recv), typical_s) &&
         IsNormal(ToSeconds(message.utime - era.utime), typical_s);
}

SensorClocks::Era SensorClocks::Next(SensorChannel channel, const Channel& c, Era message) const {
  const Era& last = c.era;
  const bool goes_on = message.seq > last.seq;  // false: its driver was restarted
  const double count = goes_on ? static_cast<double>(message.seq - last.seq) : 1.0;
  const double typical_s = count * c.interval_s();

  const Duration computer = ComputerStep(c, message, typical_s);
  message.recv_offset = last.recv_offset + computer;
  message.computer = last.computer;
  // The step is known from another sensor's stamps.
  const bool is_known = last.computer != computer_ && message.recv_offset == computer_;
  if (is_known) message.computer = computer_;
  message.utime_offset = last.utime_offset;

  const Duration received = message.ReceivedAt() - last.ReceivedAt();
  Duration passed = message.utime - last.utime;
  if (Size(passed + computer - received) < Size(passed - received)) {
    message.utime_offset += computer;
    passed += computer;
  }
  const double off_s = ToSeconds(passed - received);
  const bool comparable = received > Duration::zero() && IsRealTime();
  const bool stepped = goes_on && std::abs(off_s) > jump_s_ && comparable &&
                       !IsNormal(ToSeconds(passed), typical_s) &&
                       !IsRare(static_cast<std::size_t>(channel));
  if (stepped) message.utime_offset -= passed - received;
  const bool is_new = !goes_on || stepped || (computer != Duration::zero() && !is_known);
  message.messages = is_new ? 1 : std::min(last.messages + 1, kSureAfter);
  return message;
}

// Correction to add to the computer's clock from this message on.
Duration SensorClocks::ComputerStep(const Channel& c, const Era& message, double typical_s) const {
  const double passed_s = ToSeconds(message.recv - c.era.recv);
  if (c.era.computer != computer_) {
    // The message may have been sent before the clock stepped.
    const bool may_be_older = !c.before && IsNormal(passed_s, typical_s) && computer_stepped_at_ &&
                              ToSeconds(*newest() - *computer_stepped_at_) < jump_s_;
    return may_be_older ? Duration::zero() : computer_ - c.era.recv_offset;
  }
  if (message.seq <= c.era.seq) return {};
  if (passed_s < -jump_s_) return FromSeconds(typical_s - passed_s);
  const double health_time_s = health_time_s_ - c.health_time_s;
  const bool heard =
      health_time_s > 0.0 || (c.heard && ToSeconds(c.era.ReceivedAt() - *c.heard) <= kHeardS);
  const double elapsed_s = health_time_s > typical_s + kHeardS ? health_time_s : typical_s;
  if (heard && passed_s - elapsed_s > kHeardS) return FromSeconds(elapsed_s - passed_s);
  return {};
}

void SensorClocks::Confirm(SensorChannel channel, Channel* c) {
  const Era before = *std::exchange(c->before, std::nullopt);
  const Duration computer = c->era.recv_offset - before.recv_offset;
  if (c->era.recv_offset != computer_) {  // false: another sensor confirmed it before
    computer_ = c->era.computer = c->era.recv_offset;
    computer_stepped_at_ = c->era.ReceivedAt();
    ++counters_["clock_steps_computer"];
    Note("the computer's clock", -computer);
  }
  Duration own = c->era.utime_offset - before.utime_offset;
  if (own == Duration::zero() || own == computer) return;
  if (Size(own - computer) < Size(own)) own -= computer;
  const std::string name = kNames[static_cast<std::size_t>(channel)];
  ++counters_["clock_steps_" + name];
  Note("the clock of " + name, -own);
}

void SensorClocks::Note(const std::string& whose, Duration step) {
  char text[120];
  std::snprintf(text, sizeof text, "%s by %+.3f s", whose.c_str(), ToSeconds(step));
  last_step_ = text;
  last_step_at_ = newest();
}

void SensorClocks::Hear(const std::string& process, double uptime_s) {
  if (!(uptime_s >= 0.0 && uptime_s < kLongestUptimeS)) return;
  const auto known = processes_.find(process);
  if (known == processes_.end() && processes_.size() >= kMostProcesses) return;
  const bool is_first = known == processes_.end();
  Process& p = processes_[process];
  const double last_s = std::exchange(p.uptime_s, uptime_s);
  const bool restarted = !is_first && uptime_s < last_s;
  if (restarted) p.before_restart_s = last_s;
  const bool is_other = p.before_restart_s && uptime_s >= *p.before_restart_s &&
                        uptime_s - last_s > kLongestBetweenHealthS;
  if (is_first || restarted || is_other) p.to_health_time_s = health_time_s_ - uptime_s;
  health_time_s_ = std::max(health_time_s_, uptime_s + p.to_health_time_s);
  p.heard_s = health_time_s_;
}

// Uses the channels received after the newest HEALTH; the silence of the others is measured by
// HEALTH.
std::optional<Time> SensorClocks::newest() const {
  double last_health_time_s = 0.0;
  for (const Channel& c : channels_)
    if (c.has_come) last_health_time_s = std::max(last_health_time_s, c.health_time_s);
  std::optional<Time> all;
  for (const Channel& c : channels_) {
    if (!c.has_come || c.health_time_s < last_health_time_s) continue;
    const Time at = c.era.ReceivedAt() + FromSeconds(health_time_s_ - c.health_time_s);
    all = all ? std::max(*all, at) : at;
  }
  return all;
}

// --- what is wrong -------------------------------------------------------------------------------

std::vector<Condition> SensorClocks::conditions() const {
  std::vector<Condition> all;
  const std::optional<Time> at = newest();
  if (last_step_at_ && ToSeconds(*at - *last_step_at_) < kEventHoldsS)
    all.push_back({&conditions::kClockStep, last_step_ + " at " + UtcOf(*last_step_at_)});
  AddSilent(&all);
  AddSilentProcesses(&all);
  AddDrifts(&all);
  return all;
}

void SensorClocks::AddSilent(std::vector<Condition>* all) const {
  std::string names;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    const Channel& c = channels_[i];
    if (!c.has_come || IsRare(i)) continue;
    const double silent_s = ToSeconds(*newest() - c.era.ReceivedAt());
    if (silent_s <= std::max(kSilentS, kSilentIntervals * c.interval_s())) continue;
    char text[60];
    std::snprintf(text,
                  sizeof text,
                  "%s%s since %s",
                  names.empty() ? "" : ", ",
                  kNames[i],
                  UtcOf(c.era.At()).c_str());
    names += text;
  }
  if (!names.empty()) all->push_back({&conditions::kSensorSilent, names});
}

// Of this program's own processes: others on the bus may end whenever they like.
void SensorClocks::AddSilentProcesses(std::vector<Condition>* all) const {
  std::string names;
  for (const auto& [name, process] : processes_)
    if (IsOwn(name) && health_time_s_ - process.heard_s > kSilentProcessS)
      names += (names.empty() ? "" : ", ") + name;
  if (!names.empty()) all->push_back({&conditions::kProcessSilent, names});
}

void SensorClocks::AddDrifts(std::vector<Condition>* all) const {
  std::vector<double> drifts_s;
  for (const Channel& c : channels_)
    if (c.latency.first_s) drifts_s.push_back(c.latency.drift_s());
  if (drifts_s.size() < 2 || !IsRealTime()) return;
  // Of two drifts the smaller one is the common drift.
  std::sort(drifts_s.begin(), drifts_s.end(), [](double a, double b) {
    return std::abs(a) < std::abs(b);
  });
  const double common_s = drifts_s[(drifts_s.size() - 1) / 2];
  std::string names;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    const double drift_s = channels_[i].latency.drift_s();
    if (!channels_[i].latency.first_s || std::abs(drift_s) <= kDriftS ||
        std::abs(drift_s - common_s) <= kDriftS)
      continue;
    char text[80];
    std::snprintf(text,
                  sizeof text,
                  "%s%s has come to lag by %.2f s",
                  names.empty() ? "" : ", ",
                  kNames[i],
                  drift_s);
    names += text;
  }
  if (!names.empty()) all->push_back({&conditions::kClockDrift, names});
}

}  // namespace seastitch
