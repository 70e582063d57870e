#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/core/bytes.hpp"

namespace seastitch {

// Watches channels whose messages are none of Seastitch's types: they carry no number that would
// show a loss, so what can be told is how often they come and how long they were silent.
class ForeignChannels {
 public:
  struct Figures {
    std::int64_t events = 0;
    std::int64_t last_utime = 0;
    std::int64_t longest_gap_us = 0;  // between two messages
  };

  // Whether its channel is such a one and watched; the first 50 are.
  bool Add(const std::string& channel, Bytes message, std::int64_t recv_utime);
  // By channel.
  const std::map<std::string, Figures>& figures() const { return figures_; }

 private:
  std::map<std::string, Figures> figures_;
};

}  // namespace seastitch
