#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/channel_names.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/input/process_clocks.hpp"

namespace seastitch {

enum class SensorChannel : std::uint8_t {
  kImu,
  kDvl,
  kDepth,
  kIns,
  kMbesPing,
  kMbesSoundings,
  kPositionFix,
  kSvp,
};
inline constexpr std::size_t kSensorChannels = 8;

constexpr SensorChannel ChannelOf(const ImuSample&) { return SensorChannel::kImu; }
constexpr SensorChannel ChannelOf(const DvlSample&) { return SensorChannel::kDvl; }
constexpr SensorChannel ChannelOf(const DepthSample&) { return SensorChannel::kDepth; }
constexpr SensorChannel ChannelOf(const NavigationSample&) { return SensorChannel::kIns; }
constexpr SensorChannel ChannelOf(const MbesPing&) { return SensorChannel::kMbesPing; }
constexpr SensorChannel ChannelOf(const SoundingPing&) { return SensorChannel::kMbesSoundings; }
constexpr SensorChannel ChannelOf(const PositionFix&) { return SensorChannel::kPositionFix; }
constexpr SensorChannel ChannelOf(const SoundVelocityProfile&) { return SensorChannel::kSvp; }

// The name of its LCM channel.
constexpr const char* NameOf(SensorChannel channel) {
  constexpr std::array<const char*, kSensorChannels> kNames{channels::kImu,
                                                            channels::kDvl,
                                                            channels::kDepth,
                                                            channels::kIns,
                                                            channels::kMbesPing,
                                                            channels::kMbesSoundings,
                                                            channels::kPositionFix,
                                                            channels::kSvp};
  return kNames[static_cast<std::size_t>(channel)];
}

// Index of a channel whose messages come at any time, about any time before.
constexpr bool IsRare(std::size_t channel) {
  return channel == static_cast<std::size_t>(SensorChannel::kPositionFix) ||
         channel == static_cast<std::size_t>(SensorChannel::kSvp);
}

// Duration of a measurement, from its stamp to its last echo: a message cannot come before its end.
// Absent: not known, since no beam has an echo.
template <class Sample>
constexpr std::optional<Duration> DurationOf(const Sample&) {
  return Duration::zero();
}
std::optional<Duration> DurationOf(const MbesPing& ping);
// Of points the travel time of the farthest one, at 1500 m/s: within 4 %.
std::optional<Duration> DurationOf(const SoundingPing& ping);

// Longest latency of a position fix: an acoustic one takes some seconds.
inline constexpr double kFixLatencyS = 5.0;

// How much of the dive depends on the time scale of the inertial unit (or INS).
enum class DiveStage : std::uint8_t {
  kStarting,    // no state of navigation yet
  kNavigating,  // states, and no submap
  kMapping,
};

// Corrector of clock steps: turns stamps into dive time, the UTC of the clocks at the start of the
// dive, continued as if no clock had been set since. Every message has two stamps: utime by the
// sensor's clock, recv by the computer's, which all sensors share. Sequence numbers distinguish a
// clock step from lost messages. The nominal interval of the messages gives the size of the step.
//
//   what is seen                                  what is concluded
//   recv leaps, the heartbeats show the same      the computer's clock was set
//   recv leaps, the heartbeats show no step       the receive stamps of this sensor stepped
//   the same, while the heartbeats saw time pass  the sensor was silent
//   the same, on several sensors                  forward a gap in the data; back an earlier place
//                                                 in a log, as from a player (RewindWatch)
//   recv goes back, no heartbeat can tell         the computer's clock, if two sensors agree on it
//   recv goes forward, no heartbeat can tell      the sensor was silent
//   utime leaps, recv does not                    the sensor's clock was set
//   utime and recv leap by the same               the sensor's clock is set by the computer's
//
// A step is corrected from its first message on. A step of a sensor's clock is confirmed by the
// third message. If a message with stamps as before the step comes earlier, the messages between
// were damaged and are counted; their samples have been used. Fixes and profiles come at any time,
// about any time before, and decide nothing.
//
// A confirmed step is taken off (held), so that dive time goes on; it is followed where the stamps
// after it agree with more of the other sensors and receive stamps than those before it: then the
// clock was wrong before. While the dive starts, the stamps after a step also win a draw. The
// inertial unit's clock is followed until the first submap; where navigation has started, it has to
// begin again. Not corrected, since navigation treats them as gaps in the data: steps of up to
// jump_s (navigation.clock_jump_s), and steps of the computer's clock by up to 3 s forward.
// Pure: no clock of its own, no input or output.
class SensorClocks {
 public:
  explicit SensorClocks(double jump_s) : jump_s_(jump_s) {}

  // Returns utime + offset(channel), after updating the offset by this message's stamps. The time
  // of a sensor that sends out of order is not monotonic. measured: DurationOf() the sample.
  Time InDiveTime(SensorChannel channel,
                  Time utime,
                  const MessageStamp& stamp,
                  std::optional<Duration> measured = Duration::zero());
  // Adds a heartbeat of any process on this computer: see ProcessClocks.
  void OnHeartbeat(const Heartbeat& heartbeat);
  void SetStage(DiveStage stage) { stage_ = stage; }
  // True once after the inertial unit's time scale has changed: states of navigation so far are by
  // a clock that was wrong.
  bool TakeRestart() { return std::exchange(restart_, false); }

  // Seconds that passed, by the uptimes in HEALTH, since the first HEALTH message that this object
  // heard.
  double health_time_s() const { return processes_.elapsed_s(); }

  // Now, in dive time: arrival (recv) of the newest message, plus the time by HEALTH since then.
  std::optional<Time> newest() const;
  // Arrival (recv) of a channel's newest message, in dive time.
  Time came_at(SensorChannel channel) const { return Of(channel).segment.ReceivedAt(); }
  // Correction added to the utime of a channel's last message.
  Duration offset(SensorChannel channel) const { return Of(channel).segment.utime_offset; }

  // Faults: a clock step within the last minute; a sensor whose latency has changed by 0.2 s
  // against the others; position fixes of the last minute by another clock than the others; a
  // sensor that is silent for 2 s and 2.5 of its intervals; a process whose HEALTH has not come
  // for 2.5 s.
  std::vector<Condition> conditions() const;
  const Counters& counters() const { return counters_; }

  // For a restart. Not saved: processes_, accounted_, unseen_since_s_, leap_, restart_ and
  // counters_, which begin anew with the process; jump_s_, which is configured; stage_, which the
  // caller sets.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.channels_, self.computer_, self.computer_stepped_at_, self.last_step_);
    archive(self.last_step_at_, self.pace_);
  }

 private:
  static constexpr std::size_t kIntervals = 5;
  static constexpr std::size_t kLatencies = 63;

  // Last message of a channel, with the offsets that take its stamps to dive time.
  struct ClockSegment {
    Time utime;
    Time recv;
    std::int64_t seq = 0;
    Duration utime_offset{};
    Duration recv_offset{};
    Duration computer{};        // value of computer_ that recv_offset was last compared with
    std::int32_t messages = 0;  // since the last clock step; stays at kSureAfter

    Time At() const { return utime + utime_offset; }
    Time ReceivedAt() const { return recv + recv_offset; }

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.utime, self.recv, self.seq, self.utime_offset, self.recv_offset);
      archive(self.computer, self.messages);
    }
  };

  // Latency of a channel in dive time [s], from the end of the measurement to recv: medians over
  // kLatencies messages.
  struct Latency {
    // Returns seconds of utime per second of recv, once every kLatencies messages.
    std::optional<double> Add(const ClockSegment& message, Duration measured);
    double drift_s() const { return first_s && last_s ? *last_s - *first_s : 0.0; }

    ClockSegment begin;             // first message in open_s
    std::vector<double> open_s;     // latencies of the median to come
    std::optional<double> first_s;  // first median
    std::optional<double> last_s;   // last median

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.begin, self.open_s, self.first_s, self.last_s);
    }
  };

  struct Channel {
    bool has_come = false;
    ClockSegment segment;
    std::optional<ClockSegment> before;  // before a step that is not confirmed yet
    std::array<double, kIntervals> intervals_s{};
    std::int32_t intervals = 0;
    Latency latency;
    std::optional<double> health_time_s;  // at its last message
    std::optional<Time> heard;   // arrival of its last message that came after a new HEALTH
    std::vector<double> late_s;  // latencies of the last messages since the last step, newest last

    double interval_s() const;
    void AddInterval(double interval_s);
    void AddLateness(double s);
    // Absent for fewer than three messages since the last step.
    std::optional<double> lateness_s() const;

    // Not saved: health_time_s, heard and late_s, which begin anew with the process.
    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(
          self.has_come, self.segment, self.before, self.intervals_s, self.intervals, self.latency);
    }
  };

  // Leap of receive stamps that may be a step of the computer's clock.
  struct Leap {
    Duration correction;  // the same for all channels that took part in it
    Time at;              // arrival of the first message after it
    double health_time_s;
    bool heartbeats_tell;  // false: two sensors have to agree
    std::array<bool, kSensorChannels> channels{};
  };

  // False for a replay or simulation faster or slower than real time: utime and recv then cannot be
  // compared.
  bool IsRealTime() const { return pace_ > 0.9 && pace_ < 1.1; }
  const Channel& Of(SensorChannel channel) const {
    return channels_[static_cast<std::size_t>(channel)];
  }
  void Begin(Channel* c, const ClockSegment& message) const;
  bool IsNormal(double passed_s, double typical_s) const;
  bool Follows(const Channel& c, const ClockSegment& segment, const ClockSegment& message) const;
  ClockSegment Next(SensorChannel channel, const Channel& c, ClockSegment message) const;
  Duration ComputerStep(const Channel& c, const ClockSegment& message, double typical_s) const;
  void Join(SensorChannel channel, const Channel& c, Duration correction);
  // Decides on leap_, if there is enough evidence by now.
  void Judge();
  void AdoptUnseenStep(Duration step);
  void CorrectLeap(Duration correction);
  void EndLeapAsStep();
  void EndLeapAsNoStep();
  void ConfirmAll(const Leap& leap);
  bool ComputerWasWrong(const Leap& leap) const;
  void TakeBack(const Leap& leap, bool was_wrong);
  bool MovesWithComputer(const Channel& c, const Leap& leap) const;
  // Ends a step of one channel: holds or follows its clock.
  void Confirm(SensorChannel channel);
  bool WasWrong(SensorChannel channel, Duration own) const;
  bool IsPeer(std::size_t channel) const;
  bool IsSilent(const Channel& c) const;
  // Keeps a step for conditions(). whose: name of the clock.
  void Note(const std::string& whose, Duration step, bool followed);
  void AddSilent(std::vector<Condition>* now) const;
  void AddSilentProcesses(std::vector<Condition>* now) const;
  void AddDrifts(std::vector<Condition>* now) const;
  void AddFixClock(std::vector<Condition>* now) const;

  double jump_s_;
  std::array<Channel, kSensorChannels> channels_;
  Duration computer_{};  // added to recv gives dive time
  std::optional<Time> computer_stepped_at_;
  std::string last_step_;
  std::optional<Time> last_step_at_;
  double pace_ = 1.0;  // seconds of utime per second of recv, over the last kLatencies messages
  ProcessClocks processes_;
  Duration accounted_{};                  // of processes_.stepped()
  std::optional<double> unseen_since_s_;  // health_time_s() since a step that no sensor has shown
  std::optional<Leap> leap_;
  DiveStage stage_ = DiveStage::kStarting;
  bool restart_ = false;
  Counters counters_;
};

}  // namespace seastitch
