#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/convert/stream_watch.hpp"
#include "common/core/bytes.hpp"

namespace seastitch {

// Counts lost messages by the sequence numbers of Seastitch's own types. A type is identified by
// its fingerprint, not by the channel's name. Messages of other types have no number and are not
// counted.
class GapCounter {
 public:
  // Adds a message. Returns how many were lost before it.
  std::int64_t Add(const std::string& channel, Bytes message);
  // Lost messages by channel; only channels with a loss.
  const std::map<std::string, std::int64_t>& lost() const { return lost_; }
  std::int64_t total() const { return total_; }

 private:
  std::map<std::string, SequenceWatch> watches_;  // by channel and, where it has several, sender
  std::map<std::string, std::int64_t> lost_;
  std::int64_t total_ = 0;
};

}  // namespace seastitch
