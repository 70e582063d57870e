#include "common/core/sensors.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

bool HasQuality(const DvlSample& sample) {
  return std::all_of(sample.beams.begin(), sample.beams.end(), [](const DvlBeam& beam) {
    return beam.quality.has_value();
  });
}

bool IsPlausible(const MbesBeam& b) {
  const auto is_time = [](float s) { return s >= 0.0f && s <= kMaxTravelTime_s; };
  const auto is_angle = [](float rad) { return std::abs(rad) < kPi; };
  return is_time(b.twtt_s) && is_time(b.tx_delay_s) && is_angle(b.rx_angle_rad) &&
         is_angle(b.tx_tilt_rad) && b.depth_sigma_ratio >= 0.0f &&
         std::isfinite(b.depth_sigma_ratio) && std::isfinite(b.backscatter_db);
}

Time LastEcho(const MbesPing& ping) {
  double last_s = 0.0;
  for (const MbesBeam& b : ping.beams)
    if ((b.flags & kBeamValid) != 0 && IsPlausible(b))
      last_s = std::max(last_s, static_cast<double>(b.tx_delay_s) + b.twtt_s);
  return ping.time + FromSeconds(last_s);
}

}  // namespace seastitch
