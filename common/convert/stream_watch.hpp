#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "common/core/sample.hpp"
#include "common/core/time.hpp"

// Sequence numbers of the messages of one channel. Pure; time is that of the receive stamps.
namespace seastitch {

// Largest number that is not damaged: beyond it a double could not count.
constexpr std::int64_t kLastSequenceNumber = std::int64_t{1} << 53;
// Most messages that are lost at once; a larger step is another sender, or damage.
constexpr std::int64_t kLongestLoss = 1000;

// Counts lost messages. Add() returns how many were lost before this one. A number that goes back
// (its sender was restarted and begins at 0) or leaps by more than kLongestLoss is damaged, unless
// the next one goes on from it.
class SequenceWatch {
 public:
  std::int64_t Add(std::int64_t seq) {
    if (seq < 0 || seq > kLastSequenceNumber) return 0;  // damaged
    std::int64_t lost = 0;
    if (next_ >= 0 && !Follows(next_, seq)) {
      if (!leap_ || !Follows(leap_->next, seq)) {
        leap_ = Leap{seq, seq + 1};
        return 0;
      }
      lost = std::max<std::int64_t>(0, leap_->first - next_) + seq - leap_->next;
    } else if (next_ >= 0) {
      lost = seq - next_;
    }
    leap_.reset();
    next_ = seq + 1;
    return lost;
  }

 private:
  // A number outside the order, until the one after it confirms it.
  struct Leap {
    std::int64_t first;
    std::int64_t next;
  };

  static bool Follows(std::int64_t next, std::int64_t seq) {
    return seq >= next && seq - next <= kLongestLoss;
  }

  std::int64_t next_ = -1;
  std::optional<Leap> leap_;
};

// Keeps to one sender of a channel. Messages carry no sender; two are told apart by their sequence
// numbers. The stream that came first is used until it has been silent for a second, or for eight
// messages of the other one: a sender that is restarted begins again at 0.
class StreamWatch {
 public:
  // False: the message is of another sender, or its number is damaged. Do not use it.
  bool Add(const MessageStamp& stamp) {
    if (stamp.seq < 0 || stamp.seq > kLastSequenceNumber) return false;
    const bool follows =
        next_ && stamp.seq >= *next_ - kReordered && stamp.seq <= *next_ + kLongestLoss;
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
  static constexpr double kSilentS = 1.0;
  static constexpr int kMostOthers = 7;

  std::optional<std::int64_t> next_;
  double last_s_ = 0.0;      // receive time of the last message that was used
  int others_in_a_row_ = 0;  // messages since then
};

}  // namespace seastitch
