#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

// Drives and their sensors, for the tests of dead reckoning.
namespace seastitch {

using test::At;
using test::ClosedSquare;
using test::Feed;
using test::LawnMower;
using test::Motion;
using test::RunOptions;
using test::Sensors;
using test::TestVehicle;
using test::Truth;
using test::TruthState;

inline constexpr double kImuHz = 50.0;

inline std::size_t Index(double t) { return static_cast<std::size_t>(std::lround(t * kImuHz)); }

// From the start of the estimate, which begins wherever the first sample was.
inline Eigen::Vector3d MovedError(const DeadReckoning& navigation,
                                  const std::vector<TruthState>& truth,
                                  double from_s,
                                  double to_s) {
  const auto a = navigation.StateAt(At(from_s));
  const auto b = navigation.StateAt(At(to_s));
  return (b->T_map_vehicle.translation() - a->T_map_vehicle.translation()) -
         (truth[Index(to_s)].T_map_vehicle.translation() -
          truth[Index(from_s)].T_map_vehicle.translation());
}

struct Stream {
  std::vector<ImuSample> imu;
  std::vector<DvlSample> dvl;
  std::vector<DepthSample> depth;
};

inline Stream MakeStream(double duration_s, const NavigationParams& params) {
  const auto truth = Truth(Motion{}, TestVehicle(), duration_s, kImuHz);
  Sensors sensors(params, kImuHz, 11);
  Stream stream;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    stream.imu.push_back(sensors.Imu(truth[i]));
    if (i % 10 == 0) stream.depth.push_back(sensors.Depth(truth[i]));
    if (i % 20 == 0) stream.dvl.push_back(sensors.Dvl(truth[i]));
  }
  return stream;
}

// Everything in the order of time + delay(sensor, its number).
template <class Delay>
inline void Deliver(const Stream& stream, const Delay& delay_s, DeadReckoning* navigation) {
  struct Arrival {
    Time at;
    int kind;
    std::size_t i;
  };
  std::vector<Arrival> arrivals;
  const auto add = [&](int kind, const auto& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      arrivals.push_back({samples[i].time + FromSeconds(delay_s(kind, i)), kind, i});
  };
  add(0, stream.imu);
  add(1, stream.dvl);
  add(2, stream.depth);
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) {
    return a.at < b.at;
  });
  for (const Arrival& arrival : arrivals) {
    if (arrival.kind == 0) navigation->Add(stream.imu[arrival.i]);
    if (arrival.kind == 1) navigation->Add(stream.dvl[arrival.i]);
    if (arrival.kind == 2) navigation->Add(stream.depth[arrival.i]);
  }
  navigation->Finish();
}

}  // namespace seastitch
