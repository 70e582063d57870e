#pragma once

#include <cstdint>
#include <string>

#include "common/core/health/counters.hpp"

// Data of the sonar that no submap gets: pings and soundings.
namespace seastitch {

// Reasons for which no submap gets a ping. Up to kNotFinite they are faults; the others are usual
// at both ends of a dive.
enum class PingLoss : std::uint8_t {
  kFromTheFuture,
  kOutOfOrder,
  kWithoutPose,
  kDroppedWaiting,
  kNotFinite,
  kBeforeNavigation,
  kWithoutSoundings,
  kCount
};

constexpr PingLoss Next(PingLoss loss) {
  return static_cast<PingLoss>(static_cast<std::uint8_t>(loss) + 1);
}
constexpr bool IsFault(PingLoss loss) { return loss <= PingLoss::kNotFinite; }
// Name of its counter.
const char* NameOf(PingLoss loss);
// For people, after "because".
const char* ReasonOf(PingLoss loss);

using PingTally = Tally<PingLoss>;

// Fraction of the soundings that the sonar marks as valid but that are not in the map. With a good
// filter 4 to 6 % are usual; more needs an explanation.
struct Rejection {
  static constexpr double kUnusual = 0.06;
  double part = 0.0;
  std::string main_reason;  // name of the counter with most of them; empty if there are none

  // Such as "2.1 % of soundings rejected"; with the main reason if the fraction is unusual.
  std::string Text() const;
};

// rejected: soundings by reason.
Rejection RejectionOf(std::int64_t valid_soundings, const Counters& rejected);

}  // namespace seastitch
