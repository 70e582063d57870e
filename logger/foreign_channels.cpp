#include "logger/foreign_channels.hpp"

#include <algorithm>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxChannels = 50;  // so that HEALTH fits into one datagram

}  // namespace

bool ForeignChannels::Add(const std::string& channel, Bytes message, std::int64_t recv_utime) {
  const auto fingerprint = FingerprintOf(message);
  if (fingerprint && ChannelOfType(*fingerprint) != nullptr) return false;
  if (!figures_.contains(channel) && figures_.size() >= kMaxChannels) return false;
  Figures& figures = figures_[channel];
  if (++figures.events > 1)
    figures.longest_gap_us = std::max(figures.longest_gap_us, recv_utime - figures.last_utime);
  figures.last_utime = recv_utime;
  return true;
}

}  // namespace seastitch
