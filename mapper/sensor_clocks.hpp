#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/conditions.hpp"
#include "common/core/counters.hpp"
#include "common/core/message_stamp.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

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

// Duration of a measurement, from its stamp to its last echo: a message cannot come before its end.
// Absent: not known, since no beam has an echo.
template <class Sample>
constexpr std::optional<Duration> DurationOf(const Sample&) {
  return Duration::zero();
}
std::optional<Duration> DurationOf(const MbesPing& ping);
// Of points the travel time of the farthest one, at 1500 m/s: within 4 %.
std::optional<Duration> DurationOf(const SoundingPing& ping);

// Corrector of clock steps: turns stamps into dive time, the UTC of the clocks at the start of the
// dive, continued as if no clock had been set since. Every message has two stamps: utime by the
// sensor's clock, recv by the computer's, which all sensors share. Sequence numbers distinguish a
// clock step from lost messages. The nominal interval of the messages gives the size of the step.
//
//   what is seen                                    what is concluded
//   recv goes back                                  the computer's clock was set back
//   recv leaps, uptime in HEALTH grew by less       the computer's clock was set forward
//   recv leaps, uptime grew as much or is unknown   the sensor was silent
//   utime leaps, recv does not                      the sensor's clock was set
//   utime and recv leap by the same                 the sensor's clock is set by the computer's
//
// A step is corrected from its first message on and confirmed by the third. If a message with
// stamps as before the step comes earlier, the messages between were damaged and are counted; their
// samples have been used. Not corrected, since navigation treats them as gaps in the data: steps of
// up to jump_s (navigation.clock_jump_s), and steps of the computer's clock by up to 3 s forward.
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
  // Adds a HEALTH message of any process. uptime_s, the seconds since that process's start, is
  // monotonic and goes on while sensors are silent. Two processes of the same name whose uptimes
  // alternate between two values are ignored. If they began less than a second apart, so that the
  // uptimes increase in the order of the messages, they count as one, wrong by at most that second.
  void Hear(const std::string& process, double uptime_s);

  // Seconds that passed, by the uptimes in HEALTH, since the first HEALTH message that this object
  // heard.
  double health_time_s() const { return health_time_s_; }

  // Now, in dive time: arrival (recv) of the newest message, plus the time by HEALTH since then.
  std::optional<Time> newest() const;
  // Arrival (recv) of a channel's newest message, in dive time.
  Time came_at(SensorChannel channel) const { return Of(channel).era.ReceivedAt(); }
  // Correction added to the utime of a channel's last message.
  Duration offset(SensorChannel channel) const { return Of(channel).era.utime_offset; }

  // Faults: a clock step within the last minute; a sensor whose latency has changed by 0.2 s
  // against the others; a sensor that is silent for 2 s and 2.5 of its intervals; a process whose
  // HEALTH has not come for 2.5 s.
  std::vector<Condition> conditions() const;
  const Counters& counters() const { return counters_; }

  // For a restart. Not saved: processes_, health_time_s_ and counters_, which begin anew with the
  // process; jump_s_, which is configured.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.channels_, self.computer_, self.computer_stepped_at_, self.last_step_);
    archive(self.last_step_at_, self.pace_);
  }

 private:
  static constexpr std::size_t kIntervals = 5;
  static constexpr std::size_t kLatencies = 63;

  // Last message of a channel, with the offsets that take its stamps to dive time.
  struct Era {
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
    std::optional<double> Add(const Era& message, Duration measured);
    double drift_s() const { return first_s && last_s ? *last_s - *first_s : 0.0; }

    Era begin;                      // first message in open_s
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
    Era era;
    std::optional<Era> before;  // before a step that is not confirmed yet
    std::array<double, kIntervals> intervals_s{};
    std::int32_t intervals = 0;
    Latency latency;
    double health_time_s = 0.0;  // at its last message
    std::optional<Time> heard;   // arrival of its last message that came after a new HEALTH

    double interval_s() const;
    void AddInterval(double interval_s);

    // Not saved: health_time_s and heard, which begin anew with the process.
    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.has_come, self.era, self.before, self.intervals_s, self.intervals, self.latency);
    }
  };
  struct Process {
    double uptime_s = 0.0;
    double to_health_time_s = 0.0;           // health_time_s = uptime_s + this
    double heard_s = 0.0;                    // health_time_s at its last HEALTH
    std::optional<double> before_restart_s;  // uptime_s of the process before this one
  };

  // False for a replay or simulation faster or slower than real time: utime and recv then cannot be
  // compared.
  bool IsRealTime() const { return pace_ > 0.9 && pace_ < 1.1; }
  const Channel& Of(SensorChannel channel) const {
    return channels_[static_cast<std::size_t>(channel)];
  }
  void Begin(Channel* c, const Era& message) const;
  bool IsNormal(double passed_s, double typical_s) const;
  bool Follows(const Channel& c, const Era& era, const Era& message) const;
  Era Next(SensorChannel channel, const Channel& c, Era message) const;
  Duration ComputerStep(const Channel& c, const Era& message, double typical_s) const;
  void Confirm(SensorChannel channel, Channel* c);
  // Keeps a step for conditions(). whose: name of the clock.
  void Note(const std::string& whose, Duration step);
  void AddSilent(std::vector<Condition>* now) const;
  void AddSilentProcesses(std::vector<Condition>* now) const;
  void AddDrifts(std::vector<Condition>* now) const;

  double jump_s_;
  std::array<Channel, kSensorChannels> channels_;
  Duration computer_{};  // added to recv gives dive time
  std::optional<Time> computer_stepped_at_;
  std::string last_step_;
  std::optional<Time> last_step_at_;
  double pace_ = 1.0;  // seconds of utime per second of recv, over the last kLatencies messages
  std::map<std::string, Process> processes_;
  double health_time_s_ = 0.0;
  Counters counters_;
};

}  // namespace seastitch
