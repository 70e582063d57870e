#pragma once

#include <cstdint>
#include <random>

#include "common/core/time.hpp"
#include "common/runtime/bus.hpp"

namespace seastitch {

// A lawn-mower survey at 2 m/s, 20 m above relief of 1 m, lines of 1 km, 40 m apart: what its
// drivers would publish. The sensors err by nothing but noise.
class SurveyingVehicle {
 public:
  // beams: of the sonar, at 10 Hz.
  explicit SurveyingVehicle(int beams) : beams_(beams) {}

  void Step(Bus* bus);  // 20 ms

  Time time() const { return time_; }
  double hours() const { return ToSeconds(time_ - start_) / 3600.0; }
  double soundings() const { return soundings_; }
  double distance_m() const { return distance_m_; }

 private:
  double YawRate() const;
  void SendImu(double yaw_rate, Bus* bus);
  void SendDvlAndDepth(Bus* bus);
  void SendPing(Bus* bus);

  const int beams_;
  std::mt19937_64 random_{1};
  Time start_ = FromUtime(1'700'000'000'000'000);
  Time time_ = start_;
  double x_ = 0.0;
  double y_ = 0.0;
  double yaw_ = 0.0;
  double distance_m_ = 0.0;
  double soundings_ = 0.0;
  int steps_ = 0;
  std::int64_t imu_seq_ = 0;
  std::int64_t dvl_seq_ = 0;
  std::int64_t depth_seq_ = 0;
  std::int64_t ping_seq_ = 0;
};

}  // namespace seastitch
