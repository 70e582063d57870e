#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/sensors.hpp"
#include "drivers/can/signal_map.hpp"
#include "drivers/can/unit_clock.hpp"
#include "drivers/imu/imu_codec.hpp"

// An inertial unit that spreads one epoch over several CAN frames: SBG Systems' ECAN, the Xsens
// MTi-600 series, or others with the same structure. The signal map names the frame and signal of
// each field.
namespace seastitch {

enum ImuField : std::size_t {
  kImuTimeUs,       // device clock, wraps at 2^32; its frame begins the inertial part of an epoch
  kAttitudeTimeUs,  // the same clock; its frame begins the attitude part
  kAngularRateX,    // about x forward, y starboard, z down [rad/s]
  kAngularRateY,
  kAngularRateZ,
  kSpecificForceX,  // same axes; z is -9.8 at rest [m/s^2]
  kSpecificForceY,
  kSpecificForceZ,
  kRoll,       // starboard down positive [rad]
  kPitch,      // bow up positive
  kYaw,        // clockwise from north
  kRollSigma,  // 1 sigma
  kPitchSigma,
  kYawSigma,
  kUtcTimeUs,  // from here on the fields of UnitClock
  kUtcTimeOfWeekMs,
  kUtcYear,
  kUtcMonth,
  kUtcDay,
  kUtcHour,
  kUtcMinute,
  kUtcSecond,
  kUtcMicrosecond,
  // number of the epoch, 16 bits; its frame opens the epoch as that of kImuTimeUs does
  kImuGroupCounter,
  kImuAligned,  // the unit has found north; in a frame of its own, at any rate
  kNumImuFields,
};

// The key of each field in the YAML file, in the order of ImuField.
extern const std::vector<std::string> kImuFieldKeys;

struct ImuCanParams {
  SignalMap signals;
  ClockParams clock;
  // Longest time between the first and the last frame of an epoch; a later frame is not used. More
  // than a burst of frames takes on the wire (1 ms at 1 Mbit/s), at most half the measurement
  // period.
  double max_epoch_s = 0.010;
  // Error of roll, pitch, yaw, 1 sigma, for a unit that sends no sigmas.
  Eigen::Vector3d attitude_sigma_rad = Eigen::Vector3d::Zero();

  // The first required signal that is missing, for people; empty if there is none.
  std::string Validate() const;
};

// Assembles epochs from frames. An epoch is one measurement: a frame that begins it, and the frames
// that follow. Two beginnings with the same time and group are one epoch. A missing or late frame
// loses its own epoch; frames of two epochs are never combined. An epoch without attitude frames is
// returned without attitude.
class ImuCanDecoder : public ImuCodec {
 public:
  explicit ImuCanDecoder(const ImuCanParams& params);

  // Adds a frame. Returns the epoch that it completes, or the previous epoch if it begins a new
  // one. Time: the device's, mapped to UTC through its last UTC frames or by a model of its clock,
  // or the receive stamp of its first frame. Epochs without are counted as imu_epoch_unstamped.
  std::optional<ImuSample> Add(const CanFrame& frame, Time recv) override;
  std::optional<ImuSample> Finish() override;
  Time epoch_recv() const override { return epoch_recv_; }

  // imu_frame_malformed, imu_frame_outside_epoch, imu_epoch_incomplete, imu_epoch_unstamped,
  // imu_epoch_without_attitude, imu_utc_malformed, imu_utc_stepped, imu_device_restarted,
  // imu_groups_lost (by the group counter).
  Counters counters() const override;
  Counters clock_figures() const override { return clock_.Figures("imu"); }
  std::vector<CanFilter> filters() const override { return params_.signals.Filters(); }

 private:
  enum class Part : std::uint8_t { kNone, kInertial, kAttitude };
  // Content of an opening frame.
  struct Opening {
    Part part = Part::kInertial;
    std::optional<std::uint32_t> device_us;
    std::optional<std::uint16_t> group;
  };
  struct Epoch {
    std::optional<std::uint32_t> device_us;
    std::optional<std::uint16_t> group;
    Time first_recv;
    Time last_recv;
    Part part = Part::kNone;  // kind of frames that may follow
    bool given = false;
    FieldValues values;
  };

  std::optional<ImuSample> Open(const Opening& opening, Time recv);
  bool IsOfOpenEpoch(const Opening& opening, Time recv) const;
  std::optional<ImuSample> Collect(const FieldValues& values, Time recv);
  std::optional<ImuSample> Close();
  bool IsComplete() const;
  bool HasInertial() const;
  std::optional<ImuSample> Give(bool with_attitude);
  std::optional<UnitClock::Reading> ReadingOfEpoch() const;
  HeadingAlignment AlignmentAt(Time recv) const;
  bool Belongs(const std::bitset<kMaxFields>& fields, Time recv) const;
  void SeeGroup(std::uint16_t group);

  ImuCanParams params_;
  std::bitset<kMaxFields> inertial_fields_;
  std::bitset<kMaxFields> attitude_fields_;  // empty if none is mapped
  std::optional<Epoch> epoch_;
  std::optional<std::uint16_t> last_group_;
  UnitClock clock_;
  Time epoch_recv_;
  HeadingAlignment alignment_ = HeadingAlignment::kUnknown;  // as last stated, at alignment_recv_
  Time alignment_recv_;
  Counters counters_;
};

// Samples to the frames that such a device would send.
class ImuCanEncoder {
 public:
  // device_zero: the instant at which the device's clock read 0.
  ImuCanEncoder(const SignalMap& signals, Time device_zero);
  // The frames of one epoch; first, and then once a second, the UTC frames before it.
  std::vector<CanFrame> Encode(const ImuSample& sample);

 private:
  std::vector<CanFrame> EncodeUtc(Time whole_second) const;
  double DeviceUs(Time t) const;

  SignalMap signals_;
  Time device_zero_;
  std::optional<std::int64_t> utc_sent_s_;
  std::uint16_t group_ = 0;
};

}  // namespace seastitch
