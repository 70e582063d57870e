#include "drivers/mbes/mbes_codec.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

std::string MbesCodecParams::Validate() const {
  if (const std::string problem = parts.Validate(); !problem.empty()) return "parts." + problem;
  for (const double roll : head_roll_rad)
    if (!(std::abs(roll) <= kPi / 2.0)) return "head_roll_deg must be -90 to 90";
  return "";
}

void TurnFromHead(std::size_t head, const std::vector<double>& head_roll_rad, MbesPing* ping) {
  if (head >= head_roll_rad.size() || head_roll_rad[head] == 0.0) return;
  const auto roll_rad = static_cast<float>(head_roll_rad[head]);
  for (MbesBeam& beam : ping->beams)
    if (beam.twtt_s > 0.0f) beam.rx_angle_rad -= roll_rad;
}

bool IsUsable(const MbesBeam& b) {
  return IsPlausible(b) && (b.twtt_s > 0.0f || (b.flags & kBeamValid) == 0);
}

}  // namespace seastitch
