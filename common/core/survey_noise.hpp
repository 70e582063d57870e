#pragma once

#include <cstdint>
#include <optional>

namespace seastitch {

// A variance component of a survey as its overlaps show it, with 1 sigma of its natural logarithm.
struct ComponentEstimate {
  double configured = 0.0;
  double value = 0.0;
  double log_sigma = 0.0;
};

// docs/noise-from-overlaps.md.
struct NoiseEstimate {
  // Variance of a sounding over the scatter of soundings about the smooth seabed.
  ComponentEstimate sounding_variance_ratio;
  ComponentEstimate correlated_error_ratio;  // 1 sigma of the height over the altitude
  ComponentEstimate position_walk;           // m/sqrt(m)
  ComponentEstimate heading_walk;            // rad/sqrt(m)
  int closures = 0;                          // that it rests on
};

// What the seabed says of the sonar's stamps against those of the attitude.
struct TimeOffsetEstimate {
  double add_s = 0.0;    // to the stamp of every ping
  double sigma_s = 0.0;  // 1 sigma
  std::int64_t pings = 0;
  // By how much what is compared changes from ping to ping, RMS, as it is and with `add_s`: the
  // slope across [rad], the depth [m].
  double change_before = 0.0;
  double change_after = 0.0;
};

struct SonarTimingEstimate {
  double told_s = 0.0;                      // that the configuration added to the stamps already
  bool placed_by_source = false;            // the soundings came placed: their stamps are not ours
  std::optional<TimeOffsetEstimate> roll;   // roll rate against the slope across
  std::optional<TimeOffsetEstimate> pitch;  // pitch rate against the depth, where the seabed slopes
};

struct SurveyNoise {
  NoiseEstimate components;
  SonarTimingEstimate timing;
};

}  // namespace seastitch
