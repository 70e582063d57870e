#include "mapper/input/sensor_clocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/core/median.hpp"

namespace seastitch {
namespace {

constexpr std::int32_t kSureAfter = 3;  // messages
// HEALTH is sent once a second: without it for less than this, processes do not count as silent.
constexpr double kHeardS = 3.0;
constexpr double kUntilHeardTwiceS = 2.5;
constexpr double kVoteS = 1.0;
constexpr std::size_t kLatenesses = 5;
// Largest displacement of a channel's messages in their order.
constexpr std::int64_t kReordered = 16;
constexpr std::int64_t kLastSeq = std::int64_t{1} << 53;
constexpr Time kLatest = FromUtime(7'258'118'400'000'000);  // the year 2200
constexpr double kLongestIntervalS = 10.0;

double Size(Duration d) { return std::abs(ToSeconds(d)); }

// The channel whose stamps are the time scale of navigation.
bool IsTimeBase(std::size_t channel) {
  return channel == static_cast<std::size_t>(SensorChannel::kImu) ||
         channel == static_cast<std::size_t>(SensorChannel::kIns);
}

// Number of pairs of values that differ by at most `most`.
int PairsWithin(double most, const std::vector<double>& values) {
  int pairs = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) pairs += std::abs(values[i] - values[j]) <= most ? 1 : 0;
  return pairs;
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

void SensorClocks::Channel::AddLateness(double s) {
  if (late_s.size() == kLatenesses) late_s.erase(late_s.begin());
  late_s.push_back(s);
}

std::optional<double> SensorClocks::Channel::lateness_s() const {
  if (late_s.size() < kSureAfter) return std::nullopt;
  return Median(late_s);
}

std::optional<double> SensorClocks::Latency::Add(const ClockSegment& message, Duration measured) {
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
  if (stamp.seq < 0 || stamp.seq > kLastSeq)
    return utime + c.segment.utime_offset;  // damaged message
  // A message without receive stamp counts as received at its utime.
  const bool says_when = stamp.recv > Time() && stamp.recv < kLatest;
  const ClockSegment message{utime, says_when ? stamp.recv : utime, stamp.seq};
  if (!c.has_come) {
    Begin(&c, message);
  } else {
    const double recv_s = ToSeconds(message.recv - c.segment.recv);
    const bool repeated = message.seq <= c.segment.seq &&
                          c.segment.seq - message.seq < kReordered && std::abs(recv_s) <= jump_s_;
    if (repeated) return utime + c.segment.utime_offset;
    const bool is_sure = c.segment.messages >= kSureAfter;
    if (c.before && !is_sure && Follows(c, *c.before, message)) {
      ++counters_["stamps_damaged"];
      c.segment = *std::exchange(c.before, std::nullopt);
      c.segment.utime = message.utime;
      c.segment.recv = message.recv;
      c.segment.seq = message.seq;
    } else {
      const ClockSegment last = c.segment;
      c.segment = Next(channel, c, message);
      if (c.segment.messages == 1 && !c.before) c.before = last;
      const bool moved = c.segment.recv_offset != last.recv_offset;
      if (moved || c.segment.utime_offset != last.utime_offset) c.late_s.clear();
      if (moved && c.segment.computer == last.computer)
        Join(channel, c, c.segment.recv_offset - last.recv_offset);
      if (c.segment.messages >= kSureAfter && !c.before && message.seq == last.seq + 1)
        c.AddInterval(ToSeconds(message.utime - last.utime));
    }
  }
  if (!c.health_time_s || health_time_s() > *c.health_time_s) c.heard = c.segment.ReceivedAt();
  c.health_time_s = health_time_s();
  // Received during its own measurement: a time written by a program that imported a file.
  const bool is_received =
      measured && !(message.recv >= message.utime && message.recv < message.utime + *measured);
  if (measured)
    c.AddLateness(ToSeconds(c.segment.ReceivedAt() - c.segment.At() -
                            (is_received ? *measured : Duration::zero())));
  if (is_received && !IsRare(static_cast<std::size_t>(channel)))
    if (const auto pace = c.latency.Add(c.segment, *measured)) pace_ = *pace;
  const bool waits = leap_ && leap_->channels[static_cast<std::size_t>(channel)];
  if (c.before && !waits && c.segment.messages >= kSureAfter) Confirm(channel);
  Judge();
  return c.segment.At();
}

// First message of a channel. After a step of the computer's clock its stamps may be by that clock
// or by the sensor's own: the smaller latency decides.
void SensorClocks::Begin(Channel* c, const ClockSegment& message) const {
  c->has_come = true;
  c->segment = message;
  c->segment.recv_offset = c->segment.computer = computer_;
  c->segment.messages = kSureAfter;
  const Duration late = message.recv - message.utime;
  if (Size(late) <= Size(late + computer_)) c->segment.utime_offset = computer_;
}

bool SensorClocks::IsNormal(double passed_s, double typical_s) const {
  return passed_s >= -jump_s_ && passed_s <= typical_s + jump_s_;
}

// True if no clock stepped between the two messages.
bool SensorClocks::Follows(const Channel& c,
                           const ClockSegment& segment,
                           const ClockSegment& message) const {
  if (message.seq <= segment.seq) return false;
  const double typical_s = static_cast<double>(message.seq - segment.seq) * c.interval_s();
  return IsNormal(ToSeconds(message.recv - segment.recv), typical_s) &&
         IsNormal(ToSeconds(message.utime - segment.utime), typical_s);
}

SensorClocks::ClockSegment SensorClocks::Next(SensorChannel channel,
                                              const Channel& c,
                                              ClockSegment message) const {
  const ClockSegment& last = c.segment;
  const bool goes_on = message.seq > last.seq;  // false: its driver was restarted
  const double count = goes_on ? static_cast<double>(message.seq - last.seq) : 1.0;
  const double typical_s = count * c.interval_s();

  const bool is_rare = IsRare(static_cast<std::size_t>(channel));
  const bool follows = last.computer != computer_;
  const Duration computer =
      is_rare && !follows ? Duration::zero() : ComputerStep(c, message, typical_s);
  message.recv_offset = last.recv_offset + computer;
  // The step is known from another sensor's stamps, or from the heartbeats.
  const bool is_known = follows && computer != Duration::zero();
  message.computer = is_known ? computer_ : last.computer;
  message.utime_offset = last.utime_offset;

  const Duration received = message.ReceivedAt() - last.ReceivedAt();
  Duration passed = message.utime - last.utime;
  if (Size(passed + computer - received) < Size(passed - received)) {
    message.utime_offset += computer;
    passed += computer;
  }
  const double off_s = ToSeconds(passed - received);
  const bool comparable = received > Duration::zero() && IsRealTime();
  // Also of a sensor that was restarted with its driver.
  const bool stepped = std::abs(off_s) > jump_s_ && comparable &&
                       !IsNormal(ToSeconds(passed), typical_s) && !is_rare;
  if (stepped) message.utime_offset -= passed - received;
  const bool is_new = !goes_on || stepped || (computer != Duration::zero() && !is_known);
  message.messages = is_new ? 1 : std::min(last.messages + 1, kSureAfter);
  return message;
}

// Correction to add to the computer's clock from this message on.
Duration SensorClocks::ComputerStep(const Channel& c,
                                    const ClockSegment& message,
                                    double typical_s) const {
  const double passed_s = ToSeconds(message.recv - c.segment.recv);
  if (c.segment.computer != computer_) {
    // The message may have been sent before the clock stepped.
    const bool may_be_older = !c.before && IsNormal(passed_s, typical_s) && computer_stepped_at_ &&
                              ToSeconds(*newest() - *computer_stepped_at_) < jump_s_;
    return may_be_older ? Duration::zero() : computer_ - c.segment.computer;
  }
  if (message.seq <= c.segment.seq) return {};
  Duration step{};
  if (passed_s < -jump_s_) {
    step = FromSeconds(typical_s - passed_s);
  } else if (c.health_time_s) {
    const double elapsed_s = health_time_s() - *c.health_time_s;
    const bool heard =
        elapsed_s > 0.0 || (c.heard && ToSeconds(c.segment.ReceivedAt() - *c.heard) <= kHeardS);
    const double least_s = elapsed_s > typical_s + kHeardS ? elapsed_s : typical_s;
    if (heard && passed_s - least_s > kHeardS) step = FromSeconds(least_s - passed_s);
  }
  const bool same = leap_ && step != Duration::zero() && Size(step - leap_->correction) <= jump_s_;
  return same ? leap_->correction : step;
}

void SensorClocks::Join(SensorChannel channel, const Channel& c, Duration correction) {
  if (leap_ && correction != leap_->correction) return;  // a leap of its own
  if (!leap_) {
    const bool tell = c.health_time_s && processes_.WouldFindStep(health_time_s());
    leap_ = Leap{correction, c.segment.ReceivedAt(), health_time_s(), tell, {}};
  }
  leap_->channels[static_cast<std::size_t>(channel)] = true;
}

void SensorClocks::Judge() {
  const Duration step = processes_.stepped() - accounted_;
  if (!leap_) return AdoptUnseenStep(step);
  if (step != Duration::zero()) {
    accounted_ += step;
    if (Size(step + leap_->correction) > jump_s_) CorrectLeap(-step);
    return EndLeapAsStep();
  }
  const auto joined = std::count(leap_->channels.begin(), leap_->channels.end(), true);
  if (!leap_->heartbeats_tell && joined >= 2) return EndLeapAsStep();
  const bool over = leap_->heartbeats_tell
                        ? health_time_s() - leap_->health_time_s > kUntilHeardTwiceS
                        : ToSeconds(*newest() - leap_->at) > kVoteS;
  if (over) EndLeapAsNoStep();
}

// A step by the heartbeats, before any sensor's message shows it. Where messages go on without a
// leap, it was too small to be seen: a gap in the data.
void SensorClocks::AdoptUnseenStep(Duration step) {
  if (step == Duration::zero()) return unseen_since_s_.reset();
  if (!unseen_since_s_) unseen_since_s_ = health_time_s();
  if (health_time_s() - *unseen_since_s_ < kUntilHeardTwiceS) return;
  const bool goes_on = std::any_of(channels_.begin(), channels_.end(), [&](const Channel& c) {
    return c.has_come && c.health_time_s && *c.health_time_s > *unseen_since_s_;
  });
  accounted_ += step;
  unseen_since_s_.reset();
  if (goes_on) return;
  computer_ -= step;
  ++counters_["clock_steps_computer"];
  Note("the computer's clock", step, false);
}

// The sensors' own estimate was wrong: they were silent when the clock stepped.
void SensorClocks::CorrectLeap(Duration correction) {
  const Duration more = correction - leap_->correction;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    if (!leap_->channels[i]) continue;
    if (MovesWithComputer(channels_[i], *leap_)) channels_[i].segment.utime_offset += more;
    channels_[i].segment.recv_offset += more;
  }
  leap_->correction = correction;
}

void SensorClocks::EndLeapAsStep() {
  const Leap leap = *std::exchange(leap_, std::nullopt);
  ++counters_["clock_steps_computer"];
  const bool was_wrong = ComputerWasWrong(leap);
  if (was_wrong && stage_ != DiveStage::kMapping) {
    TakeBack(leap, true);
    return Note("the computer's clock", -leap.correction, true);
  }
  computer_stepped_at_ = leap.at;
  computer_ += leap.correction;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    Channel& c = channels_[i];
    if (!leap.channels[i]) continue;
    c.segment.computer = computer_;
    // Sensors with a clock of their own were right all the time: they join the others.
    if (was_wrong && !MovesWithComputer(c, leap)) {
      c.segment.utime_offset += leap.correction;
      c.before.reset();
      c.late_s.clear();
    }
  }
  Note("the computer's clock", -leap.correction, was_wrong);
  ConfirmAll(leap);
}

// No clock of the computer stepped. Where several sensors agree, or the heartbeats were missing
// too, the time itself leapt: forward it was a gap in the data, back another place of a log
// (RewindWatch). Otherwise these receive stamps stepped.
void SensorClocks::EndLeapAsNoStep() {
  const Leap leap = *std::exchange(leap_, std::nullopt);
  const double forward_s = -ToSeconds(leap.correction);
  const auto joined = std::count(leap.channels.begin(), leap.channels.end(), true);
  const bool missed = health_time_s() - leap.health_time_s >= forward_s - kHeardS;
  if (joined >= 2 || (forward_s > 0.0 && missed)) return TakeBack(leap, false);
  ConfirmAll(leap);
}

void SensorClocks::ConfirmAll(const Leap& leap) {
  for (std::size_t i = 0; i < kSensorChannels; ++i)
    if (leap.channels[i] && channels_[i].before && channels_[i].segment.messages >= kSureAfter)
      Confirm(static_cast<SensorChannel>(i));
}

bool SensorClocks::MovesWithComputer(const Channel& c, const Leap& leap) const {
  return c.before && c.segment.utime_offset - c.before->utime_offset == leap.correction;
}

// True if more sensors agree with each other by the clock after the step than by the clock before.
bool SensorClocks::ComputerWasWrong(const Leap& leap) const {
  if (!IsRealTime()) return false;
  std::vector<double> held_s;
  std::vector<double> followed_s;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    if (!leap.channels[i] || IsRare(i) || !channels_[i].lateness_s()) continue;
    held_s.push_back(*channels_[i].lateness_s());
    const bool moves = MovesWithComputer(channels_[i], leap);
    followed_s.push_back(held_s.back() - (moves ? 0.0 : ToSeconds(leap.correction)));
  }
  const int more = PairsWithin(jump_s_, followed_s) - PairsWithin(jump_s_, held_s);
  return more > 0 || (more == 0 && stage_ == DiveStage::kStarting);
}

// Takes the correction off again. was_wrong: the clock was wrong before; channels that have not
// shown the step begin anew.
void SensorClocks::TakeBack(const Leap& leap, bool was_wrong) {
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    Channel& c = channels_[i];
    if (!leap.channels[i]) {
      if (was_wrong && !IsRare(i)) c.has_come = false;
      continue;
    }
    if (MovesWithComputer(c, leap)) {
      c.segment.utime_offset -= leap.correction;
      if (was_wrong && IsTimeBase(i)) restart_ = stage_ == DiveStage::kNavigating;
    }
    c.segment.recv_offset -= leap.correction;
    c.before.reset();
    c.late_s.clear();
    c.latency = {};
  }
}

// --- a step of one channel -----------------------------------------------------------------------

void SensorClocks::Confirm(SensorChannel channel) {
  Channel& c = channels_[static_cast<std::size_t>(channel)];
  const ClockSegment before = *std::exchange(c.before, std::nullopt);
  const Duration computer = c.segment.computer - before.computer;
  const Duration received = c.segment.recv_offset - before.recv_offset - computer;
  const std::string name = NameOf(channel);
  if (received != Duration::zero()) {
    ++counters_["receive_stamps_stepped_" + name];
    Note("the receive stamps of " + name, -received, false);
  }
  Duration own = c.segment.utime_offset - before.utime_offset;
  if (own == Duration::zero() || own == computer) return;
  if (Size(own - computer) < Size(own)) own -= computer;
  ++counters_["clock_steps_" + name];
  const bool follow = WasWrong(channel, own);
  Note("the clock of " + name, -own, follow);
  if (!follow) return;
  c.segment.utime_offset -= own;
  c.late_s.clear();
  c.latency = {};
  if (IsTimeBase(static_cast<std::size_t>(channel))) restart_ = stage_ == DiveStage::kNavigating;
}

// True if the clock agrees with more of the other sensors, and with its receive stamps, after a
// step than before it. own: the correction that was added to utime for this step.
bool SensorClocks::WasWrong(SensorChannel channel, Duration own) const {
  const auto index = static_cast<std::size_t>(channel);
  if (stage_ == DiveStage::kMapping && IsTimeBase(index)) return false;
  const std::optional<double> held_s = channels_[index].lateness_s();
  if (!held_s || !IsRealTime()) return stage_ == DiveStage::kStarting;
  const double followed_s = *held_s + ToSeconds(own);
  std::vector<double> others_s{0.0};  // its receive stamps
  for (std::size_t i = 0; i < kSensorChannels; ++i)
    if (i != index && IsPeer(i)) others_s.push_back(*channels_[i].lateness_s());
  int more = 0;
  for (const double s : others_s)
    more += static_cast<int>(std::abs(followed_s - s) <= jump_s_) -
            static_cast<int>(std::abs(*held_s - s) <= jump_s_);
  return more > 0 || (more == 0 && stage_ == DiveStage::kStarting);
}

// True for a channel whose messages come at present.
bool SensorClocks::IsPeer(std::size_t channel) const {
  const Channel& c = channels_[channel];
  return c.has_come && !IsRare(channel) && c.lateness_s() && !IsSilent(c);
}

void SensorClocks::Note(const std::string& whose, Duration step, bool followed) {
  char text[120];
  std::snprintf(text,
                sizeof text,
                "%s by %+.3f s%s",
                whose.c_str(),
                ToSeconds(step),
                followed ? ", from a wrong time to the right one," : "");
  last_step_ = text;
  last_step_at_ = newest();
}

void SensorClocks::OnHeartbeat(const Heartbeat& heartbeat) {
  processes_.Add(heartbeat);
  Judge();
}

// Uses the channels received after the newest HEALTH; the silence of the others is measured by
// HEALTH.
std::optional<Time> SensorClocks::newest() const {
  bool only_rare = true;
  for (std::size_t i = 0; i < kSensorChannels; ++i)
    only_rare = only_rare && (IsRare(i) || !channels_[i].has_come);
  const auto counts = [&](std::size_t i) {
    return channels_[i].has_come && (only_rare || !IsRare(i));
  };
  double last_health_time_s = 0.0;
  for (std::size_t i = 0; i < kSensorChannels; ++i)
    if (counts(i))
      last_health_time_s = std::max(last_health_time_s, channels_[i].health_time_s.value_or(0.0));
  std::optional<Time> all;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    const Channel& c = channels_[i];
    const double heard_s = c.health_time_s.value_or(0.0);
    if (!counts(i) || heard_s < last_health_time_s) continue;
    const Time at = c.segment.ReceivedAt() + FromSeconds(health_time_s() - heard_s);
    all = all ? std::max(*all, at) : at;
  }
  return all;
}

}  // namespace seastitch
