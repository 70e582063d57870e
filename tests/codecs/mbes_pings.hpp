#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "common/core/sensors.hpp"
#include "tests/support/property.hpp"

namespace seastitch {

inline std::int64_t Count(const Counters& counters, const std::string& name) {
  const auto found = counters.find(name);
  return found == counters.end() ? 0 : found->second;
}

inline bool AllFinite(const MbesPing& ping) {
  for (const MbesBeam& b : ping.beams)
    for (const float value : {b.twtt_s,
                              b.rx_angle_rad,
                              b.tx_tilt_rad,
                              b.tx_delay_s,
                              b.depth_sigma_ratio,
                              b.backscatter_db})
      if (!std::isfinite(value)) return false;
  return std::isfinite(ping.sound_speed_mps);
}

// Any ping of one tilt whose angles rise from port to starboard.
inline rc::Gen<MbesPing> AnyFlatPing(std::size_t max_beams) {
  return rc::gen::exec([max_beams] {
    MbesPing ping;
    ping.time = FromUtime(*rc::gen::inRange<std::int64_t>(1'000'000, 4'000'000'000'000'000));
    ping.ping_number = *rc::gen::arbitrary<std::uint32_t>();
    ping.sound_speed_mps = static_cast<float>(*rc::gen::inRange(14'000, 16'000)) * 0.1f;
    const float tilt = static_cast<float>(*rc::gen::inRange(-100, 101)) * 1e-3f;
    const auto n = *rc::gen::inRange<std::size_t>(1, max_beams + 1);
    float angle = -1.2f;
    for (std::size_t i = 0; i < n; ++i) {
      angle += static_cast<float>(*rc::gen::inRange(0, 1000)) * 2.4e-3f / static_cast<float>(n);
      MbesBeam beam;
      beam.twtt_s = static_cast<float>(*rc::gen::inRange(1'000, 1'000'000)) * 1e-6f;
      beam.rx_angle_rad = angle;
      beam.tx_tilt_rad = tilt;
      beam.backscatter_db = static_cast<float>(*rc::gen::inRange(300, 600)) * 0.1f;
      beam.flags = *rc::gen::element<std::uint8_t>(
          0, kBeamAmplitude, kBeamPhase, kBeamValid | kBeamAmplitude, kBeamValid | kBeamPhase);
      ping.beams.push_back(beam);
    }
    return ping;
  });
}

}  // namespace seastitch
