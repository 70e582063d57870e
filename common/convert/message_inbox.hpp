#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/convert/stream_watch.hpp"
#include "common/core/bytes.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/health/fault_events.hpp"
#include "common/core/sample.hpp"

namespace seastitch {

// The messages that a mapper reads, from the bus or from a log: measurements of sensors, and
// HEALTH. Messages that are lost, malformed or of a second sender are counted and named.
class MessageInbox {
 public:
  // The sample of a message. Absent: it is malformed, or of another sender than those before.
  // now_s: any one clock of the caller, for Faults(): that of HEALTH, or that of a log.
  std::optional<Received> Take(const imu_t& msg, double now_s);
  std::optional<Received> Take(const dvl_t& msg, double now_s);
  std::optional<Received> Take(const depth_t& msg, double now_s);
  std::optional<Received> Take(const navigation_t& msg, double now_s);
  std::optional<Received> Take(const position_fix_t& msg, double now_s);
  std::optional<Received> Take(const mbes_ping_t& msg, double now_s);
  std::optional<Received> Take(const mbes_soundings_t& msg, double now_s);
  std::optional<Received> Take(const sound_velocity_profile_t& msg, double now_s);
  std::optional<Received> Take(const health_t& msg, double now_s);
  // The same for an encoded message. Absent also for a channel that a mapper does not read.
  std::optional<Received> Take(std::string_view channel, Bytes message, double now_s);

  // Counts a malformed message of another kind, for Faults().
  void CountMalformed(const std::string& name, double now_s);

  // Messages that did not arrive, by their numbers.
  std::int64_t lost() const;
  // Such as imu_lost, imu_malformed, imu_of_another_sender; without those that are zero.
  Counters counters() const;
  // Faults of the messages of the last seconds before now_s.
  std::vector<Condition> Faults(double now_s) const;

 private:
  struct Stream {
    SequenceWatch sequence;
    StreamWatch sender;
    std::int64_t lost = 0;
    FaultEvents<double> malformed{conditions::kMessagesMalformed};
    FaultEvents<double> others{conditions::kTwoSenders};  // messages of another sender
  };

  template <class Msg>
  std::optional<Received> TakeOne(const Msg& msg, bool has_one_sender, double now_s);
  template <class Msg>
  std::optional<Received> Decode(Bytes message, double now_s);

  std::map<std::string, Stream> streams_;  // by name, such as mbes_ping
};

}  // namespace seastitch
