#include "drivers/nav/ecan_ins.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "codecs/text.hpp"
#include "common/core/pose.hpp"
#include "drivers/socket/cannelloni.hpp"

namespace seastitch {
namespace {

// Time from EKF_INFO to the last frame of its epoch: 2 ms at 500 kbit/s, more if other frames have
// priority. The decoder limits it to half the period.
constexpr double kMaxEpochS = 0.010;
constexpr Duration kSolutionHolds = std::chrono::seconds(5);  // for units that send it at 1 Hz

enum EcanField : std::size_t {
  kTimeUs,
  kRoll,
  kPitch,
  kYaw,
  kRollSigma,
  kPitchSigma,
  kYawSigma,
  kLatitude,
  kLongitude,
  kNorthSigma,
  kEastSigma,
  kAltitudeSigma,
  kAltitude,    // above the geoid
  kUndulation,  // of the geoid, above the ellipsoid
  kVelocityNorth,
  kVelocityEast,
  kVelocityDown,
  kVelocityNorthSigma,
  kVelocityEastSigma,
  kVelocityDownSigma,
  kSolution,
  kUtc,  // from here on the fields of UnitClock
};

// Names in the DBC file, in the order of EcanField.
constexpr const char* kSignals[] = {"EKF_INFO.TIME_STAMP",
                                    "EKF_EULER.ROLL",
                                    "EKF_EULER.PITCH",
                                    "EKF_EULER.YAW",
                                    "EKF_ORIENTATION_ACC.ROLL_ACC",
                                    "EKF_ORIENTATION_ACC.PITCH_ACC",
                                    "EKF_ORIENTATION_ACC.YAW_ACC",
                                    "EKF_POS.LATITUDE",
                                    "EKF_POS.LONGITUDE",
                                    "EKF_POS_ACC.LATITUDE_ACC",
                                    "EKF_POS_ACC.LONGITUDE_ACC",
                                    "EKF_POS_ACC.ALTITUDE_ACC",
                                    "EKF_ALTITUDE.ALTITUDE",
                                    "EKF_ALTITUDE.UNDULATION",
                                    "EKF_VEL_NED.VELOCITY_N",
                                    "EKF_VEL_NED.VELOCITY_E",
                                    "EKF_VEL_NED.VELOCITY_D",
                                    "EKF_VEL_NED_ACC.VELOCITY_ACC_N",
                                    "EKF_VEL_NED_ACC.VELOCITY_ACC_E",
                                    "EKF_VEL_NED_ACC.VELOCITY_ACC_D",
                                    "STATUS_03.SOLUTION",
                                    "UTC_0.TIME_STAMP",
                                    "UTC_0.GPS_TOW",
                                    "UTC_1.YEAR",
                                    "UTC_1.MONTH",
                                    "UTC_1.DAY",
                                    "UTC_1.HOUR",
                                    "UTC_1.MIN",
                                    "UTC_1.SEC",
                                    "UTC_1.MICRO_SEC"};
static_assert(std::size(kSignals) == std::size_t{kUtc} + UnitClock::kNumFields);
static_assert(std::size(kSignals) <= kMaxFields);

// SOLUTION: the mode is in its four lowest bits; the other bits that are read follow below.
enum Mode : std::uint32_t { kUninitialised, kVerticalGyro, kAttitudeOnly, kVelocity, kPosition };
constexpr std::uint32_t kModeBits = 0xF;
constexpr std::uint32_t kPlaceFromOutside = 1u << 11 | 1u << 15 | 1u << 22 | 1u << 24;
constexpr std::uint32_t kAligned = 1u << 27;

InsStatus StatusOf(std::uint32_t solution) {
  const std::uint32_t mode = solution & kModeBits;
  if (mode > kPosition) return InsStatus::kUnknown;
  if (mode <= kVerticalGyro) return InsStatus::kInvalid;  // the heading drifts, too
  if ((solution & kAligned) == 0) return InsStatus::kAligning;
  return (solution & kPlaceFromOutside) != 0 ? InsStatus::kAided : InsStatus::kDeadReckoning;
}

// True if the INS's filter estimates neither velocity nor position: both drift.
bool Drifts(std::uint32_t solution) { return (solution & kModeBits) <= kAttitudeOnly; }

bool IsOnEarth(const FieldValues& v) {
  return std::abs(v.value[kLatitude]) <= 90.0 && std::abs(v.value[kLongitude]) <= 180.0;
}

}  // namespace

SignalMap EcanSignals(const Dbc& dbc) {
  SignalMap map;
  for (std::size_t field = 0; field < std::size(kSignals); ++field)
    map.Assign(dbc, field, kSignals[field]);
  return map;
}

EcanIns::EcanIns(const EcanInsParams& params)
    : params_(params),
      clock_(params.signals, kUtc, params.clock, kMaxEpochS),
      max_epoch_s_(kMaxEpochS) {}

std::string EcanIns::unused_messages() const {
  return hears_others_ ? "ECAN frames without EKF_INFO" : "";
}

Counters EcanIns::counters() const {
  Counters all = NavCodec::counters();
  const Counters& of_clock = clock_.counters();
  all.insert(of_clock.begin(), of_clock.end());
  return all;
}

void EcanIns::Read(Bytes bytes, Time recv) {
  const std::optional<CannelloniPacket> packet = DecodeCannelloni(bytes);
  if (!packet) return Count("cannelloni_malformed");
  for (const CanFrame& frame : packet->frames) Take(frame, recv);
}

void EcanIns::Take(const CanFrame& frame, Time recv) {
  const std::optional<SignalMap::Reading> reading = params_.signals.Read(frame);
  if (!reading) return;
  const FieldValues& values = reading->values;
  if (!reading->complete || (values.present.test(kLatitude) && !IsOnEarth(values))) {
    Count("frame_malformed");
  } else if (values.present.test(kTimeUs)) {
    Open({CountOf(values.value[kTimeUs]), recv});
  } else {
    hears_others_ = true;
    if (values.present.test(kSolution))
      solution_ = {CountOf(values.value[kSolution]), recv};
    else if (clock_.Uses(values))
      clock_.Add(values, recv, std::nullopt);
    else
      Collect(values, recv);
  }
}

void EcanIns::Open(const UnitClock::Reading& info) {
  Close();
  clock_.AddCount(info.device_us);
  if (epoch_) {
    const double period_s = 1e-6 * (info.device_us - epoch_->info.device_us);
    if (period_s > 0.0) max_epoch_s_ = std::min(max_epoch_s_, 0.5 * period_s);
  }
  epoch_ = Epoch{info, {}, false};
  CountMessage();
}

void EcanIns::Collect(const FieldValues& values, Time recv) {
  const bool belongs = epoch_ && !epoch_->given &&
                       std::abs(ToSeconds(recv - epoch_->info.recv)) <= max_epoch_s_ &&
                       (values.present & epoch_->values.present).none();
  if (!belongs) {
    Count("frame_outside_epoch");
    seen_ |= values.present;
    Close();  // EKF_INFO was lost: the following frames belong to another epoch, too
    epoch_.reset();
    return;
  }
  for (std::size_t field = 0; field < kMaxFields; ++field)
    if (values.present.test(field)) epoch_->values.Set(field, values.value[field]);
  if (epoch_->values.present == seen_) Finish();
}

void EcanIns::Close() {
  if (!epoch_ || epoch_->given) return;
  seen_ |= epoch_->values.present;
  if (epoch_->values.present.any())
    Finish();
  else
    Count("epoch_empty");
}

void EcanIns::Finish() {
  epoch_->given = true;
  const std::optional<Time> time = clock_.Stamp(epoch_->info);
  if (!time) return Count("unstamped");
  NavigationSample sample = SampleOf(epoch_->values);
  sample.time = *time;
  sample.source = "sbg_ecan";
  if (solution_ && epoch_->info.recv - solution_->recv <= kSolutionHolds) {
    sample.status = StatusOf(solution_->word);
    if (Drifts(solution_->word)) {
      Count("not_computed");
      sample.position.reset();
      sample.depth.reset();
      sample.height.reset();
      sample.velocity.reset();
    }
  }
  Emit(std::move(sample));
}

NavigationSample EcanIns::SampleOf(const FieldValues& v) const {
  NavigationSample sample;
  if (v.present.test(kRoll)) {
    sample.attitude = AttitudeFromRadians(v.value[kRoll], v.value[kPitch], v.value[kYaw]);
    sample.attitude->sigma_rpy_rad = {
        Sigma(v, kRollSigma), Sigma(v, kPitchSigma), Sigma(v, kYawSigma)};
  }
  if (v.present.test(kLatitude))
    sample.position = GeoPosition{Deg2Rad(v.value[kLatitude]),
                                  Deg2Rad(v.value[kLongitude]),
                                  {Sigma(v, kNorthSigma), Sigma(v, kEastSigma)}};
  if (v.present.test(kAltitude)) {
    const double sigma_m = Sigma(v, kAltitudeSigma);
    if (params_.altitude_is_depth)
      sample.depth = InsVertical{-v.value[kAltitude], sigma_m};
    else
      sample.height = InsVertical{v.value[kAltitude] + v.value[kUndulation], sigma_m};
  }
  if (v.present.test(kVelocityNorth))
    sample.velocity =
        GeoVelocity{{v.value[kVelocityNorth], v.value[kVelocityEast], v.value[kVelocityDown]},
                    {Sigma(v, kVelocityNorthSigma),
                     Sigma(v, kVelocityEastSigma),
                     Sigma(v, kVelocityDownSigma)}};
  return sample;
}

// A sigma of 0 means "below the signal's resolution": half the resolution is used. 0 if the frame
// with the sigma was not received: not stated.
double EcanIns::Sigma(const FieldValues& v, std::size_t field) const {
  if (!v.present.test(field)) return 0.0;
  return std::max(v.value[field], 0.5 * params_.signals.Resolution(field));
}

}  // namespace seastitch
