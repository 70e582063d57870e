// A long dive: mapper, with its journal on the disk, and optimizer as they fly, fed message by
// message with a lawn-mower survey (tests/perf/surveying_vehicle.hpp). What memory and disk grow
// by, and how long a mapper takes to read such a map again and go on in it.

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/process/freed_memory.hpp"
#include "mapper/mapper_node.hpp"
#include "mapper/restart/map_store.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"
#include "tests/perf/surveying_vehicle.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Navigation's window is 40 minutes; the clouds in memory and the judge's submaps are as many.
constexpr double kFilledH = 2.0;

struct Options {
  double hours = 1.0;
  double every_h = 0.5;
  int beams = 256;
  fs::path dir;
};

double MemoryMb() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return static_cast<double>(pages) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

double CpuS() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

class Stopwatch {
 public:
  double wall_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double cpu_s() const { return CpuS() - start_cpu_s_; }

 private:
  Clock::time_point start_ = Clock::now();
  double start_cpu_s_ = CpuS();
};

double DiskMb(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return 1e-6 * static_cast<double>(bytes);
}

MapperConfig ConfigFor(const fs::path& map) {
  MapperConfig config;
  config.navigation.start_at_first_fix = false;
  config.map_dir = map;
  SoundVelocityProfile water;
  water.depth_m = {0.0, 100.0};
  water.speed_mps = {1500.0, 1500.0};
  config.sound_velocity_profile = water;
  return config;
}

// Mapper and optimizer on a bus of their own, from the map that is in the folder.
class Processes {
 public:
  explicit Processes(const fs::path& map)
      : config_(ConfigFor(map)),
        mapper_(config_, &bus_, &worker_, &worker_, FindMap(map, ConfigurationOf(config_))),
        optimizer_(OptimizerParams{}, &bus_, &worker_, OptimizerNode::SolveOn::kWhenAsked) {}

  // Live, each is called many times a second.
  void Work(SurveyingVehicle* vehicle) {
    vehicle->Step(&bus_);
    bus_.HandleAll();
    mapper_.SendWaiting();
    optimizer_.EndStart();
  }
  std::int64_t Count(const std::string& name) const {
    const auto counters = mapper_.mapper().counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }
  std::int64_t versions() const { return mapper_.mapper().graph().version(); }

 private:
  const MapperConfig config_;
  Bus bus_{"memq://"};
  InlineWorker worker_;
  MapperNode mapper_;
  OptimizerNode optimizer_;
};

// What a dive has become.
struct State {
  double hours = 0.0;
  double soundings = 0.0;
  std::int64_t submaps = 0;
  std::int64_t closures = 0;
  std::int64_t solutions = 0;
  double memory_mb = 0.0;
  double disk_mb = 0.0;
  double cpu_s = 0.0;
};

class Dive {
 public:
  explicit Dive(const Options& options)
      : map_(options.dir / "map"), vehicle_(options.beams), processes_(std::in_place, map_) {}

  void RunTo(double hours) {
    while (vehicle_.hours() < hours) processes_->Work(&vehicle_);
  }
  State Now() const {
    return {vehicle_.hours(),
            vehicle_.soundings(),
            Submaps(),
            processes_->Count("loop_closures_accepted"),
            processes_->Count("solutions_used"),
            MemoryMb(),
            DiskMb(map_),
            CpuS()};
  }
  std::int64_t Submaps() const {
    std::int64_t submaps = processes_->Count("submaps_resumed");
    for (const char* trigger : {"information", "length", "turn", "gap", "end"})
      submaps += processes_->Count(std::string("submaps_by_") + trigger);
    return submaps;
  }
  // As after kill -9, to the first state of navigation.
  void Restart() {
    processes_.reset();
    const Stopwatch all;
    processes_.emplace(map_);
    const double read_s = all.cpu_s();
    processes_->Work(&vehicle_);
    std::printf(
        "restarted with %lld submaps and %lld closures in %.2f s of CPU, %.2f s of them to read; "
        "%.2f s by the clock\n",
        static_cast<long long>(Submaps()),
        static_cast<long long>(processes_->Count("loop_closures_accepted")),
        all.cpu_s(),
        read_s,
        all.wall_s());
  }

 private:
  const fs::path map_;
  SurveyingVehicle vehicle_;
  std::optional<Processes> processes_;
};

void Print(const State& now) {
  std::printf("%6.2f  %12.1f  %8lld  %8lld  %9lld  %9.0f  %8.0f  %7.0f\n",
              now.hours,
              1e-6 * now.soundings,
              static_cast<long long>(now.submaps),
              static_cast<long long>(now.closures),
              static_cast<long long>(now.solutions),
              now.memory_mb,
              now.disk_mb,
              now.cpu_s);
  std::fflush(stdout);
}

void Main(const Options& options) {
  Dive dive(options);
  std::printf("%6s  %12s  %8s  %8s  %9s  %9s  %8s  %7s\n",
              "hours",
              "M soundings",
              "submaps",
              "closures",
              "solutions",
              "memory MB",
              "disk MB",
              "CPU s");
  std::vector<State> states;
  for (int i = 1; i * options.every_h <= options.hours + 1e-9; ++i) {
    dive.RunTo(i * options.every_h);
    states.push_back(dive.Now());
    Print(states.back());
  }
  const State& last = states.back();
  // Until then windows and caches fill.
  const auto first = std::find_if(states.begin(), states.end(), [&](const State& state) {
    return state.hours >= std::min(kFilledH, 0.5 * last.hours);
  });
  if (first->submaps < last.submaps)
    std::printf(
        "memory from %.1f h on: %.1f kB a submap; disk: %.0f MB an hour, %.0f kB a submap\n",
        first->hours,
        1e3 * (last.memory_mb - first->memory_mb) /
            static_cast<double>(last.submaps - first->submaps),
        last.disk_mb / last.hours,
        1e3 * last.disk_mb / static_cast<double>(last.submaps));
  if (states.size() > 1) {
    const State& before = states[states.size() - 2];
    std::printf("CPU of the last %.2f h: %.2f times that of the first\n",
                options.every_h,
                (last.cpu_s - before.cpu_s) / states.front().cpu_s);
  }
  dive.Restart();
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  seastitch::KeepFreedMemory();
  spdlog::set_level(spdlog::level::warn);
  seastitch::Options options;
  CLI::App app("Memory and disk of a long dive, and the restart of a mapper in it");
  app.add_option("hours", options.hours, "of survey")->capture_default_str();
  app.add_option("--every", options.every_h, "hours between two lines")->capture_default_str();
  app.add_option("--beams", options.beams, "of the sonar, at 10 Hz")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const seastitch::TemporaryDir scratch;
  options.dir = scratch.path();
  seastitch::Main(options);
  return EXIT_SUCCESS;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-dive: %s\n", e.what());
  return EXIT_FAILURE;
}
