#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "common/core/message_stamp.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Keeps to one sender of a channel. Messages carry no sender; two are told apart by their sequence
// numbers. The stream that came first is used until it has been silent for a second, or for eight
// messages of the other one: a sender that is restarted begins again at 0. Pure; its time is that
// of the receive stamps.
class StreamWatch {
 public:
  // False: the message is of another sender, or its number is damaged. Do not use it.
  bool Add(const MessageStamp& stamp) {
    if (stamp.seq < 0 || stamp.seq > kLast) return false;
    const bool follows =
        next_ && stamp.seq >= *next_ - kReordered && stamp.seq <= *next_ + kMostLost;
    const double recv_s =
        1e-6 * static_cast<double>(ToUtime(stamp.recv));  // any value: no overflow
    const bool is_silent = std::abs(recv_s - last_s_) > kSilentS || others_in_a_row_ >= kMostOthers;
    if (next_ && !follows && !is_silent) {
      ++others_in_a_row_;
      return false;
    }
    others_in_a_row_ = 0;
    if (!follows || stamp.seq >= *next_) next_ = stamp.seq + 1;
    last_s_ = recv_s;
    return true;
  }

 private:
  static constexpr std::int64_t kReordered = 16;
  static constexpr std::int64_t kMostLost = 1000;
  static constexpr double kSilentS = 1.0;
  static constexpr int kMostOthers = 7;
  static constexpr std::int64_t kLast = std::int64_t{1} << 53;

  std::optional<std::int64_t> next_;
  double last_s_ = 0.0;      // receive time of the last message that was used
  int others_in_a_row_ = 0;  // messages since then
};

}  // namespace seastitch
