#include "tests/codecs/maker_soundings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <utility>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "tests/codecs/motion.hpp"

namespace seastitch {
namespace {

struct Setting {
  const SonarInstallation& installation;
  const Motion& motion;
  const RayTracer& rays;
  const ComparisonOptions& options;
};

// The beams that one transmit array sent at one time.
struct Pulse {
  std::uint8_t tx_array;
  float delay_s;
  auto operator<=>(const Pulse&) const = default;
};

VehicleGeometry VehicleOf(const Setting& s,
                          const MbesPing& raw,
                          const PlacedPing& placed,
                          std::size_t tx_array) {
  const Eigen::Translation3d to_origin(-placed.p_vehicle_origin_m);
  VehicleGeometry vehicle;
  vehicle.T_mbes_tx = to_origin * s.installation.TransmitterOf(raw.head)->At(tx_array);
  vehicle.T_mbes_rx = to_origin * s.installation.ReceiverOf(raw.head)->At(0);
  return vehicle;
}

// The map's origin lies at the water line under the soundings' origin, its x axis along the
// heading of the ping.
void ComparePulse(const Setting& s,
                  const MbesPing& ping,
                  const PlacedPing& placed,
                  const Pulse& pulse,
                  Comparison* out) {
  const VehicleGeometry vehicle = VehicleOf(s, ping, placed, pulse.tx_array);
  const double heading_rad = s.motion.RpyAt(ping.time).z();
  const Time sent = ping.time + FromSeconds(pulse.delay_s);
  const double heave_at = s.motion.HeaveAt(s.options.depth_from_transmitter ? sent : ping.time);
  double depth_m = *placed.origin_depth_m;
  if (s.options.depth_from_transmitter)
    depth_m -= (s.motion.RotationAt(sent, heading_rad) *
                VehicleOf(s, ping, placed, 0).T_mbes_tx.translation())
                   .z();
  const auto pose_at = [&](Time t) -> std::optional<Eigen::Isometry3d> {
    return MakePose({0.0, 0.0, depth_m + s.motion.HeaveAt(t) - heave_at},
                    s.motion.RotationAt(t, heading_rad));
  };

  MbesPing part = ping;
  for (std::size_t i = 0; i < part.beams.size(); ++i) {
    const MbesBeam& b = part.beams[i];
    const Time beam_sent = ping.time + FromSeconds(b.tx_delay_s);
    if (Pulse{b.tx_array, b.tx_delay_s} != pulse || placed.soundings[i].flags != b.flags ||
        !s.motion.Covers(beam_sent, beam_sent + FromSeconds(b.twtt_s)))
      part.beams[i].flags = 0;
  }
  if (s.options.profile_only) part.sound_speed_mps = s.rays.SpeedAt(*placed.origin_depth_m);
  const auto result = Georeference(part, pose_at, vehicle, s.rays);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->beams_refused, 0);
  for (const Sounding& sounding : result->soundings) {
    Eigen::Vector3d theirs =
        placed.soundings[static_cast<std::size_t>(sounding.beam)].p_level_m.cast<double>();
    const double below_transducer_m = theirs.z();
    theirs.z() += *placed.origin_depth_m;
    const double depth = s.options.depth_from_transmitter ? theirs.z() : below_transducer_m;
    out->residuals.push_back(
        {std::atan2(theirs.y(), below_transducer_m), 100.0 / depth * (sounding.p_map - theirs)});
  }
}

const PlacedPing* PlacedOf(const MbesPing& ping, const std::vector<PlacedPing>& all) {
  const auto found = std::find_if(all.begin(), all.end(), [&ping](const PlacedPing& p) {
    return p.ping_number == ping.ping_number && p.head == ping.head;
  });
  return found == all.end() ? nullptr : &*found;
}

// Nine beams in ten lie within the motion.
bool IsCovered(const MbesPing& ping, const Motion& motion) {
  const auto covered = std::count_if(ping.beams.begin(), ping.beams.end(), [&](const MbesBeam& b) {
    const Time sent = ping.time + FromSeconds(b.tx_delay_s);
    return motion.Covers(sent, sent + FromSeconds(b.twtt_s));
  });
  return 10 * covered >= 9 * static_cast<std::ptrdiff_t>(ping.beams.size());
}

}  // namespace

Eigen::Vector3d Comparison::Rms(double from_deg, double to_deg) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int n = 0;
  for (const Residual& r : residuals)
    if (Rad2Deg(r.angle_rad) >= from_deg && Rad2Deg(r.angle_rad) < to_deg)
      sum += r.percent_of_depth.cwiseAbs2(), ++n;
  return (sum / std::max(n, 1)).cwiseSqrt();
}

void Comparison::PrintByAngle(const std::string& title) const {
  const Eigen::Vector3d all = Rms();
  std::printf("%s: %d pings, %zu beams, RMS %% of depth x %.4f y %.4f z %.4f\n",
              title.c_str(),
              pings,
              residuals.size(),
              all.x(),
              all.y(),
              all.z());
  for (int from = -75; from < 75; from += 15) {
    const Eigen::Vector3d rms = Rms(from, from + 15);
    if (!rms.isZero())
      std::printf("  %3d to %3d deg: %.4f %.4f %.4f\n", from, from + 15, rms.x(), rms.y(), rms.z());
  }
}

Comparison CompareWithMaker(const SurveyContents& file, const ComparisonOptions& options) {
  Comparison out;
  const auto installations = file.All<SonarInstallation>();
  const auto profiles = file.All<SoundVelocityProfile>();
  const Motion motion(file.All<NavigationRecord>(), options.motion_source);
  if (installations.empty() || profiles.empty()) {
    ADD_FAILURE() << "no installation or no profile";
    return out;
  }
  const auto rays = RayTracer::Make(profiles[0]);
  if (!rays) {
    ADD_FAILURE() << "no profile to trace in";
    return out;
  }
  const Setting setting{installations[0], motion, *rays, options};
  const auto placed = file.All<PlacedPing>();
  for (const MbesPing& ping : file.All<MbesPing>()) {
    const PlacedPing* const theirs = PlacedOf(ping, placed);
    if (theirs == nullptr || !IsCovered(ping, motion)) continue;
    ++out.pings;
    std::set<Pulse> pulses;
    for (const MbesBeam& beam : ping.beams)
      if ((beam.flags & kBeamValid) != 0) pulses.insert({beam.tx_array, beam.tx_delay_s});
    for (const Pulse& pulse : pulses) ComparePulse(setting, ping, *theirs, pulse, &out);
  }
  return out;
}

}  // namespace seastitch
