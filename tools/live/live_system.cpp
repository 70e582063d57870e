#include "tools/live/live_system.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/health.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "logger/logger_config.hpp"
#include "mapper/mapper_config.hpp"
#include "page/page_node.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

// How long the system waits for a process to start, to answer or to stop, on a busy machine too.
constexpr seconds kPatience(60);

// A socket bound to a free port of the loopback interface. type: SOCK_DGRAM (UDP) or SOCK_STREAM.
int BindFreePort(int type) {
  const int fd = socket(AF_INET, type | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd < 0 || bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("no free port on the loopback interface");
  }
  return fd;
}

// Different free ports. All are held until all are found.
std::vector<int> FreePorts(int type, int count) {
  std::vector<int> sockets;
  std::vector<int> ports;
  for (int i = 0; i < count; ++i) sockets.push_back(BindFreePort(type));
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

// Reads a configuration file, changes it, and writes it.
template <class Config>
void Change(const fs::path& file,
            Config (*load)(const std::string& path),
            const std::function<void(Config*)>& change) {
  Config config = load(file.string());
  change(&config);
  std::ofstream(file) << PrintConfig(config);
}

// What can make a live run differ from its replay. Which sample is late depends on the order in
// which a process hears two others, so that it can differ between mapper and logger.
constexpr HealthValue kLosses[] = {
    HealthValue::kInputMissed, HealthValue::kSocketDrops, HealthValue::kEventsDropped};

[[noreturn]] void Fail(const ChildProcess& process, const std::string& how) {
  throw std::runtime_error("seastitch-" + process.name() + " " + how + "; see " +
                           process.output().string());
}

}  // namespace

LiveSystem::Listener::Listener(const std::string& url) : bus_(url) {
  bus_.Subscribe<health_t>(
      channels::kHealth, QueueOf(channels::kHealth), [this](const health_t& m) {
        alive_.insert(m.process);
        for (const HealthValue loss : kLosses)
          if (const auto lost = ValueIn(m, loss); lost > 0)
            lost_[m.process + " " + NameOf(loss)] = *lost;
        faults_[m.process].clear();
        for (const condition_t& fault : m.conditions) faults_[m.process] += " " + fault.name;
      });
  bus_.Subscribe<graph_update_t>(channels::kGraphUpdate, 0, [this](const graph_update_t& m) {
    mapped_ = std::max(mapped_, m.version);
  });
  bus_.Subscribe<pose_graph_t>(channels::kPoseGraph, 0, [this](const pose_graph_t& m) {
    solved_ = std::max(solved_, m.graph_version);
  });
}

bool LiveSystem::Listener::WaitUntil(const std::function<bool()>& done, seconds timeout) {
  const auto deadline = steady_clock::now() + timeout;
  // Receives first, so that messages already sent count.
  for (int i = 0; i < 10 || !done(); ++i) {
    if (steady_clock::now() > deadline) return false;
    bus_.HandleAll();
    usleep(10'000);
  }
  return true;
}

LiveSystem::LiveSystem(const fs::path& out, const bench::SurveyConfig& survey)
    : out_(out),
      config_(out / "config"),
      ports_(FreePorts(SOCK_DGRAM, 4)),
      page_(Loopback(FreePorts(SOCK_STREAM, 1).front())),
      lcm_url_("udpm://239.255.76.67:" + std::to_string(ports_[3]) +
               "?ttl=0&recv_buf_size=4194304"),
      targets_{Loopback(ports_[0]), Loopback(ports_[1]), Loopback(ports_[2]), lcm_url_},
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
  const auto set_dives_dir = [this](auto* c) { c->dive.dives_dir = fs::absolute(dives_dir()); };
  Change<LoggerConfig>(config_ / "logger.yaml", LoadLoggerConfig, set_dives_dir);
  Change<MapperConfig>(config_ / "mapper.yaml", LoadMapperConfig, set_dives_dir);
  Change<PageConfig>(config_ / "page.yaml", LoadPageConfig, [this](auto* c) {
    c->listen = page_;
    c->dives_dir = fs::absolute(dives_dir());
  });
  for (const char* name :
       {"logger", "optimizer", "mapper", "imu-driver", "dvl-driver", "mbes-driver", kPage}) {
    Start(name);
  }
}

fs::path LiveSystem::dive() const { return NewestDive(dives_dir()).value(); }

std::vector<std::string> LiveSystem::names() const {
  std::vector<std::string> names;
  for (const ChildProcess& process : processes_) names.push_back(process.name());
  return names;
}

std::string LiveSystem::Lost() const {
  std::string lost;
  for (const auto& [counter, count] : listener_.lost())
    lost += counter + " " + std::to_string(count) + "\n";
  return lost;
}

void LiveSystem::WaitUntilUp() {
  const auto up = [&] {
    CheckRunning();
    return listener_.alive() >= processes_.size();
  };
  if (listener_.WaitUntil(up, kPatience)) return;
  throw std::runtime_error(std::to_string(listener_.alive()) + " of " +
                           std::to_string(processes_.size()) + " processes said HEALTH on " +
                           lcm_url_ + "; see " + (out_ / "log").string());
}

void LiveSystem::Poll() {
  listener_.HandleAll();
  CheckRunning();
}

void LiveSystem::Stop() {
  for (const char* name : {"imu-driver", "dvl-driver", "mbes-driver", "mapper"}) StopOne(name);
  if (!listener_.WaitUntil([&] { return listener_.solved(); }, kPatience)) {
    throw std::runtime_error("the optimizer did not answer the mapper's last graph");
  }
  for (const char* name : {kPage, "optimizer", "logger"}) StopOne(name);
}

std::string LiveSystem::Faults() const {
  std::string text;
  for (const auto& [process, names] : listener_.faults())
    if (!names.empty()) text += " " + process + ":" + names;
  return text;
}

void LiveSystem::Kill(const std::string& name) {
  processes_.remove_if([&](const ChildProcess& process) { return process.name() == name; });
}

void LiveSystem::Start(const std::string& name) {
  std::string config = name + ".yaml";
  std::replace(config.begin(), config.end(), '-', '_');
  const fs::path runtime_directory = out_ / "run" / name;
  fs::create_directories(runtime_directory);
  const int start = starts_[name]++;
  const std::string number = start == 0 ? "" : "." + std::to_string(start);
  processes_.emplace_back(
      name,
      std::vector<std::string>{"/usr/bin/env",
                               "RUNTIME_DIRECTORY=" + fs::absolute(runtime_directory).string(),
                               (BinDir() / ("seastitch-" + name)).string(),
                               "--config",
                               (config_ / config).string(),
                               "--lcm-url",
                               lcm_url_},
      out_ / "log" / (name + number + ".txt"));
}

void LiveSystem::CheckRunning() {
  for (ChildProcess& process : processes_) {
    if (const auto code = process.ExitCode()) Fail(process, "ended with " + std::to_string(*code));
  }
}

void LiveSystem::StopOne(const std::string& name) {
  for (ChildProcess& process : processes_) {
    if (process.name() != name) continue;
    const auto code = process.Stop(kPatience);
    if (!code) Fail(process, "did not stop");
    if (*code != 0) Fail(process, "ended with " + std::to_string(*code));
  }
}

}  // namespace seastitch
