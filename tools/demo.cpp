#include "tools/demo.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <list>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "bench/live.hpp"
#include "bench/simulator.hpp"
#include "bench/survey_config.hpp"
#include "bench/truth.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/dive_folder.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "logger/logger_config.hpp"
#include "mapper/mapper_config.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "tools/bench_command.hpp"
#include "tools/child_process.hpp"
#include "tools/install_paths.hpp"
#include "tools/progress.hpp"
#include "tools/replay.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

// A UDP socket that keeps a free port of the loopback interface.
int BindFreePort() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd < 0 || bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("demo: no free UDP port on the loopback interface");
  }
  return fd;
}

// Different ports that nobody uses now: all are held until all are known.
std::vector<int> FreeUdpPorts(int count) {
  std::vector<int> sockets;
  std::vector<int> ports;
  for (int i = 0; i < count; ++i) sockets.push_back(BindFreePort());
  for (const int fd : sockets) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
    ports.push_back(ntohs(address.sin_port));
    close(fd);
  }
  return ports;
}

std::string Loopback(int port) { return "127.0.0.1:" + std::to_string(port); }

// Changes a configuration in its file.
template <class Config>
void Change(const fs::path& file,
            Config (*load)(const std::string& path),
            const std::function<void(Config*)>& change) {
  Config config = load(file.string());
  change(&config);
  std::ofstream(file) << PrintConfig(config);
}

// What the demo hears on the bus: who is alive, and how far the graph is solved.
class Listener {
 public:
  explicit Listener(const std::string& url) : bus_(url) {
    bus_.Subscribe<health_t>(channels::kHealth,
                             QueueOf(channels::kHealth),
                             [this](const health_t& m) { alive_.insert(m.process); });
    bus_.Subscribe<graph_update_t>(channels::kGraphUpdate, 0, [this](const graph_update_t& m) {
      mapped_ = std::max(mapped_, m.version);
    });
    bus_.Subscribe<pose_graph_t>(channels::kPoseGraph, 0, [this](const pose_graph_t& m) {
      solved_ = std::max(solved_, m.graph_version);
    });
  }

  bool WaitUntil(const std::function<bool()>& done, seconds patience) {
    const auto deadline = steady_clock::now() + patience;
    // What is on its way already counts: listens before it judges.
    for (int i = 0; i < 10 || !done(); ++i) {
      if (steady_clock::now() > deadline) return false;
      bus_.HandleAll();
      usleep(10'000);
    }
    return true;
  }
  void HandleAll() { bus_.HandleAll(); }
  std::size_t alive() const { return alive_.size(); }
  bool solved() const { return solved_ >= mapped_; }

 private:
  Bus bus_;
  std::set<std::string> alive_;
  std::int64_t mapped_ = 0;
  std::int64_t solved_ = 0;
};

// The real processes on a private LCM URL and loopback ports.
class LiveSystem {
 public:
  LiveSystem(const fs::path& out, const bench::SurveyConfig& survey)
      : out_(out),
        config_(out / "config"),
        ports_(FreeUdpPorts(4)),
        lcm_url_("udpm://239.255.76.67:" + std::to_string(ports_[3]) +
                 "?ttl=0&recv_buf_size=4194304"),
        listener_(lcm_url_) {
    fs::create_directories(out_ / "log");
    fs::copy(ConfigDir(), config_, fs::copy_options::recursive);
    WriteMapperConfigFor(survey, config_, config_);
    Change<ImuDriverConfig>(config_ / "imu_driver.yaml", LoadImuDriverConfig, [this](auto* c) {
      c->driver.source = "udp:" + targets_.imu;
    });
    Change<DvlDriverConfig>(config_ / "dvl_driver.yaml", LoadDvlDriverConfig, [this](auto* c) {
      c->driver.source = "udp:" + targets_.dvl;
    });
    Change<MbesDriverConfig>(config_ / "mbes_driver.yaml", LoadMbesDriverConfig, [this](auto* c) {
      c->driver.source = "udp:" + targets_.mbes;
    });
    const auto set_dives_dir = [this](auto* c) {
      c->dive.dives_dir = fs::absolute(out_ / "dives");
    };
    Change<LoggerConfig>(config_ / "logger.yaml", LoadLoggerConfig, set_dives_dir);
    Change<MapperConfig>(config_ / "mapper.yaml", LoadMapperConfig, set_dives_dir);
    for (const char* name :
         {"logger", "optimizer", "mapper", "imu-driver", "dvl-driver", "mbes-driver"}) {
      Start(name);
    }
  }

  const fs::path& config_dir() const { return config_; }
  // What the logger wrote.
  fs::path dive() const { return NewestDive(out_ / "dives").value(); }
  const bench::LiveTargets& targets() const { return targets_; }

  void WaitUntilUp() {
    if (listener_.WaitUntil(
            [&] {
              CheckRunning();
              return listener_.alive() >= processes_.size();
            },
            seconds(20))) {
      return;
    }
    throw std::runtime_error("demo: " + std::to_string(listener_.alive()) + " of " +
                             std::to_string(processes_.size()) + " processes said HEALTH on " +
                             lcm_url_ + "; see " + (out_ / "log").string());
  }

  // Between bursts of the bench: hears the bus, so that its buffer does not fill.
  void Poll() {
    listener_.HandleAll();
    CheckRunning();
  }

  // Drivers first, so that the mapper has all there is; then the mapper, which closes its last
  // submap; the optimizer when it has answered; the logger last.
  void Stop() {
    for (const char* name : {"imu-driver", "dvl-driver", "mbes-driver", "mapper"}) StopOne(name);
    if (!listener_.WaitUntil([&] { return listener_.solved(); }, seconds(20))) {
      throw std::runtime_error("demo: the optimizer did not answer the mapper's last graph");
    }
    StopOne("optimizer");
    StopOne("logger");
  }

 private:
  void Start(const std::string& name) {
    std::string config = name + ".yaml";
    std::replace(config.begin(), config.end(), '-', '_');
    processes_.emplace_back(name,
                            std::vector<std::string>{(BinDir() / ("seastitch-" + name)).string(),
                                                     "--config",
                                                     (config_ / config).string(),
                                                     "--lcm-url",
                                                     lcm_url_},
                            out_ / "log" / (name + ".txt"));
  }

  void CheckRunning() {
    for (ChildProcess& process : processes_) {
      if (const auto code = process.ExitCode())
        Fail(process, "ended with " + std::to_string(*code));
    }
  }

  void StopOne(const std::string& name) {
    for (ChildProcess& process : processes_) {
      if (process.name() != name) continue;
      const auto code = process.Stop(seconds(60));
      if (!code) Fail(process, "did not stop");
      if (*code != 0) Fail(process, "ended with " + std::to_string(*code));
    }
  }

  [[noreturn]] static void Fail(const ChildProcess& process, const std::string& how) {
    throw std::runtime_error("demo: seastitch-" + process.name() + " " + how + "; see " +
                             process.output().string());
  }

  fs::path out_;
  fs::path config_;
  std::vector<int> ports_;
  std::string lcm_url_;
  bench::LiveTargets targets_{
      Loopback(ports_[0]), Loopback(ports_[1]), Loopback(ports_[2]), lcm_url_};
  Listener listener_;
  std::list<ChildProcess> processes_;
};

void PrintRow(const char* what,
              const char* unit,
              double live_before,
              double live_after,
              double replay_before,
              double replay_after) {
  std::printf("  %-22s %8.3f %8.3f   %8.3f %8.3f  %s\n",
              what,
              live_before,
              live_after,
              replay_before,
              replay_after,
              unit);
}

void PrintTable(const ProductSummary& live, const ProductSummary& replay) {
  std::printf("\n  %-22s %-17s   %-17s\n", "", "live", "replayed");
  std::printf("  %-22s %8s %8s   %8s %8s\n", "", "before", "after", "before", "after");
  PrintRow("consistency RMS",
           "m",
           live.before.point.rms_m,
           live.after().point.rms_m,
           replay.before.point.rms_m,
           replay.after().point.rms_m);
  PrintRow("surface error RMS",
           "m",
           live.before.surface.rms_m,
           live.after().surface.rms_m,
           replay.before.surface.rms_m,
           replay.after().surface.rms_m);
  if (live.truth && replay.truth) {
    const TruthComparison& a = *live.truth;
    const TruthComparison& b = *replay.truth;
    PrintRow("position error RMS",
             "m",
             a.before.position_rms_m,
             a.after.position_rms_m,
             b.before.position_rms_m,
             b.after.position_rms_m);
    PrintRow("position error max",
             "m",
             a.before.position_max_m,
             a.after.position_max_m,
             b.before.position_max_m,
             b.after.position_max_m);
    PrintRow("shape of the track RMS",
             "m",
             a.before_aligned.position_rms_m,
             a.after_aligned.position_rms_m,
             b.before_aligned.position_rms_m,
             b.after_aligned.position_rms_m);
    PrintRow("yaw error RMS",
             "deg",
             a.before.yaw_rms_deg,
             a.after.yaw_rms_deg,
             b.before.yaw_rms_deg,
             b.after.yaw_rms_deg);
  }
  if (live.said && replay.said) {
    const TruthComparison& a = *live.said;
    const TruthComparison& b = *replay.said;
    std::printf("  as said at the time: NAV, NAV_CORRECTED\n");
    PrintRow("position error RMS",
             "m",
             a.before.position_rms_m,
             a.after.position_rms_m,
             b.before.position_rms_m,
             b.after.position_rms_m);
    PrintRow("shape of the track RMS",
             "m",
             a.before_aligned.position_rms_m,
             a.after_aligned.position_rms_m,
             b.before_aligned.position_rms_m,
             b.after_aligned.position_rms_m);
  }
  std::printf("  %-22s %17zu   %17zu\n", "submaps", live.submaps, replay.submaps);
  std::printf("  %-22s %8llu of %5llu   %8llu of %5llu\n",
              "loop closures",
              static_cast<unsigned long long>(live.loops_accepted),
              static_cast<unsigned long long>(live.loops_accepted + live.loops_rejected),
              static_cast<unsigned long long>(replay.loops_accepted),
              static_cast<unsigned long long>(replay.loops_accepted + replay.loops_rejected));
  std::printf("  %-22s %17llu   %17llu\n\n",
              "soundings used",
              static_cast<unsigned long long>(live.soundings_used),
              static_cast<unsigned long long>(replay.soundings_used));
}

ProductSummary Replay(const fs::path& dive,
                      const fs::path& truth,
                      const fs::path& config_dir,
                      const fs::path& out,
                      bool as_recorded) {
  ReplayOptions options;
  options.inputs = {dive};
  options.truth = truth;
  options.mapper_config = config_dir / "mapper.yaml";
  options.optimizer_config = config_dir / "optimizer.yaml";
  options.as_recorded = as_recorded;
  options.out = out;
  return RunReplay(options);
}

}  // namespace

int RunDemo(const DemoOptions& options) {
  const fs::path mark = options.out / ".seastitch-demo";
  if (fs::exists(options.out) && !fs::is_empty(options.out) && !fs::exists(mark)) {
    throw std::runtime_error("demo: " + options.out.string() +
                             " holds something else; choose another folder with --out");
  }
  for (const char* old : {"config", "log", "dives", "live", "replay", "survey.truth.csv"}) {
    fs::remove_all(options.out / old);
  }
  fs::create_directories(options.out);
  std::ofstream(mark) << "made by seastitch demo; it empties this folder when it runs again\n";

  LiveSystem live(options.out, bench::LoadSurvey(options.survey.string()));
  BenchOptions bench_options;
  bench_options.survey = options.survey;
  bench_options.terrain = options.terrain;
  bench_options.config_dir = live.config_dir();
  bench::SurveySimulator simulator = MakeSimulator(bench_options);
  const fs::path truth = options.out / "survey.truth.csv";
  bench::WriteTruth(simulator, truth);

  std::fprintf(stderr, "starting logger, drivers, mapper and optimizer\n");
  live.WaitUntilUp();
  ProgressLine progress("surveying", 1000, false);
  const bench::LiveResult sent =
      bench::SendLive(&simulator, live.targets(), options.speed, [&](double part) {
        live.Poll();
        progress.Set(static_cast<std::uint64_t>(1000.0 * part));
        return true;
      });
  progress.Finish();
  if (sent.max_lag_s > 1.0) {
    std::fprintf(
        stderr, "this machine fell %.1f s behind at speed %.0f\n", sent.max_lag_s, options.speed);
  }
  std::fprintf(stderr, "stopping the processes\n");
  live.Stop();

  std::fprintf(stderr, "products of the live run\n");
  const ProductSummary at_sea =
      Replay(live.dive(), truth, live.config_dir(), options.out / "live", true);
  std::fprintf(stderr, "replaying the recorded log in one process\n");
  const ProductSummary ashore =
      Replay(live.dive(), truth, live.config_dir(), options.out / "replay", false);

  PrintTable(at_sea, ashore);
  std::printf("  map and report: %s\n", (options.out / "replay" / "report.html").c_str());
  return EXIT_SUCCESS;
}

}  // namespace seastitch
