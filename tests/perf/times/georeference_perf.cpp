// Soundings a second, MBES_PING to points in the map: 256 and 512 beams over 130 degrees, 20 m
// above the seabed. `samples`: the profile's between transducer and seabed. Beside it the least
// that can be done: one straight ray a beam from one pose.

#include <benchmark/benchmark.h>

#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 1490.0;
constexpr double kDepthM = 30.0;
constexpr double kAltitudeM = 20.0;
const Time kPing = FromUtime(1'700'000'000'000'000);

MbesPing FlatSeabed(std::int64_t beams) {
  MbesPing ping;
  ping.time = kPing;
  ping.sound_speed_mps = kSpeedMps;
  for (std::int64_t i = 0; i < beams; ++i) {
    const double angle =
        Deg2Rad(130.0) * (static_cast<double>(i) / static_cast<double>(beams - 1) - 0.5);
    MbesBeam beam;
    beam.rx_angle_rad = static_cast<float>(angle);
    beam.tx_tilt_rad = static_cast<float>(Deg2Rad(i < beams / 2 ? 0.5 : -0.5));
    beam.twtt_s = static_cast<float>(2.0 * kAltitudeM / std::cos(angle) / kSpeedMps);
    beam.flags = kBeamValid;
    ping.beams.push_back(beam);
  }
  return ping;
}

std::optional<Eigen::Isometry3d> Moving(Time t) {
  const double s = ToSeconds(t - kPing);
  return MakePose({1.5 * s, 0.0, kDepthM}, RotationFromRpy(0.02 + 0.1 * s, 0.01, 0.5));
}

void PerSounding(benchmark::State& state, std::int64_t beams) {
  state.counters["soundings_per_s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * beams), benchmark::Counter::kIsRate);
}

void BM_StraightRays(benchmark::State& state) {
  const MbesPing ping = FlatSeabed(state.range(0));
  std::vector<Eigen::Vector3d> points(ping.beams.size());
  for (auto _ : state) {
    const Eigen::Isometry3d T = *Moving(ping.time);
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      const double range = 0.5 * kSpeedMps * double{ping.beams[i].twtt_s};
      const double angle = ping.beams[i].rx_angle_rad;
      points[i] = T * Eigen::Vector3d(0.0, range * std::sin(angle), range * std::cos(angle));
    }
    benchmark::DoNotOptimize(points.data());
    benchmark::ClobberMemory();
  }
  PerSounding(state, state.range(0));
}

void BM_Georeference(benchmark::State& state) {
  const MbesPing ping = FlatSeabed(state.range(0));
  const auto samples = static_cast<int>(state.range(1));
  SoundVelocityProfile profile;
  for (int i = 0; i <= samples; ++i) {
    const double down = 1.3 * kAltitudeM * i / std::max(samples, 1);
    profile.depth_m.push_back(kDepthM + down);
    // A thermocline of 8 m/s with noise on it.
    profile.speed_mps.push_back(kSpeedMps - 4.0 * (1.0 + std::tanh((down - 10.0) / 3.0)) +
                                0.05 * std::sin(17.0 * i));
  }
  const RayTracer rays = samples == 0 ? RayTracer::Constant(kSpeedMps) : *RayTracer::Make(profile);
  std::size_t placed = 0;
  for (auto _ : state) {
    const auto result = Georeference(ping, Moving, {}, rays);
    placed += result->soundings.size();
  }
  if (placed != static_cast<std::size_t>(state.iterations()) * ping.beams.size())
    state.SkipWithError("a beam was refused");
  PerSounding(state, state.range(0));
}

BENCHMARK(BM_StraightRays)->ArgName("beams")->Arg(256)->Arg(512);
BENCHMARK(BM_Georeference)->ArgNames({"beams", "samples"})->ArgsProduct({{256, 512}, {0, 10, 100}});

}  // namespace
}  // namespace seastitch
