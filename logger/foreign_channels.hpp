#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/core/bytes.hpp"

namespace seastitch {

// Watches channels whose messages are not of Seastitch's types. These carry no sequence number that
// would show a loss; their rate and their longest silence are reported instead.
class ForeignChannels {
 public:
  struct Figures {
    std::int64_t events = 0;
    std::int64_t last_utime = 0;
    std::int64_t longest_gap_us = 0;  // between two messages
  };

  // Adds a message. True if its channel is watched: the first 50 such channels are.
  bool Add(const std::string& channel, Bytes message, std::int64_t recv_utime);
  // By channel.
  const std::map<std::string, Figures>& figures() const { return figures_; }

 private:
  std::map<std::string, Figures> figures_;
};

}  // namespace seastitch
