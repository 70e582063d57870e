#include "mapper/geometry/georeference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

// Rounding tolerance of the sonar's float angles. Beyond it the two cones do not intersect.
constexpr double kConeSlack = 1e-9;
// Limit of the ratio of a ray's depth to that of a straight ray: sound speed that rises along the
// path bends rays down by at most 5 %.
constexpr double kDeeper = 1.05;

// Quantities that the beams of one transmit sector share.
struct Sector {
  float delay_s = -1.0f;
  float tilt_rad = 0.0f;
  std::uint8_t part = 0;
  ArrayState tx;
  double sin_tilt = 0.0;

  bool Has(const MbesBeam& beam) const {
    return beam.tx_delay_s == delay_s && beam.tx_tilt_rad == tilt_rad && beam.tx_array == part;
  }
  // Not inlined: it is seldom called, and would slow down the loop over the beams.
  [[gnu::noinline]] void Take(const MbesBeam& beam, const SonarMotion& sonar) {
    delay_s = beam.tx_delay_s;
    tilt_rad = beam.tx_tilt_rad;
    part = beam.tx_array;
    tx = sonar.TxPartAt(delay_s, part);
    sin_tilt = std::sin(double{tilt_rad});
  }
};

// A beam as one ray, from midway between transmitter and receiver to the echo.
struct Launch {
  int beam;
  Eigen::Vector3d start;
  Eigen::Vector3d echo;  // relative to start, for a constant sound speed
  double range_m;
};

// Number of usable beams of a part that the transmit array does not have.
int BeamsOfUnknownPart(const MbesPing& ping, std::size_t parts) {
  if (parts == 0) return 0;
  return static_cast<int>(
      std::count_if(ping.beams.begin(), ping.beams.end(), [parts](const MbesBeam& beam) {
        return (beam.flags & kBeamValid) != 0 && IsUsable(beam) && beam.tx_array >= parts;
      }));
}

// What turns angles and times into directions and ways.
struct Water {
  double speed_mps;
  SwathCorrection correction;
};

// The echo in water whose speed is larger by this part, without what that adds to all depths.
Eigen::Vector3d ByWater(const Eigen::Vector3d& echo, double part) {
  if (part == 0.0 || !(echo.z() > 0.0)) return echo;
  const double stretch = 1.0 + 2.0 * part;
  return {stretch * echo.x(),
          stretch * echo.y(),
          echo.z() - part * echo.head<2>().squaredNorm() / echo.z()};
}

// Launches in batches, because EchoesFromMidway() takes several detections at once.
class LaunchSolver {
 public:
  LaunchSolver(const SonarMotion& sonar, const Water& water, std::size_t beams)
      : sonar_(sonar), water_(water) {
    launches_.reserve(beams);
  }

  void Add(const MbesBeam& beam, int number) {
    if (!sector_.Has(beam)) sector_.Take(beam, sonar_);
    const double twtt_s{beam.twtt_s};
    const ArrayState rx = sonar_.RxAt(beam.tx_delay_s + twtt_s);
    const Eigen::Vector3d half_baseline = 0.5 * (rx.p_map - sector_.tx.p_map);
    const auto& [smile, by_water] = water_.correction;
    batch_.Set(waiting_,
               {sector_.tx.axis,
                rx.axis,
                sector_.sin_tilt,
                (1.0 + smile - by_water) * double{std::sin(beam.rx_angle_rad)},
                half_baseline,
                0.5 * twtt_s * water_.speed_mps});
    starts_[waiting_] = {number, sector_.tx.p_map + half_baseline};
    if (++waiting_ == Detections::kMost) Solve();
  }
  // All that were added but those whose two cones and travel time have no common point.
  std::vector<Launch> Finish() {
    if (waiting_ > 0) Solve();
    return std::move(launches_);
  }

 private:
  struct Start {
    int beam;
    Eigen::Vector3d p_map;
  };
  void Solve() {
    const auto echoes = EchoesFromMidway(batch_);
    for (std::size_t i = 0; i < waiting_; ++i) {
      if (!echoes[i]) continue;
      const Eigen::Vector3d bent = ByWater(*echoes[i], water_.correction.by_water);
      launches_.push_back({starts_[i].beam, starts_[i].p_map, bent, bent.norm()});
    }
    waiting_ = 0;
  }

  const SonarMotion& sonar_;
  const Water water_;
  Sector sector_;
  Detections batch_;
  std::array<Start, Detections::kMost> starts_;
  std::size_t waiting_ = 0;
  std::vector<Launch> launches_;
};

// The rays of all usable beams; the others are counted.
std::vector<Launch> LaunchesOf(const MbesPing& ping,
                               const SonarMotion& sonar,
                               const Water& water,
                               PingSoundings* result) {
  LaunchSolver launches(sonar, water, ping.beams.size());
  int valid = 0;
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    const MbesBeam& beam = ping.beams[i];
    if ((beam.flags & kBeamValid) == 0) {
      ++result->beams_invalid;
      continue;
    }
    ++valid;
    if (IsUsable(beam)) launches.Add(beam, static_cast<int>(i));
  }
  std::vector<Launch> all = launches.Finish();
  result->beams_refused += valid - static_cast<int>(all.size());
  return all;
}

// The points where the rays of `count` launches from `first` on meet the seabed. Nothing where a
// ray turns upward before.
std::array<std::optional<Eigen::Vector3d>, RayFan::kBeside> Follow(const Launch* first,
                                                                   std::size_t count,
                                                                   double speed_mps,
                                                                   RayFan* fan) {
  RayFan::Launches rays;
  RayFan::Numbers straight_m;
  for (std::size_t i = 0; i < RayFan::kBeside; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const auto& [beam, start, echo, range_m] = first[std::min(i, count - 1)];
    straight_m[k] = echo.head<2>().norm();
    rays.sin[k] = straight_m[k] / range_m;
    rays.cos[k] = echo.z() / range_m;
    rays.one_way_s[k] = range_m / speed_mps;
  }
  const RayFan::Ends ends = fan->Trace(rays);
  std::array<std::optional<Eigen::Vector3d>, RayFan::kBeside> points;
  for (std::size_t i = 0; i < count; ++i) {
    if (!ends[i]) continue;
    const double straight = straight_m[static_cast<Eigen::Index>(i)];
    const double stretch = straight > 0.0 ? ends[i]->horizontal_m / straight : 0.0;
    const Eigen::Vector3d& echo = first[i].echo;
    points[i] =
        first[i].start + Eigen::Vector3d(stretch * echo.x(), stretch * echo.y(), ends[i]->down_m);
  }
  return points;
}

}  // namespace

// With x from the middle to the echo, f the half baseline, a the half path and e = x . f / a, the
// distances from transmitter and receiver are a + e and a - e. So the cones are planes,
//   x . tx_axis = sin_tilt (a + e) - f . tx_axis,  x . rx_axis = sin_angle (a - e) + f . rx_axis,
// and the ellipsoid is |x|^2 = a^2 - f^2 + e^2. Solved iteratively: x for given e, then e again.
// Each round reduces the error by the factor |f| / a.
std::array<std::optional<Eigen::Vector3d>, Detections::kMost> EchoesFromMidway(
    const Detections& detections) {
  constexpr int kRounds = 3;
  const auto& [tx, rx, sin_tilt, sin_angle, f, a] = detections;
  using Numbers = Detections::Numbers;
  const auto dot = [](const auto& u, const auto& v) -> Numbers {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  };
  const Numbers skew = dot(tx, rx);
  const Numbers det = 1.0 - skew * skew;
  const Numbers a2_less_f2 = a * a - dot(f, f);
  Detections::Vectors down{
      tx[1] * rx[2] - tx[2] * rx[1], tx[2] * rx[0] - tx[0] * rx[2], tx[0] * rx[1] - tx[1] * rx[0]};
  const Numbers sign = (down[2] < 0.0).select(Numbers::Constant(-1.0), 1.0);
  for (Numbers& component : down) component *= sign;
  const Numbers f_tx = dot(f, tx), f_rx = dot(f, rx), f_down = dot(f, down);
  const Numbers inverse_a = 1.0 / a;
  const Numbers inverse_det = 1.0 / det;
  const Numbers slack = kConeSlack * a * a;

  Numbers by_tx, by_rx, by_down;
  Numbers e = Numbers::Zero();
  Numbers least = Numbers::Constant(1.0);  // of the rests, beyond the slack
  for (int round = 0; round < kRounds; ++round) {
    const Numbers x_tx = sin_tilt * (a + e) - f_tx;
    const Numbers x_rx = sin_angle * (a - e) + f_rx;
    by_tx = (x_tx - skew * x_rx) * inverse_det;
    by_rx = (x_rx - skew * x_tx) * inverse_det;
    const Numbers rest = a2_less_f2 + e * e - (by_tx * x_tx + by_rx * x_rx);
    least = least.min(rest + slack);
    by_down = (rest.max(0.0) * inverse_det).sqrt();
    e = (by_tx * f_tx + by_rx * f_rx + by_down * f_down) * inverse_a;
  }
  std::array<std::optional<Eigen::Vector3d>, Detections::kMost> echoes;
  for (std::size_t i = 0; i < Detections::kMost; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (!(det[k] > kConeSlack && a2_less_f2[k] > 0.0 && least[k] > 0.0)) continue;
    Eigen::Vector3d echo;
    for (std::size_t axis = 0; axis < 3; ++axis)
      echo[static_cast<Eigen::Index>(axis)] =
          by_tx[k] * tx[axis][k] + by_rx[k] * rx[axis][k] + by_down[k] * down[axis][k];
    if (echo.allFinite()) echoes[i] = echo;
  }
  return echoes;
}

std::optional<Eigen::Vector3d> EchoFromMidway(const Detection& detection) {
  Detections alone;
  for (std::size_t i = 0; i < Detections::kMost; ++i) alone.Set(i, detection);
  return EchoesFromMidway(alone).front();
}

GeoreferencedPing WithoutSoundings(const MbesPing& ping, const SonarMotion& sonar) {
  GeoreferencedPing result;
  result.time = ping.time;
  result.T_map_vehicle = sonar.T_map_vehicle_first();
  result.ping_number = ping.ping_number;
  result.head = ping.head;
  result.beams_read = static_cast<int>(ping.beams.size());
  return result;
}

std::optional<GeoreferencedPing> Georeference(const MbesPing& ping,
                                              const PoseLookup& T_map_vehicle_at,
                                              const VehicleGeometry& vehicle,
                                              const RayTracer& rays,
                                              const SwathCorrection& correction) {
  const std::optional<SonarMotion> sonar = SonarMotion::Of(ping, T_map_vehicle_at, vehicle);
  if (!sonar) return std::nullopt;
  GeoreferencedPing result = WithoutSoundings(ping, *sonar);
  static_cast<PingSoundings&>(result) = PlaceSoundings(ping, *sonar, rays, correction);
  return result;
}

PingSoundings PlaceSoundings(const MbesPing& ping,
                             const SonarMotion& sonar,
                             const RayTracer& rays,
                             const SwathCorrection& correction) {
  PingSoundings result;
  result.beams_of_unknown_part = BeamsOfUnknownPart(ping, sonar.parts());
  result.speed_from_profile = !IsSoundSpeed(ping.sound_speed_mps);
  const double start_depth_m = sonar.TxAt(0.0).p_map.z();
  const double speed_mps =
      result.speed_from_profile ? rays.SpeedAt(start_depth_m) : ping.sound_speed_mps;

  const std::vector<Launch> launches = LaunchesOf(ping, sonar, {speed_mps, correction}, &result);
  double deepest_m = start_depth_m;
  for (const Launch& launch : launches)
    deepest_m = std::max(deepest_m, start_depth_m + kDeeper * launch.echo.z());
  // One fan for the whole ping: the sonar's heave while it listens, some centimetres, is taken as
  // heave of the water.
  RayFan fan(rays, start_depth_m, speed_mps, deepest_m);
  result.soundings.reserve(launches.size());
  for (std::size_t k = 0; k < launches.size(); k += RayFan::kBeside) {
    const std::size_t count = std::min(RayFan::kBeside, launches.size() - k);
    const auto points = Follow(&launches[k], count, speed_mps, &fan);
    for (std::size_t i = 0; i < count; ++i) {
      if (!points[i]) {
        ++result.beams_refused;
        continue;
      }
      const Launch& launch = launches[k + i];
      const double down_m = points[i]->z() - launch.start.z();
      const float sigma_ratio = ping.beams[static_cast<std::size_t>(launch.beam)].depth_sigma_ratio;
      result.soundings.push_back(
          {*points[i], launch.beam, static_cast<float>(double{sigma_ratio} * down_m)});
    }
  }
  return result;
}

GeoreferencedPing Georeference(const SoundingPing& ping, const Eigen::Isometry3d& T_map_vehicle) {
  GeoreferencedPing result;
  result.time = ping.time;
  result.ping_number = ping.ping_number;
  result.head = ping.head;
  result.T_map_vehicle = T_map_vehicle;
  result.beams_read = static_cast<int>(ping.soundings.size());
  const Eigen::Isometry3d T_map_level =
      T_map_vehicle * Eigen::Isometry3d(LevelFromBody(T_map_vehicle).transpose());
  for (int i = 0; i < result.beams_read; ++i) {
    const LevelSounding& sounding = ping.soundings[static_cast<std::size_t>(i)];
    if ((sounding.flags & kBeamValid) == 0)
      ++result.beams_invalid;
    else if (!sounding.p_level_m.allFinite())
      ++result.beams_refused;
    else
      result.soundings.push_back(
          {T_map_level * sounding.p_level_m.cast<double>(), i, sounding.sigma_z_m});
  }
  return result;
}

}  // namespace seastitch
