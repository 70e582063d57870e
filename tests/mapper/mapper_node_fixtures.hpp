#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper_node.hpp"
#include "optimizer/optimizer_node.hpp"
#include "seastitch/health_t.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/support/temporary_dir.hpp"

// A mapper's node on a bus of its own, and what it sends.
namespace seastitch {

namespace fs = std::filesystem;

inline constexpr double kSpeedMps = 1.5;
inline constexpr double kSoundMps = PerfectVehicle::kSoundMps;

// A worker that keeps jobs until RunAll(), as a busy thread would.
class HeldWorker : public Worker {
 public:
  bool Post(Job job) override {
    jobs_.push_back(std::move(job));
    return true;
  }
  std::size_t queue_depth() const override { return jobs_.size(); }
  void RunAll() {
    while (!jobs_.empty()) {
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      job()();
    }
  }

 private:
  std::deque<Job> jobs_;
};

// A vehicle with perfect sensors, except for its compass if requested. Its messages go to a mapper
// on a separate bus.
class Survey {
 public:
  explicit Survey(Worker* worker = nullptr, const NavigationParams& navigation = {})
      : dir_(MakeDir()) {
    MapperConfig config;
    config.navigation = navigation;
    config.map_dir = dir_;
    config.max_waiting_submaps = 2;
    node = std::make_unique<MapperNode>(config, &bus, worker == nullptr ? &inline_ : worker);
    bus.Subscribe<nav_t>("NAV", 0, [this](const nav_t& m) { navs.push_back(m); });
    bus.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [this](const graph_update_t& m) {
      if (auto update = FromLcm(m)) updates.push_back(*update);
    });
    bus.Subscribe<submap_t>("SUBMAP", 0, [this](const submap_t& m) { assembler_.Add(m); });
    bus.Subscribe<submap_points_t>("SUBMAP_POINTS", 0, [this](const submap_points_t& m) {
      if (auto submap = assembler_.Add(m)) submaps.push_back(*submap);
    });
    // Answers like an optimizer with relative sigmas of 1 m and 1 rad.
    bus.Subscribe<covariance_request_t>(
        "COVARIANCE_REQUEST", 0, [this](const covariance_request_t& m) {
          requests.push_back(*FromLcm(m));
          if (!optimizer_answers) return;
          PairCovariances answer{m.sender, m.seq, m.graph_version, {}, m.graph_id};
          for (const auto& [a, b] : requests.back().pairs)
            answer.pairs.push_back({a, b, Eigen::Matrix3d::Identity()});
          bus.Publish("COVARIANCES", ToLcm(answer, FromUtime(m.utime), m.seq));
        });
    bus.SubscribeBytes(".*", 0, [this](const std::string& channel, const void* data, int size) {
      if (channel == "NAV" || channel.starts_with("SUBMAP") || channel == "GRAPH_UPDATE")
        out +=
            channel + std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
    });
  }
  ~Survey() { fs::remove_all(dir_); }

  void PublishProfile() {
    SoundVelocityProfile profile{vehicle.time, {0.0, 100.0}, {kSoundMps, kSoundMps}};
    bus.Publish("SVP", ToLcm(profile, {vehicle.time, 0}));
    bus.HandleAll();
  }
  // Two lines of opposite course, 15 m apart, with the turn between them.
  void TwoLines(double length_m) {
    // no jump in speed that the IMU did not measure
    Drive(2.0 + length_m / kSpeedMps, kSpeedMps, 0.0);
    const double turn_s = kPi * 7.5 / kSpeedMps;
    Drive(turn_s, kSpeedMps, kPi / turn_s);
    Drive(length_m / kSpeedMps, kSpeedMps, 0.0);
  }
  void Drive(double duration_s, double speed_mps, double yaw_rate_radps) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle.Step(speed_mps, yaw_rate_radps))
        std::visit([this](const auto& s) { Send(s); }, sample);
      bus.HandleAll();
    }
  }
  void Finish() {
    node->Finish();
    bus.HandleAll();
  }
  // Health after a solution.
  health_t Solve(const PoseGraph& graph) {
    for (const pose_graph_t& part : ToLcm(graph, solutions_ + 1, FromUtime(0), solutions_))
      bus.Publish("POSE_GRAPH", part);
    ++solutions_;
    bus.HandleAll();
    return node->health().Snapshot(0, 1.0);
  }
  // Puts a file at the place of the survey directory: every write fails.
  void BreakDisk() {
    fs::remove_all(dir_);
    std::ofstream(dir_) << "in the way";
  }

  Bus bus{"memq://"};
  std::unique_ptr<MapperNode> node;
  PerfectVehicle vehicle;
  std::vector<nav_t> navs;
  std::vector<GraphUpdate> updates;
  std::vector<CovarianceRequest> requests;
  bool optimizer_answers = true;
  std::vector<Submap> submaps;
  std::string out;  // all bytes sent

 private:
  static fs::path MakeDir() {
    static int number = 0;
    return fs::path(testing::TempDir()) /
           ("seastitch_mapper_" + std::to_string(::getpid()) + "_" + std::to_string(number++));
  }

  void Send(const ImuSample& s) { bus.Publish("IMU", ToLcm(s, {s.time, imu_seq_++})); }
  void Send(const DvlSample& s) { bus.Publish("DVL", ToLcm(s, {s.time, dvl_seq_++})); }
  void Send(const DepthSample& s) { bus.Publish("DEPTH", ToLcm(s, {s.time, depth_seq_++})); }
  void Send(const MbesPing& s) { bus.Publish("MBES_PING", ToLcm(s, {s.time, ping_seq_++})); }

  InlineWorker inline_;
  fs::path dir_;
  SubmapAssembler assembler_;
  std::int64_t imu_seq_ = 0;
  std::int64_t dvl_seq_ = 0;
  std::int64_t depth_seq_ = 0;
  std::int64_t ping_seq_ = 0;
  std::int64_t solutions_ = 0;
};

}  // namespace seastitch
