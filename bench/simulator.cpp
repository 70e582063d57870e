#include "bench/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/kongsberg/kmall_stream.hpp"
#include "common/core/pose.hpp"
#include "drivers/dvl/dvl_can.hpp"
#include "drivers/imu/imu_can.hpp"

namespace seastitch::bench {
namespace {

// The track's bounding box, widened by the longest horizontal reach of a beam.
MapBox SurveyBox(const SurveyConfig& config, const Path& path) {
  const double altitude = config.plan.altitude_m > 0.0
                              ? config.plan.altitude_m
                              : std::max(0.0, config.terrain.depth_m - config.plan.depth_m);
  return path.Box(altitude * std::tan(0.5 * Deg2Rad(config.mbes.swath_deg)));
}

std::unique_ptr<Terrain> MakeTerrain(const SurveyConfig& config, const Path& path) {
  ProceduralParams procedural = config.terrain;
  if (config.raster.file.empty())
    return std::make_unique<ProceduralTerrain>(procedural, config.seed);
  std::unique_ptr<Terrain> raster = LoadRaster(config.raster, SurveyBox(config, path));
  if (!config.raster.overlay) return raster;
  procedural.depth_m = 0.0;
  return std::make_unique<SumTerrain>(std::move(raster),
                                      std::make_unique<ProceduralTerrain>(procedural, config.seed));
}

// Time of the n-th sample, rounded to the microseconds of its stamp.
double SampleTime(std::int64_t n, double rate_hz) {
  return std::round(static_cast<double>(n) * 1e6 / rate_hz) * 1e-6;
}

}  // namespace

class SurveySimulator::Impl {
 public:
  Impl(const SurveyConfig& config, const VehicleGeometry& vehicle, const DeviceSignals& signals)
      : config_(config),
        vehicle_(vehicle),
        path_(config.plan),
        terrain_(MakeTerrain(config, path_)),
        trajectory_(path_, config.plan, config.motion, *terrain_, config.seed),
        water_(config.water),
        scene_{trajectory_, *terrain_, water_, vehicle_},
        imu_(config.imu, config.errors, scene_, config.seed),
        dvl_(config.dvl, config.errors, scene_, config.seed),
        mbes_(config.mbes, scene_, config.seed),
        fixes_(config.fixes, scene_, config.seed),
        imu_encoder_(signals.imu, config.start),
        dvl_encoder_(signals.dvl),
        loss_(config.seed, "packet loss"),
        next_ping_s_(config.plan.DiveS()) {
    PushProfile();
  }

  std::optional<BenchEvent> Next() {
    for (;;) {
      if (imu_queue_.empty()) RunImu();
      if (dvl_queue_.empty()) RunDvl();
      if (mbes_queue_.empty()) RunMbes();
      if (fix_queue_.empty()) RunFixes();
      std::deque<BenchEvent>* first = nullptr;
      for (std::deque<BenchEvent>* queue : {&mbes_queue_, &dvl_queue_, &imu_queue_, &fix_queue_})
        if (!queue->empty() && (first == nullptr || queue->front().recv < first->front().recv))
          first = queue;
      if (first == nullptr) return std::nullopt;
      BenchEvent event = std::move(first->front());
      first->pop_front();
      if (!IsLost(event)) return event;
      ++counts_.events_lost;
    }
  }

  Time start() const { return config_.start; }
  const Trajectory& trajectory() const { return trajectory_; }
  const Terrain& terrain() const { return *terrain_; }
  const Counts& counts() const { return counts_; }

 private:
  Time StampOf(double t_s) const { return config_.start + FromSeconds(t_s); }

  void RunImu() {
    const double t = SampleTime(imu_samples_, config_.imu.rate_hz);
    if (t > trajectory_.duration_s()) return;
    ++imu_samples_;
    ImuSample sample = imu_.SampleAt(t);
    sample.time = StampOf(t);
    imu_queue_.push_back(
        {StampOf(t + config_.imu.latency_s), Device::kImu, imu_encoder_.Encode(sample), {}});
  }

  void RunDvl() {
    const double t = SampleTime(dvl_samples_, config_.dvl.rate_hz);
    if (t > trajectory_.duration_s()) return;
    ++dvl_samples_;
    DvlSample sample = dvl_.EnsembleAt(t, !InFault(FaultKind::kDvlDropout, t));
    DepthSample depth = dvl_.DepthAt(t);
    sample.time = StampOf(t);
    depth.time = sample.time;
    dvl_queue_.push_back(
        {StampOf(t + config_.dvl.latency_s), Device::kDvl, dvl_encoder_.Encode(sample, depth), {}});
  }

  void RunMbes() {
    const double t = next_ping_s_;
    // No ping in the last 0.5 s: its echoes must arrive before the end.
    if (t + 0.5 > trajectory_.duration_s() || !path_.IsOnSurvey(t)) return;
    MbesModel::Ping result = mbes_.PingAt(t);
    result.ping.time = StampOf(t);
    result.ping.ping_number = static_cast<std::uint32_t>(counts_.pings);
    ++counts_.pings;
    for (const MbesBeam& beam : result.ping.beams) {
      if ((beam.flags & kBeamValid) != 0)
        ++counts_.soundings;
      else
        ++counts_.beams_without_detection;
    }
    const std::vector<std::uint8_t> datagram = EncodeMrz(result.ping, KmallHeader{});
    const Time recv = StampOf(t + result.last_echo_s + config_.mbes.latency_s);
    for (std::vector<std::uint8_t>& part : SplitIntoParts(datagram))
      mbes_queue_.push_back({recv, Device::kMbes, {}, std::move(part)});
    next_ping_s_ = std::round((t + result.next_ping_s) * 1e6) * 1e-6;
  }

  void RunFixes() {
    const std::optional<double> next = fixes_.TimeAfter(last_fix_s_);
    if (!next) return;
    const double t = last_fix_s_ = *next;
    PositionFix fix = fixes_.FixAt(t);
    fix.time = StampOf(t);
    fix_queue_.push_back({fix.time, Device::kFix, {}, {}, fix});
  }

  void PushProfile() {
    SoundVelocityProfile profile;
    profile.time = config_.start;
    profile.depth_m = config_.water.depth_m;
    for (const double speed : config_.water.speed_mps)
      profile.speed_mps.push_back(speed + config_.profile_speed_error_mps);
    mbes_queue_.push_back({config_.start, Device::kMbes, {}, EncodeSvp(profile, KmallHeader{})});
  }

  bool InFault(FaultKind kind, double t_s) const {
    for (const Fault& fault : config_.faults)
      if (fault.kind == kind && t_s >= fault.from_s && t_s < fault.to_s) return true;
    return false;
  }

  bool IsLost(const BenchEvent& event) {
    const double t_s = ToSeconds(event.recv - config_.start);
    bool lost = false;
    for (const Fault& fault : config_.faults) {
      if (fault.kind != FaultKind::kPacketLoss || fault.device != event.device) continue;
      if (t_s >= fault.from_s && t_s < fault.to_s) lost = loss_.Chance(fault.rate) || lost;
    }
    return lost;
  }

  const SurveyConfig config_;
  const VehicleGeometry vehicle_;
  const Path path_;
  const std::unique_ptr<Terrain> terrain_;
  const Trajectory trajectory_;
  const Water water_;
  const Scene scene_;
  ImuModel imu_;
  DvlModel dvl_;
  MbesModel mbes_;
  FixModel fixes_;
  ImuCanEncoder imu_encoder_;
  DvlCanEncoder dvl_encoder_;
  Random loss_;
  std::deque<BenchEvent> imu_queue_;
  std::deque<BenchEvent> dvl_queue_;
  std::deque<BenchEvent> mbes_queue_;
  std::deque<BenchEvent> fix_queue_;
  std::int64_t imu_samples_ = 0;
  std::int64_t dvl_samples_ = 0;
  double last_fix_s_ = 0.0;
  double next_ping_s_;
  Counts counts_;
};

SurveySimulator::SurveySimulator(const SurveyConfig& config,
                                 const VehicleGeometry& vehicle,
                                 const DeviceSignals& signals)
    : impl_(std::make_unique<Impl>(config, vehicle, signals)) {}
SurveySimulator::~SurveySimulator() = default;

Time SurveySimulator::start() const { return impl_->start(); }
std::optional<BenchEvent> SurveySimulator::Next() { return impl_->Next(); }
TrueState SurveySimulator::TruthAt(Time t) const {
  return impl_->trajectory().StateAt(ToSeconds(t - start()));
}
const Terrain& SurveySimulator::terrain() const { return impl_->terrain(); }
Duration SurveySimulator::total() const { return FromSeconds(impl_->trajectory().duration_s()); }
const SurveySimulator::Counts& SurveySimulator::counts() const { return impl_->counts(); }

}  // namespace seastitch::bench
