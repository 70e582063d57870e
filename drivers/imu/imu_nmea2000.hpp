#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/nmea2000.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/imu/imu_codec.hpp"

// An attitude sensor on NMEA 2000: attitude (PGN 127257) and rate of turn (127251). The groups have
// no time, no accelerations, no rates of roll and pitch and no sigmas. What is missing is filled in
// as for a vehicle that neither accelerates nor rolls nor pitches: specific force is gravity alone,
// the angular rate that of the turn alone.
namespace seastitch {

inline constexpr std::uint32_t kPgnRateOfTurn = 127251;
inline constexpr std::uint32_t kPgnAttitude = 127257;

struct ImuN2kParams {
  int source = -1;  // address of the sensor; -1: any
  Eigen::Vector3d sigma_rpy_rad{0.01, 0.01, 0.035};
  double max_epoch_s = 0.020;  // between the two groups of one measurement
  ClockParams clock{DeviceClock::kReceive, 0.0};
};

// Two groups are one measurement where device and sequence identifier are the same and they came
// within max_epoch_s. One without the other is lost, and never joined to another's.
class ImuN2kDecoder : public ImuCodec {
 public:
  explicit ImuN2kDecoder(const ImuN2kParams& params) : params_(params), stamper_(params.clock) {}

  std::optional<ImuSample> Add(const CanFrame& frame, Time recv) override;
  Time epoch_recv() const override { return epoch_recv_; }
  // imu_frame_malformed (also where a value is not available), imu_epoch_incomplete.
  Counters counters() const override { return counters_; }
  Counters clock_figures() const override { return stamper_.Figures("imu"); }
  std::vector<CanFilter> filters() const override {
    return {N2kFilter(kPgnRateOfTurn), N2kFilter(kPgnAttitude)};
  }

 private:
  template <class T>
  struct Group {
    std::uint8_t source;
    std::uint8_t sequence;
    Time recv;
    T value;
  };
  template <class T>
  void Hold(const Group<T>& group, std::optional<Group<T>>* held);
  std::optional<ImuSample> Join();

  ImuN2kParams params_;
  Stamper stamper_;
  std::optional<Group<double>> rate_;               // of turn, rad/s
  std::optional<Group<Eigen::Vector3d>> attitude_;  // roll, pitch, yaw
  Time epoch_recv_;
  Counters counters_;
};

// The two groups of a measurement, which must have an attitude.
std::vector<CanFrame> EncodeImuN2k(const ImuSample& sample,
                                   std::uint8_t source,
                                   std::uint8_t sequence);

}  // namespace seastitch
