#include "drivers/imu/imu_nmea2000.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kAngleStep_rad = 1e-4;
constexpr double kRateStep_radps = 3.125e-8;
constexpr double kGravity_mps2 = 9.80665;

std::optional<Eigen::Vector3d> ReadAttitude(ByteReader* in) {
  const std::optional<double> yaw = ReadN2kField<std::int16_t>(in, kAngleStep_rad);
  const std::optional<double> pitch = ReadN2kField<std::int16_t>(in, kAngleStep_rad);
  const std::optional<double> roll = ReadN2kField<std::int16_t>(in, kAngleStep_rad);
  if (!in->ok() || !yaw || !pitch || !roll) return std::nullopt;
  return Eigen::Vector3d(*roll, *pitch, *yaw);
}

}  // namespace

std::optional<ImuSample> ImuN2kDecoder::Add(const CanFrame& frame, Time recv) {
  if (!frame.extended || frame.error || frame.remote) return std::nullopt;
  const N2kMessage id = ReadN2kId(frame.id);
  if (params_.source >= 0 && id.source != params_.source) return std::nullopt;
  if (id.pgn != kPgnRateOfTurn && id.pgn != kPgnAttitude) return std::nullopt;
  ByteReader in(frame.data());
  const auto sequence = in.Le<std::uint8_t>();
  if (id.pgn == kPgnRateOfTurn) {
    const std::optional<double> rate = ReadN2kField<std::int32_t>(&in, kRateStep_radps);
    if (in.ok() && rate) {
      Hold({id.source, sequence, recv, *rate}, &rate_);
      return Join();
    }
  } else if (const std::optional<Eigen::Vector3d> rpy = ReadAttitude(&in)) {
    Hold({id.source, sequence, recv, *rpy}, &attitude_);
    return Join();
  }
  ++counters_["imu_frame_malformed"];
  return std::nullopt;
}

template <class T>
void ImuN2kDecoder::Hold(const Group<T>& group, std::optional<Group<T>>* held) {
  if (*held) ++counters_["imu_epoch_incomplete"];
  *held = group;
}

std::optional<ImuSample> ImuN2kDecoder::Join() {
  const bool same =
      rate_ && attitude_ && rate_->source == attitude_->source &&
      rate_->sequence == attitude_->sequence &&
      std::chrono::abs(rate_->recv - attitude_->recv) <= FromSeconds(params_.max_epoch_s);
  if (!same) return std::nullopt;
  const Eigen::Vector3d rpy = attitude_->value;
  const Eigen::Quaterniond q(RotationFromRpy(rpy[0], rpy[1], rpy[2]));
  ImuSample sample;
  sample.time = *stamper_.Stamp(Time(), std::min(rate_->recv, attitude_->recv));
  sample.angular_rate_radps = q.inverse() * Eigen::Vector3d(0.0, 0.0, rate_->value);
  sample.specific_force_mps2 = q.inverse() * Eigen::Vector3d(0.0, 0.0, -kGravity_mps2);
  sample.attitude = Attitude{q, params_.sigma_rpy_rad};
  epoch_recv_ = std::max(rate_->recv, attitude_->recv);
  rate_.reset();
  attitude_.reset();
  return sample;
}

std::vector<CanFrame> EncodeImuN2k(const ImuSample& sample,
                                   std::uint8_t source,
                                   std::uint8_t sequence) {
  const Eigen::Quaterniond& q = sample.attitude.value().q_ned_imu;
  const Eigen::Vector3d rpy = RpyFromRotation(q.toRotationMatrix());
  ByteWriter rate;
  rate.Le(sequence);
  WriteN2kField<std::int32_t>((q * sample.angular_rate_radps).z(), kRateStep_radps, &rate);
  ByteWriter attitude;
  attitude.Le(sequence);
  for (const Eigen::Index axis : {2, 1, 0})
    WriteN2kField<std::int16_t>(rpy[axis], kAngleStep_rad, &attitude);
  std::vector<CanFrame> frames = EncodeN2k({kPgnRateOfTurn, source, 2, rate.Release()}, false);
  frames.push_back(EncodeN2k({kPgnAttitude, source, 3, attitude.Release()}, false)[0]);
  return frames;
}

}  // namespace seastitch
