// Memory of the mapper against the length of the survey: a MapperNode as it flies (navigation,
// geo-referencing, submaps, store, registration, graph), fed message by message with a lawn-mower
// survey of 512 beams at 10 Hz, 2 m/s, 20 m above relief of 1 m, lines of 1 km, 40 m apart. Peak of
// the whole process, nothing taken off. Usage:
//   seastitch-bench-mapper [MILLION_SOUNDINGS...]        0 1 10 40 where not given; rising

#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "mapper/mapper_node.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kSoundMps = 1500.0;
constexpr double kDepthM = 10.0;
constexpr double kAltitudeM = 20.0;
constexpr double kSpeedMps = 2.0;
constexpr double kLineM = 1000.0;
constexpr double kTurnRadiusM = 20.0;
constexpr double kStepS = 0.02;
constexpr int kDvlEvery = 10;
constexpr int kPingEvery = 5;
constexpr int kBeams = 512;
constexpr double kHalfSwathRad = Deg2Rad(60.0);

double Seabed(double x, double y) {
  return kDepthM + kAltitudeM + 0.6 * std::sin(0.17 * x) * std::cos(0.15 * y) +
         0.4 * std::sin(0.06 * x + 0.08 * y);
}

// A vehicle with sensors that err by nothing but noise, whose messages go to a mapper on a bus of
// its own. The graph's solution is its dead reckoning.
class Survey {
 public:
  explicit Survey(const fs::path& directory) {
    MapperConfig config;
    config.navigation.start_at_first_fix = false;
    config.map_dir = directory;
    SoundVelocityProfile water;
    water.depth_m = {0.0, 100.0};
    water.speed_mps = {kSoundMps, kSoundMps};
    config.sound_velocity_profile = water;
    node_.emplace(config, &bus_, &worker_);
    bus_.Subscribe<graph_update_t>(
        "GRAPH_UPDATE", 0, [this](const graph_update_t& msg) { OnUpdate(msg); });
  }

  // Whole 20 ms up to the sounding asked for.
  void RunTo(double soundings) {
    while (soundings_ < soundings) Step();
  }

  double soundings() const { return soundings_; }
  double distance_m() const { return distance_m_; }
  std::size_t submaps() const { return solution_.vertices.size(); }
  std::size_t closures() const { return closures_; }

 private:
  void OnUpdate(const graph_update_t& msg) {
    const std::optional<GraphUpdate> update = FromLcm(msg);
    if (!update) throw std::runtime_error("the mapper sent an unreadable update");
    for (const GraphEdge& edge : update->edges)
      if (edge.kind == EdgeKind::kLoopClosure && edge.verdict == LoopVerdict::kAccepted)
        ++closures_;
    const Eigen::Matrix3d covariance = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
    for (const GraphVertex& vertex : update->vertices)
      solution_.vertices.push_back({vertex.id, vertex.dead_reckoned, covariance, 0.9 * covariance});
    solution_.graph_version = update->version;
    for (const pose_graph_t& part : ToLcm(solution_, update->version, time_, solution_seq_)) {
      bus_.Publish("POSE_GRAPH", part);
      ++solution_seq_;
    }
  }

  // Lines to and fro, half circles between them.
  double YawRate() const {
    const double lap_m = kLineM + kPi * kTurnRadiusM;
    const double along_m = std::fmod(distance_m_, lap_m);
    const bool right = std::fmod(distance_m_, 2.0 * lap_m) < lap_m;
    if (along_m < kLineM) return 0.0;
    return (right ? 1.0 : -1.0) * kSpeedMps / kTurnRadiusM;
  }

  void Step() {
    const double yaw_rate = YawRate();
    time_ += FromSeconds(kStepS);
    distance_m_ += kSpeedMps * kStepS;
    x_ += kSpeedMps * kStepS * std::cos(yaw_ + 0.5 * yaw_rate * kStepS);
    y_ += kSpeedMps * kStepS * std::sin(yaw_ + 0.5 * yaw_rate * kStepS);
    yaw_ += yaw_rate * kStepS;
    SendImu(yaw_rate);
    if (steps_ % kDvlEvery == 0) SendDvlAndDepth();
    if (steps_ % kPingEvery == 0) SendPing();
    ++steps_;
    bus_.HandleAll();
  }

  void SendImu(double yaw_rate) {
    ImuSample imu;
    imu.time = time_;
    imu.angular_rate_radps = {0.0, 0.0, yaw_rate};
    imu.specific_force_mps2 = {0.0, kSpeedMps * yaw_rate, -9.805};
    imu.attitude = Attitude{Eigen::Quaterniond(Eigen::AngleAxisd(yaw_, Eigen::Vector3d::UnitZ())),
                            Eigen::Vector3d(1e-3, 1e-3, 3e-3)};
    bus_.Publish("IMU", ToLcm(imu, {time_, imu_seq_++}));
  }

  void SendDvlAndDepth() {
    DvlSample dvl;
    dvl.time = time_;
    dvl.bottom_lock = true;
    dvl.v_dvl_mps = {kSpeedMps, 0.0, 0.0};
    dvl.sigma_v_mps = {0.01, 0.01, 0.01};
    bus_.Publish("DVL", ToLcm(dvl, {time_, dvl_seq_++}));
    bus_.Publish("DEPTH", ToLcm(DepthSample{time_, 0.0, kDepthM, 0.01}, {time_, depth_seq_++}));
  }

  void SendPing() {
    std::normal_distribution<double> noise_m(0.0, 0.03);
    std::uniform_real_distribution<double> chance(0.0, 1.0);
    MbesPing ping;
    ping.time = time_;
    ping.sound_speed_mps = kSoundMps;
    ping.beams.resize(kBeams);
    for (int b = 0; b < kBeams; ++b) {
      const double angle = kHalfSwathRad * (2.0 * b / (kBeams - 1.0) - 1.0);
      double down_m = kAltitudeM;
      for (int round = 0; round < 5; ++round) {
        const double across_m = down_m * std::tan(angle);
        down_m = Seabed(x_ - across_m * std::sin(yaw_), y_ + across_m * std::cos(yaw_)) - kDepthM;
      }
      if (chance(random_) < 0.01) down_m *= 0.6 + 0.7 * chance(random_);
      MbesBeam& beam = ping.beams[static_cast<std::size_t>(b)];
      beam.rx_angle_rad = static_cast<float>(angle);
      beam.twtt_s =
          static_cast<float>(2.0 * (down_m / std::cos(angle) + noise_m(random_)) / kSoundMps);
      beam.flags = kBeamValid;
    }
    soundings_ += kBeams;
    bus_.Publish("MBES_PING", ToLcm(ping, {time_, ping_seq_++}));
  }

  Bus bus_{"memq://"};
  InlineWorker worker_;
  std::optional<MapperNode> node_;
  std::mt19937_64 random_{1};
  Time time_ = FromUtime(1'700'000'000'000'000);
  double x_ = 0.0;
  double y_ = 0.0;
  double yaw_ = 0.0;
  double distance_m_ = 0.0;
  double soundings_ = 0.0;
  std::size_t closures_ = 0;
  PoseGraph solution_;
  int steps_ = 0;
  std::int64_t imu_seq_ = 0;
  std::int64_t dvl_seq_ = 0;
  std::int64_t depth_seq_ = 0;
  std::int64_t ping_seq_ = 0;
  std::int64_t solution_seq_ = 0;
};

double PeakMb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024.0 / 1e6;
}

double NowMb() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return static_cast<double>(pages) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

double CpuS() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void Main(const std::vector<double>& millions) {
  const fs::path directory =
      fs::temp_directory_path() / ("seastitch_bench_mapper_" + std::to_string(::getpid()));
  Survey survey(directory);
  std::printf("%12s  %7s  %8s  %8s  %8s  %7s  %7s\n",
              "M soundings",
              "km",
              "submaps",
              "closures",
              "peak MB",
              "now MB",
              "CPU s");
  for (const double goal : millions) {
    survey.RunTo(1e6 * goal);
    std::printf("%12.1f  %7.1f  %8zu  %8zu  %8.0f  %7.0f  %7.0f\n",
                1e-6 * survey.soundings(),
                1e-3 * survey.distance_m(),
                survey.submaps(),
                survey.closures(),
                PeakMb(),
                NowMb(),
                CpuS());
    std::fflush(stdout);
  }
  fs::remove_all(directory);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  std::vector<double> millions;
  for (int i = 1; i < argc; ++i) millions.push_back(std::stod(argv[i]));
  if (millions.empty()) millions = {0.0, 1.0, 10.0, 40.0};
  seastitch::Main(millions);
  return EXIT_SUCCESS;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-mapper: %s\n", e.what());
  return EXIT_FAILURE;
}
