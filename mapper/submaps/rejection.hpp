#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

// Fraction of the soundings that the sonar marks as valid but that are not in the map. With a good
// filter 4 to 6 % are usual; more needs an explanation.
struct Rejection {
  static constexpr double kUnusual = 0.06;
  double part = 0.0;
  std::string main_reason;  // name of the counter with most of them; empty if there are none

  // Such as "2.1 % of soundings rejected"; with the main reason if the fraction is unusual.
  std::string Text() const;
};

// counters: those of SubmapBuilder, and "beams_refused". Counters of other things than soundings
// are ignored.
Rejection RejectionOf(std::int64_t valid_soundings,
                      const std::map<std::string, std::int64_t>& counters);

}  // namespace seastitch
