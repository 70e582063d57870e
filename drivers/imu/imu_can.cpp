#include "drivers/imu/imu_can.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr Duration kAlignmentHolds = std::chrono::seconds(5);  // for units that send it at 1 Hz
constexpr Duration kGpsMinusUtc = std::chrono::seconds(18);    // since 2017

std::bitset<kMaxFields> Mapped(const SignalMap& signals, std::size_t first, std::size_t last) {
  std::bitset<kMaxFields> fields;
  for (std::size_t field = first; field <= last; ++field) fields.set(field, signals.Has(field));
  return fields;
}

void SetCalendar(Time time, FieldValues* v) {
  const std::chrono::sys_time<Duration> instant(time.time_since_epoch());
  const auto day = std::chrono::floor<std::chrono::days>(instant);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(instant - day);
  v->Set(kUtcYear, static_cast<int>(date.year()));
  v->Set(kUtcMonth, static_cast<unsigned>(date.month()));
  v->Set(kUtcDay, static_cast<unsigned>(date.day()));
  v->Set(kUtcHour, static_cast<double>(clock.hours().count()));
  v->Set(kUtcMinute, static_cast<double>(clock.minutes().count()));
  v->Set(kUtcSecond, static_cast<double>(clock.seconds().count()));
  v->Set(kUtcMicrosecond, static_cast<double>(clock.subseconds().count()));
}

Eigen::Vector3d Vector(const FieldValues& v, std::size_t first) {
  return {v.value[first], v.value[first + 1], v.value[first + 2]};
}

}  // namespace

const std::vector<std::string> kImuFieldKeys = {"imu_time_us",
                                                "attitude_time_us",
                                                "angular_rate_x_radps",
                                                "angular_rate_y_radps",
                                                "angular_rate_z_radps",
                                                "specific_force_x_mps2",
                                                "specific_force_y_mps2",
                                                "specific_force_z_mps2",
                                                "roll_rad",
                                                "pitch_rad",
                                                "yaw_rad",
                                                "roll_sigma_rad",
                                                "pitch_sigma_rad",
                                                "yaw_sigma_rad",
                                                "utc_time_us",
                                                "utc_time_of_week_ms",
                                                "utc_year",
                                                "utc_month",
                                                "utc_day",
                                                "utc_hour",
                                                "utc_minute",
                                                "utc_second",
                                                "utc_microsecond",
                                                "group_counter",
                                                "aligned"};

std::string ImuCanParams::Validate() const {
  const auto missing = [this](std::size_t first, std::size_t last) -> std::string {
    for (std::size_t field = first; field <= last; ++field)
      if (!signals.Has(field)) return "signals." + kImuFieldKeys[field] + ": missing";
    return "";
  };
  if (!signals.Has(kImuTimeUs)) return missing(kImuTimeUs, kImuTimeUs);
  if (const std::string problem = missing(kAngularRateX, kSpecificForceZ); !problem.empty())
    return problem;
  if (Mapped(signals, kRoll, kYawSigma).any()) {
    const bool sigmas = Mapped(signals, kRollSigma, kYawSigma).any();
    if (const std::string problem = missing(kRoll, sigmas ? kYawSigma : kYaw); !problem.empty())
      return problem;
    const bool stated = attitude_sigma_rad.minCoeff() > 0.0;
    if (!sigmas && !stated) return "attitude_sigma_deg: the unit gives none; each must be above 0";
  }
  if (clock.clock == DeviceClock::kDevice)
    if (const std::string problem = missing(kUtcYear, kUtcMicrosecond); !problem.empty())
      return problem;
  return "";
}

ImuCanDecoder::ImuCanDecoder(const ImuCanParams& params)
    : params_(params),
      inertial_fields_(Mapped(params.signals, kAngularRateX, kSpecificForceZ)),
      attitude_fields_(Mapped(params.signals, kRoll, kYawSigma)),
      clock_(params.signals, kUtcTimeUs, params.clock, params.max_epoch_s) {}

std::optional<ImuSample> ImuCanDecoder::Add(const CanFrame& frame, Time recv) {
  const std::optional<SignalMap::Reading> reading = params_.signals.Read(frame);
  if (!reading) return std::nullopt;
  if (!reading->complete) {
    ++counters_["imu_frame_malformed"];
    return std::nullopt;
  }
  const FieldValues& values = reading->values;
  std::optional<ImuSample> before;
  if (values.present.test(kImuTimeUs))
    before = Open({Part::kInertial, CountOf(values.value[kImuTimeUs]), std::nullopt}, recv);
  if (values.present.test(kAttitudeTimeUs))
    before = Open({Part::kAttitude, CountOf(values.value[kAttitudeTimeUs]), std::nullopt}, recv);
  if (values.present.test(kImuGroupCounter)) {
    const auto group = static_cast<std::uint16_t>(values.value[kImuGroupCounter]);
    before = Open({Part::kInertial, std::nullopt, group}, recv);
  }
  if (clock_.Uses(values)) clock_.Add(values, recv, ReadingOfEpoch());
  if (values.present.test(kImuAligned)) {
    alignment_ =
        values.value[kImuAligned] != 0.0 ? HeadingAlignment::kAligned : HeadingAlignment::kAligning;
    alignment_recv_ = recv;
  }
  const std::optional<ImuSample> now = Collect(values, recv);
  return now ? now : before;
}

std::optional<ImuSample> ImuCanDecoder::Finish() { return Close(); }

std::optional<ImuSample> ImuCanDecoder::Open(const Opening& opening, Time recv) {
  if (opening.device_us) clock_.AddCount(*opening.device_us);
  if (opening.group) SeeGroup(*opening.group);
  std::optional<ImuSample> before;
  if (!IsOfOpenEpoch(opening, recv)) {
    before = Close();
    epoch_ = Epoch{};
    epoch_->first_recv = epoch_->last_recv = recv;
  }
  epoch_->part = opening.part;
  if (opening.device_us) epoch_->device_us = opening.device_us;
  if (opening.group) epoch_->group = opening.group;
  // An epoch may have two opening frames, and the second may be its last frame.
  return IsComplete() ? Give(attitude_fields_.any()) : before;
}

bool ImuCanDecoder::IsOfOpenEpoch(const Opening& opening, Time recv) const {
  if (!epoch_) return false;
  // An opening frame of the other kind belongs to the epoch only if it comes in time.
  const bool adds = (opening.device_us && !epoch_->device_us) || (opening.group && !epoch_->group);
  if (adds)
    return !epoch_->given && std::abs(ToSeconds(recv - epoch_->first_recv)) <= params_.max_epoch_s;
  return (!opening.device_us || opening.device_us == epoch_->device_us) &&
         (!opening.group || opening.group == epoch_->group);
}

bool ImuCanDecoder::HasInertial() const {
  return epoch_->device_us && (epoch_->group || !params_.signals.Has(kImuGroupCounter)) &&
         (epoch_->values.present & inertial_fields_) == inertial_fields_;
}

bool ImuCanDecoder::IsComplete() const {
  return !epoch_->given && HasInertial() &&
         epoch_->values.present == (inertial_fields_ | attitude_fields_);
}

bool ImuCanDecoder::Belongs(const std::bitset<kMaxFields>& fields, Time recv) const {
  if (!epoch_ || epoch_->given) return false;
  const Part attitude_part =
      params_.signals.Has(kAttitudeTimeUs) ? Part::kAttitude : Part::kInertial;
  if ((fields & inertial_fields_).any() && epoch_->part != Part::kInertial) return false;
  if ((fields & attitude_fields_).any() && epoch_->part != attitude_part) return false;
  const bool in_time = std::abs(ToSeconds(recv - epoch_->first_recv)) <= params_.max_epoch_s;
  return in_time && (fields & epoch_->values.present).none();
}

std::optional<ImuSample> ImuCanDecoder::Collect(const FieldValues& values, Time recv) {
  const std::bitset<kMaxFields> fields = values.present & (inertial_fields_ | attitude_fields_);
  if (fields.none()) return std::nullopt;
  if (!Belongs(fields, recv)) {
    ++counters_["imu_frame_outside_epoch"];
    // An opening frame was lost: the following frames do not belong to this epoch either.
    if (epoch_) epoch_->part = Part::kNone;
    return std::nullopt;
  }
  for (std::size_t field = 0; field < kMaxFields; ++field)
    if (fields.test(field)) epoch_->values.Set(field, values.value[field]);
  epoch_->last_recv = recv;
  return IsComplete() ? Give(attitude_fields_.any()) : std::nullopt;
}

std::optional<ImuSample> ImuCanDecoder::Close() {
  if (!epoch_ || epoch_->given) return std::nullopt;
  if (!HasInertial()) {
    ++counters_["imu_epoch_incomplete"];
    epoch_->given = true;
    return std::nullopt;
  }
  ++counters_["imu_epoch_without_attitude"];
  return Give(false);
}

std::optional<ImuSample> ImuCanDecoder::Give(bool with_attitude) {
  epoch_->given = true;
  const std::optional<Time> time = clock_.Stamp(*ReadingOfEpoch());
  if (!time) {
    ++counters_["imu_epoch_unstamped"];
    return std::nullopt;
  }
  const FieldValues& v = epoch_->values;
  ImuSample sample;
  sample.time = *time;
  sample.angular_rate_radps = Vector(v, kAngularRateX);
  sample.specific_force_mps2 = Vector(v, kSpecificForceX);
  if (with_attitude) {
    Attitude& attitude = sample.attitude.emplace();
    attitude.q_ned_imu = RotationFromRpy(v.value[kRoll], v.value[kPitch], v.value[kYaw]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      // A sigma of 0 means "below the signal's resolution": half the resolution is used.
      const double least = 0.5 * params_.signals.Resolution(kRollSigma + axis);
      attitude.sigma_rpy_rad[i] = params_.signals.Has(kRollSigma + axis)
                                      ? std::max(v.value[kRollSigma + axis], least)
                                      : params_.attitude_sigma_rad[i];
    }
  }
  epoch_recv_ = epoch_->last_recv;
  sample.alignment = AlignmentAt(epoch_recv_);
  return sample;
}

HeadingAlignment ImuCanDecoder::AlignmentAt(Time recv) const {
  return recv - alignment_recv_ <= kAlignmentHolds ? alignment_ : HeadingAlignment::kUnknown;
}

std::optional<UnitClock::Reading> ImuCanDecoder::ReadingOfEpoch() const {
  if (!epoch_ || !epoch_->device_us) return std::nullopt;
  return UnitClock::Reading{*epoch_->device_us, epoch_->first_recv};
}

Counters ImuCanDecoder::counters() const {
  Counters all = counters_;
  for (const auto& [name, value] : clock_.counters()) all["imu_" + name] = value;
  return all;
}

void ImuCanDecoder::SeeGroup(std::uint16_t group) {
  const auto step = static_cast<std::uint16_t>(group - last_group_.value_or(group));
  last_group_ = group;
  // A larger step means that the unit was restarted.
  if (step > 1 && step < 10'000) counters_["imu_groups_lost"] += step - 1;
}

ImuCanEncoder::ImuCanEncoder(const SignalMap& signals, Time device_zero)
    : signals_(signals), device_zero_(device_zero) {}

std::vector<CanFrame> ImuCanEncoder::Encode(const ImuSample& sample) {
  std::vector<CanFrame> frames;
  const auto second =
      std::chrono::floor<std::chrono::seconds>(sample.time.time_since_epoch()).count();
  if (signals_.Has(kUtcTimeUs) && utc_sent_s_ != second) {
    frames = EncodeUtc(FromUtime(second * 1'000'000));
    utc_sent_s_ = second;
  }
  FieldValues v;
  v.Set(kImuTimeUs, DeviceUs(sample.time));
  v.Set(kImuGroupCounter, group_++);
  if (!signals_.Has(kUtcTimeUs)) SetCalendar(sample.time, &v);
  if (sample.alignment != HeadingAlignment::kUnknown)
    v.Set(kImuAligned, sample.alignment == HeadingAlignment::kAligned ? 1.0 : 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    v.Set(kAngularRateX + axis, sample.angular_rate_radps[i]);
    v.Set(kSpecificForceX + axis, sample.specific_force_mps2[i]);
  }
  if (sample.attitude) {
    v.Set(kAttitudeTimeUs, DeviceUs(sample.time));
    const Eigen::Vector3d rpy = RpyFromRotation(sample.attitude->q_ned_imu.toRotationMatrix());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      v.Set(kRoll + axis, rpy[i]);
      v.Set(kRollSigma + axis, sample.attitude->sigma_rpy_rad[i]);
    }
  }
  const std::vector<CanFrame> epoch = signals_.Write(v);
  frames.insert(frames.end(), epoch.begin(), epoch.end());
  return frames;
}

std::vector<CanFrame> ImuCanEncoder::EncodeUtc(Time whole_second) const {
  const double week_s = std::fmod(ToSeconds(whole_second - kGpsEpoch + kGpsMinusUtc), kGpsWeekS);
  FieldValues v;
  v.Set(kUtcTimeUs, DeviceUs(whole_second));
  v.Set(kUtcTimeOfWeekMs, 1000.0 * std::floor(week_s));
  SetCalendar(whole_second, &v);
  return signals_.Write(v);
}

double ImuCanEncoder::DeviceUs(Time t) const {
  return static_cast<double>(static_cast<std::uint32_t>((t - device_zero_).count()));
}

}  // namespace seastitch
