#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

// A dive whose clocks step, for the tests of the sensors' clocks.
namespace seastitch {

using testing::HasSubstr;

// A vehicle whose messages are stamped by clocks that may be wrong.
class SteppingClocks : public testing::Test {
 protected:
  static constexpr double kSpeedMps = 1.5;
  struct Clock {
    double utime_s = 0.0;  // ahead of the truth
    double recv_s = 0.0;
    bool silent = false;
    int lose = 0;  // number of next messages to lose
    std::int64_t seq = 0;
  };

  SteppingClocks() : mapper_(std::make_unique<Mapper>(MapperParams{})) {}

  void Drive(double duration_s) {
    for (int i = 0; i < static_cast<int>(std::lround(duration_s / PerfectVehicle::kImuStepS));
         ++i) {
      for (const auto& sample : vehicle_.Step(kSpeedMps, 0.0))
        std::visit([this](const auto& s) { Send(s); }, sample);
      if (++steps_ % 50 == 0 && processes_run_) SendHeartbeat("dvl-driver", Elapsed() / pace_);
      Look();
    }
  }
  template <class Sample>
  void Send(Sample sample) {
    Clock& clock = clocks_[ChannelOf(sample)];
    if (clock.silent) return;
    if (clock.lose > 0) {
      --clock.lose;
      ++clock.seq;
      return;
    }
    Time received = ReceivedAt(sample.time) + FromSeconds(0.004 + clock.recv_s);
    sample.time += FromSeconds(clock.utime_s);
    if constexpr (std::is_same_v<Sample, MbesPing>) {
      for (MbesBeam& beam : sample.beams) beam.twtt_s += static_cast<float>(deeper_s_);
      if (deeper_s_ > 0.0) received += LastEcho(sample) - sample.time;
    }
    mapper_->Add(sample, {received, clock.seq++});
  }
  // Steps the computer's clock, which stamps all sensors except those of `own`.
  void StepComputer(double by_s, std::set<SensorChannel> own = {}) {
    computer_s_ += by_s;
    for (const SensorChannel channel : kChannels) {
      clocks_[channel].recv_s += by_s;
      if (!own.contains(channel)) clocks_[channel].utime_s += by_s;
    }
  }
  void SendHeartbeat(const std::string& process, double uptime_s) {
    mapper_->OnHeartbeat({process, ReceivedAt(vehicle_.time) + FromSeconds(computer_s_), uptime_s});
  }
  // Receive time in a simulation faster than real time.
  Time ReceivedAt(Time t) const { return kStart + FromSeconds(ToSeconds(t - kStart) / pace_); }
  double Elapsed() const { return ToSeconds(vehicle_.time - kStart); }
  void Look() {
    for (const MapperEvent& event : mapper_->TakeEvents()) {
      if (const auto* nav = std::get_if<NavState>(&event)) navs_.push_back({*nav, vehicle_.time});
      submaps_ += std::holds_alternative<std::shared_ptr<const Submap>>(event) ? 1 : 0;
    }
    for (const Condition& condition : mapper_->conditions()) {
      seen_.insert(condition.kind->name);
      if (condition.kind == &conditions::kClockStep) step_ = condition.detail;
    }
  }
  PositionFix Fix() const { return vehicle_.Fix(); }
  // As without a step: NAV ten times a second, every state at the true position.
  void ExpectUnbroken() {
    ASSERT_GT(navs_.size(), 2U);
    for (std::size_t i = 0; i < navs_.size(); ++i) {
      const auto& [nav, came] = navs_[i];
      const double lag_s = ToSeconds(came - nav.time);
      EXPECT_NEAR(lag_s, 0.5, 0.15) << i;  // reorder_window_s
      const Eigen::Vector3d truth = vehicle_.TrueAt(came).translation();
      EXPECT_NEAR(
          nav.T_map_vehicle.translation().x() - (truth.x() - kSpeedMps * 0.5), start_m_, 0.3)
          << i;
      if (i == 0) continue;
      EXPECT_NEAR(ToSeconds(nav.time - navs_[i - 1].first.time), 0.1, 0.021) << i;
    }
  }
  std::int64_t Counter(const std::string& name) const {
    const auto counters = mapper_->counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }
  void ExpectNothingRefused() {
    for (const auto& [name, count] : mapper_->counters()) {
      const bool refused = name.ends_with("_late") || name.ends_with("_ahead") ||
                           name == "nav_imu_gap" || name == "pings_from_the_future";
      EXPECT_TRUE(!refused || count == 0) << name << " " << count;
    }
  }

  static constexpr Time kStart = FromUtime(1'700'000'000'000'000);
  static constexpr std::array kChannels{
      SensorChannel::kImu, SensorChannel::kDvl, SensorChannel::kDepth, SensorChannel::kMbesPing};
  PerfectVehicle vehicle_;
  std::unique_ptr<Mapper> mapper_;
  std::map<SensorChannel, Clock> clocks_;
  std::vector<std::pair<NavState, Time>> navs_;
  std::set<std::string> seen_;
  std::string step_;
  bool processes_run_ = true;
  double computer_s_ = 0.0;  // the computer's clock, ahead of the truth
  double pace_ = 1.0;
  double deeper_s_ = 0.0;  // two-way travel time that all beams have in addition
  int steps_ = 0;
  int submaps_ = 0;
  double start_m_ = 0.0;
};

}  // namespace seastitch
