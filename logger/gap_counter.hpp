#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/core/bytes.hpp"
#include "common/runtime/bus.hpp"

namespace seastitch {

// Counts what never came, by the sequence numbers that Seastitch's own types carry. Knows a type by
// its fingerprint, not by the channel's name; messages of other types have no number and no gap.
class GapCounter {
 public:
  // Gives how many messages were lost before this one.
  std::int64_t Add(const std::string& channel, Bytes message);
  // By channel; channels without a loss are not in it.
  const std::map<std::string, std::int64_t>& lost() const { return lost_; }
  std::int64_t total() const { return total_; }

 private:
  std::map<std::string, SequenceWatch> watches_;  // by channel and, where it has several, sender
  std::map<std::string, std::int64_t> lost_;
  std::int64_t total_ = 0;
};

}  // namespace seastitch
