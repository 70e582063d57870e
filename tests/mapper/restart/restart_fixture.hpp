#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper_node.hpp"
#include "seastitch/health_t.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/runtime/notify_socket.hpp"
#include "tests/support/temporary_dir.hpp"

// A mapper's process that is killed and started again.
namespace seastitch {

namespace fs = std::filesystem;

// A disk that hangs until it is told to go on.
class HangingDisk : public Worker {
 public:
  bool Post(Job job) override {
    if (!hangs) return job()(), true;
    jobs_.push_back(std::move(job));
    return jobs_.size() < 3;
  }
  std::size_t queue_depth() const override { return jobs_.size(); }
  void GoOn() {
    hangs = false;
    for (; !jobs_.empty(); jobs_.pop_front()) jobs_.front()()();
  }
  bool hangs = false;

 private:
  std::deque<Job> jobs_;
};

// A mapper from its start to its end, with a bus of its own.
struct Process {
  Process(const MapperConfig& config, Worker* disk)
      : node(config, &bus, &worker, disk, FindMap(config.map_dir, ConfigurationOf(config))) {
    bus.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [this](const graph_update_t& m) {
      if (auto update = FromLcm(m)) updates.push_back(*update);
    });
    bus.Subscribe<submap_t>("SUBMAP", 0, [this](const submap_t& m) {
      submaps.push_back(m.id);
      starts.insert({m.id, m.utime});
      assembler.Add(m);
    });
    bus.Subscribe<submap_points_t>("SUBMAP_POINTS", 0, [this](const submap_points_t& m) {
      if (const auto submap = assembler.Add(m)) whole.insert(submap->id.value);
    });
    bus.Subscribe<nav_t>("NAV", 0, [this](const nav_t&) { ++navs; });
  }
  void Drive(double duration_s, PerfectVehicle* vehicle) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle->Step(1.5, 0.0))
        std::visit([this](const auto& s) { Send(s); }, sample);
      bus.HandleAll();
    }
  }
  // What an INS would say of the same.
  void DriveGiven(double duration_s, PerfectVehicle* vehicle) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle->Step(1.5, 0.0))
        if (const auto* ping = std::get_if<MbesPing>(&sample)) Send(*ping);
      const Eigen::Isometry3d T = vehicle->TrueAt(vehicle->time);
      NavigationSample ins;
      ins.time = vehicle->time;
      ins.position = GeoPosition{PointAt(T.translation().x(), T.translation().y())};
      ins.depth = InsVertical{PerfectVehicle::kDepthM, 0.0};
      ins.attitude = Attitude{Eigen::Quaterniond(T.linear())};
      ins.velocity = GeoVelocity{{1.5, 0.0, 0.0}};
      bus.Publish("INS", ToLcm(ins, {ins.time, seq[0]++}));
      bus.HandleAll();
    }
  }
  void Send(const ImuSample& s) { Publish("IMU", s, &seq[0]); }
  void Send(const DvlSample& s) { Publish("DVL", s, &seq[1]); }
  void Send(const DepthSample& s) { Publish("DEPTH", s, &seq[2]); }
  void Send(const MbesPing& p) { Publish("MBES_PING", p, &seq[3]); }
  template <class Sample>
  void Publish(const char* channel, Sample sample, std::int64_t* number) {
    sample.time += FromSeconds(clock_s);
    bus.Publish(channel, ToLcm(sample, {sample.time, (*number)++}));
  }
  std::string Text() { return node.health().Snapshot(0, 1.0).text; }
  void SendProfile() {
    SoundVelocityProfile profile{FromUtime(1'700'000'000'000'000), {0.0, 100.0}, {1500.0, 1502.0}};
    bus.Publish("SVP", ToLcm(profile, {profile.time, profiles++}));
    bus.HandleAll();
  }
  // HEALTH of a process, for so long.
  void Hear(double duration_s) {
    health_t msg{};
    msg.process = "logger";
    for (const double end_s = uptime_s + duration_s; uptime_s < end_s; uptime_s += 1.0) {
      msg.utime = ToUtime(FromUtime(1'700'000'000'000'000) + FromSeconds(uptime_s + clock_s));
      msg.uptime_s = uptime_s;
      bus.Publish("HEALTH", msg);
      bus.HandleAll();
    }
  }

  Bus bus{"memq://"};
  InlineWorker worker;
  MapperNode node;
  std::array<std::int64_t, 4> seq{};
  std::int64_t profiles = 0;
  double uptime_s = 100.0;
  double clock_s = 0.0;  // the computer's, ahead of the vehicle's time
  std::vector<GraphUpdate> updates;
  std::vector<std::int32_t> submaps;                       // announced
  std::set<std::pair<std::int32_t, std::int64_t>> starts;  // the same, with their first ping's time
  std::set<std::int32_t> whole;                            // with all their points
  SubmapAssembler assembler;
  int navs = 0;
};

class Restart : public testing::Test {
 protected:
  Restart() {
    config_.map_dir = dir_ / "map";
    config_.submap.max_duration_s = 8.0;
    fs::create_directory(config_.map_dir);
  }
  std::set<std::string> Maps() const {
    std::set<std::string> maps;
    for (const auto& entry : fs::directory_iterator(dir_.path()))
      maps.insert(entry.path().filename().string());
    return maps;
  }

  TemporaryDir dir_;
  MapperConfig config_;
  InlineWorker disk_;
  PerfectVehicle vehicle_;
};

}  // namespace seastitch
