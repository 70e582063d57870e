// Soundings a second from MBES_PING to closed, filtered submaps, on one core: geo-referencing
// through a profile, gates, voxels, prediction, outlier filter. 256 beams over 120 degrees, 10 Hz
// at 1.5 m/s, 10 m above a seabed with relief of 1 m and 1 % of outliers.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {
namespace {

constexpr int kBeams = 256;
constexpr double kSoundMps = 1490.0;
constexpr double kDepthM = 10.0;
const Time kStart = FromUtime(1'700'000'000'000'000);

double Seabed(double x, double y) {
  return 20.0 + 0.6 * std::sin(0.35 * x) * std::cos(0.3 * y) + 0.4 * std::sin(0.11 * x + 0.17 * y);
}

std::optional<Eigen::Isometry3d> PoseAt(Time t) {
  return MakePose({1.5 * ToSeconds(t - kStart), 0.0, kDepthM}, Eigen::Matrix3d::Identity());
}

std::vector<MbesPing> Line(int pings) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<MbesPing> line;
  for (int i = 0; i < pings; ++i) {
    MbesPing ping;
    ping.time = kStart + FromSeconds(0.1 * i);
    ping.sound_speed_mps = kSoundMps;
    for (int b = 0; b < kBeams; ++b) {
      const double angle = Deg2Rad(120.0) * (b / (kBeams - 1.0) - 0.5);
      double range = 10.0 / std::cos(angle);
      for (int round = 0; round < 8; ++round)
        range = (Seabed(0.15 * i, range * std::sin(angle)) - kDepthM) / std::cos(angle);
      if (uniform(random) < 0.01) range *= 0.6 + 0.7 * uniform(random);
      MbesBeam beam;
      beam.rx_angle_rad = static_cast<float>(angle);
      beam.twtt_s = static_cast<float>(2.0 * (range + noise(random)) / kSoundMps);
      beam.flags = kBeamValid;
      ping.beams.push_back(beam);
    }
    line.push_back(std::move(ping));
  }
  return line;
}

void BM_PingsToSubmaps(benchmark::State& state) {
  const std::vector<MbesPing> line = Line(2000);
  SoundVelocityProfile profile;
  for (int i = 0; i <= 50; ++i) {
    profile.depth_m.push_back(i);
    profile.speed_mps.push_back(kSoundMps + 2.0 * std::sin(0.3 * i));
  }
  const RayTracer rays = *RayTracer::Make(profile);
  std::size_t submaps = 0;
  for (auto _ : state) {
    const auto drift = [](Time, Time) -> Eigen::Matrix3d {
      return Eigen::Vector3d(0.01, 0.01, 1e-5).asDiagonal();
    };
    SubmapBuilder builder({}, {}, drift, [](Time, Time) { return Pose2{}; });
    for (const MbesPing& ping : line)
      if (builder.Add(*Georeference(ping, PoseAt, {}, rays))) ++submaps;
    if (builder.Finish()) ++submaps;
  }
  state.counters["submaps"] =
      static_cast<double>(submaps) / static_cast<double>(state.iterations());
  state.counters["soundings_per_s"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * static_cast<double>(line.size()) * kBeams,
      benchmark::Counter::kIsRate);
}

BENCHMARK(BM_PingsToSubmaps)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace seastitch
