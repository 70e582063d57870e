#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

// How many of the soundings that the sonar called valid are not in the map. Surveyors lose 4 to 6 %
// to a good filter; more asks for a reason.
struct Rejection {
  static constexpr double kUnusual = 0.06;
  double part = 0.0;
  std::string main_reason;  // the counter that holds most of them; empty where there are none

  // "2.1 % of soundings rejected", and what for where that is unusual.
  std::string Text() const;
};

// counters: those of SubmapBuilder, and "beams_refused"; what is not about single soundings is not
// counted.
Rejection RejectionOf(std::int64_t valid_soundings,
                      const std::map<std::string, std::int64_t>& counters);

}  // namespace seastitch
