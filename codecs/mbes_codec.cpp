#include "codecs/mbes_codec.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

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
