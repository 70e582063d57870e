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

// The dive's time: the stamps of the sensors as if no clock had stepped since the dive began. A
// stamp comes from two clocks, the sensor's (utime) and the computer's (recv), which many sensors
// have in common. Numbers that count up tell a step from a loss, the interval of the messages how
// far it went:
//
//   recv goes back                           the computer's clock stepped
//   recv leaps forward, and HEALTH counted   the same; where HEALTH did not count at all, or as far
//     on by less meanwhile                   as recv, the sensor was silent
//   utime leaps against recv                 the sensor's clock stepped, or went with the
//   computer's
//
// A step counts from its first message on and is sure with the third; if a message that follows the
// old stamps comes before, the others were damaged. Steps of up to jump_s, and of the computer's
// clock forward up to 3 s, are left to navigation: they are gaps. Pure.
class SensorClocks {
 public:
  explicit SensorClocks(double jump_s) : jump_s_(jump_s) {}

  Time InDiveTime(SensorChannel channel, Time utime, const MessageStamp& stamp);
  // HEALTH of any process. Its seconds since the start are monotonic, and pass while sensors are
  // silent. Two processes of one name count no time: their seconds go back and forth.
  void Hear(const std::string& process, double uptime_s);

  // Seconds that passed by HEALTH, of this process's life.
  double witnessed_s() const { return witnessed_s_; }

  // Of what came last: by its arrival, in the dive's time.
  std::optional<Time> newest() const;
  // When a channel's newest message came, in the dive's time.
  Time came_at(SensorChannel channel) const { return Of(channel).era.ReceivedAt(); }
  // What was added to the newest utime of a channel.
  Duration offset(SensorChannel channel) const { return Of(channel).era.utime_offset; }

  // Steps of the last minute, clocks that drift from the others, sensors that are silent.
  std::vector<Condition> conditions() const;
  const Counters& counters() const { return counters_; }

  // For a restart. Not saved: processes_, witnessed_s_ and counters_, which are of one process;
  // jump_s_, which is configured.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.channels_, self.computer_, self.computer_stepped_at_, self.last_step_);
    archive(self.last_step_at_, self.pace_);
  }

 private:
  static constexpr std::size_t kIntervals = 5;
  static constexpr std::size_t kLatencies = 63;

  // The newest message of a channel, and what takes its stamps to the dive's time.
  struct Era {
    Time utime;
    Time recv;
    std::int64_t seq = 0;
    Duration utime_offset{};
    Duration recv_offset{};
    Duration computer{};        // what recv_offset was for every sensor
    std::int32_t messages = 0;  // since a clock stepped

    Time At() const { return utime + utime_offset; }
    Time ReceivedAt() const { return recv + recv_offset; }

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.utime, self.recv, self.seq, self.utime_offset, self.recv_offset);
      archive(self.computer, self.messages);
    }
  };

  // How long after utime a channel's messages come: medians of kLatencies each.
  struct Latency {
    // Gives what utime passed by while recv passed by a second, once for kLatencies messages.
    std::optional<double> Add(const Era& message);
    double drift_s() const { return first_s && last_s ? *last_s - *first_s : 0.0; }

    Era begin;  // of open_s
    std::vector<double> open_s;
    std::optional<double> first_s;
    std::optional<double> last_s;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.begin, self.open_s, self.first_s, self.last_s);
    }
  };

  struct Channel {
    bool has_come = false;
    Era era;
    std::optional<Era> before;  // while it is not sure that a clock stepped
    std::array<double, kIntervals> intervals_s{};
    std::int32_t intervals = 0;
    Latency latency;
    double witnessed_s = 0.0;   // at its newest message
    std::optional<Time> heard;  // recv of the newest message before which HEALTH had come

    double interval_s() const;
    void AddInterval(double interval_s);

    // Not saved: witnessed_s and heard, which are of one process.
    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.has_come, self.era, self.before, self.intervals_s, self.intervals, self.latency);
    }
  };
  struct Process {
    double uptime_s = 0.0;
    double to_witnessed_s = 0.0;
    std::optional<double> before_restart_s;  // uptime_s of the process before this one
  };

  // Where a simulation goes faster than time, utime and recv say nothing of each other.
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
  void Note(const std::string& whose, Duration step);
  void AddSilent(std::vector<Condition>* now) const;
  void AddDrifts(std::vector<Condition>* now) const;

  double jump_s_;
  std::array<Channel, kSensorChannels> channels_;
  Duration computer_{};  // what takes the computer's clock to the dive's time
  std::optional<Time> computer_stepped_at_;
  std::string last_step_;
  std::optional<Time> last_step_at_;
  double pace_ = 1.0;  // of utime against recv, lately
  std::map<std::string, Process> processes_;
  double witnessed_s_ = 0.0;
  Counters counters_;
};

}  // namespace seastitch
