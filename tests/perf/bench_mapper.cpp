// Memory of the mapper against the length of the survey: a MapperNode as it flies (navigation,
// geo-referencing, submaps, store, registration, graph), fed message by message with a lawn-mower
// survey of 512 beams at 10 Hz, 2 m/s, 20 m above relief of 1 m, lines of 1 km, 40 m apart. Peak of
// the whole process, nothing taken off. Usage:
//   seastitch-bench-mapper [MILLION_SOUNDINGS...]        0 1 10 40 where not given; rising

#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper_node.hpp"
#include "tests/perf/surveying_vehicle.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr int kBeams = 512;

// A vehicle whose messages go to a mapper on a bus of its own. The graph's solution is its dead
// reckoning.
class Survey {
 public:
  explicit Survey(const fs::path& directory) {
    MapperConfig config;
    config.navigation.start_at_first_fix = false;
    config.map_dir = directory;
    SoundVelocityProfile water;
    water.depth_m = {0.0, 100.0};
    water.speed_mps = {1500.0, 1500.0};
    config.sound_velocity_profile = water;
    node_.emplace(config, &bus_, &worker_);
    bus_.Subscribe<graph_update_t>(
        "GRAPH_UPDATE", 0, [this](const graph_update_t& msg) { OnUpdate(msg); });
  }

  // Whole 20 ms up to the sounding asked for.
  void RunTo(double soundings) {
    while (vehicle_.soundings() < soundings) {
      vehicle_.Step(&bus_);
      bus_.HandleAll();
    }
  }

  const SurveyingVehicle& vehicle() const { return vehicle_; }
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
    for (const pose_graph_t& part :
         ToLcm(solution_, update->version, vehicle_.time(), solution_seq_)) {
      bus_.Publish("POSE_GRAPH", part);
      ++solution_seq_;
    }
  }

  Bus bus_{"memq://"};
  InlineWorker worker_;
  std::optional<MapperNode> node_;
  SurveyingVehicle vehicle_{kBeams};
  std::size_t closures_ = 0;
  PoseGraph solution_;
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
                1e-6 * survey.vehicle().soundings(),
                1e-3 * survey.vehicle().distance_m(),
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
