#include "drivers/nav/nmea_ins.hpp"

#include <cmath>
#include <utility>

#include "codecs/text.hpp"

namespace seastitch {
namespace {

constexpr double kSilentS = 2.0;
// Longest time between sentences of one epoch [s].
constexpr double kTogetherS = 1.0;
constexpr char kSource[] = "nmea";

bool IsRecent(Time then, Time now, double within_s) {
  return std::abs(ToSeconds(now - then)) <= within_s;
}

InsStatus StatusOf(FixQuality quality) {
  switch (quality) {
    case FixQuality::kNone: return InsStatus::kInvalid;
    case FixQuality::kEstimated: return InsStatus::kDeadReckoning;
    case FixQuality::kManual:
    case FixQuality::kSimulated: return InsStatus::kUnknown;
    default: return InsStatus::kAided;
  }
}

}  // namespace

NmeaIns::NmeaIns(const NmeaInsParams& params)
    : NmeaCodec(params.needs_checksum, params.clock), params_(params) {}

bool NmeaIns::Take(const NmeaSentence& s, Time recv) {
  const std::string_view type = s.type;
  if (type == "GGA") {
    TakeGga(s, recv);
  } else if (type == "RMC") {
    TakeRmc(s, recv);
  } else if (type == "VTG") {
    TakeVtg(s, recv);
  } else if (type == "HDT" || type == "THS") {
    TakeHeading(s, recv);
    // other sentences named PASHR begin with a letter
  } else if (type == "PASHR" && ParseNumber(s.Text(0))) {
    TakeAttitude(s, DecodePashr, recv);
  } else if (type == "PRDID") {
    TakeAttitude(s, DecodePrdid, recv);
  } else if (type == "PSXN" && s.Text(0) == "23") {
    TakeAttitude(s, DecodePsxn23, recv);
  } else if (type == "PSXN" && s.Text(0) == "20") {
    TakeQuality(s);
  } else if (type == "ZDA") {
    if (const auto device = DecodeZda(s)) SetDate(*device, recv);
  } else {
    return false;
  }
  return true;
}

void NmeaIns::TakeGga(const NmeaSentence& s, Time recv) {
  const auto gga = DecodeGga(s);
  if (!gga) return Count("sentence_incomplete");
  last_gga_ = recv;
  if (!gga->position) Count("no_position");
  NavigationSample sample;
  sample.status = StatusOf(gga->quality);
  if (gga->position) sample.position = GeoPosition{*gga->position};
  if (gga->height_m) sample.height = InsVertical{*gga->height_m};
  sample.velocity = VelocityAt(recv);
  Finish(std::move(sample), gga->time_of_day, recv);
}

void NmeaIns::TakeRmc(const NmeaSentence& s, Time recv) {
  const auto rmc = DecodeRmc(s);
  if (!rmc) return Count("sentence_incomplete");
  if (rmc->midnight && rmc->time_of_day) SetDate(*rmc->midnight + *rmc->time_of_day, recv);
  SetVelocity(*rmc, recv);
  if (last_gga_ && IsRecent(*last_gga_, recv, kSilentS)) return;  // GGA has the position, too
  if (!rmc->position) Count("no_position");
  NavigationSample sample;
  sample.status = rmc->position ? InsStatus::kAided : InsStatus::kInvalid;
  if (rmc->position) sample.position = GeoPosition{*rmc->position};
  sample.velocity = VelocityAt(recv);
  Finish(std::move(sample), rmc->time_of_day, recv);
}

void NmeaIns::TakeVtg(const NmeaSentence& s, Time recv) {
  const auto vtg = DecodeVtg(s);
  if (!vtg) return Count("sentence_incomplete");
  SetVelocity(*vtg, recv);
}

// Stores the velocity. Without speed, a missing course is accepted.
void NmeaIns::SetVelocity(const NmeaCourse& course, Time recv) {
  if (!course.speed_mps || (!course.course_rad && *course.speed_mps > 0.0)) return;
  const double course_rad = course.course_rad.value_or(0.0);
  GeoVelocity velocity;
  velocity.v_ned_mps =
      *course.speed_mps * Eigen::Vector3d(std::cos(course_rad), std::sin(course_rad), 0.0);
  velocity_ = {velocity, recv};
}

std::optional<GeoVelocity> NmeaIns::VelocityAt(Time recv) const {
  if (!velocity_ || !IsRecent(velocity_->recv, recv, kTogetherS)) return std::nullopt;
  return velocity_->value;
}

void NmeaIns::TakeHeading(const NmeaSentence& s, Time recv) {
  const auto heading_rad = DecodeHeading(s);
  if (!heading_rad) return Count("sentence_incomplete");
  heading_rad_ = {*heading_rad, recv};
  if (!attitude_type_ || !IsRecent(attitude_type_->recv, recv, kSilentS))
    Count("heading_without_tilt");
}

void NmeaIns::TakeQuality(const NmeaSentence& s) {
  const auto quality = DecodePsxn20(s);
  if (!quality) return Count("sentence_incomplete");
  constexpr int kInvalid = 2;
  called_invalid_ = quality->heading == kInvalid || quality->roll_pitch == kInvalid;
}

void NmeaIns::TakeAttitude(const NmeaSentence& s, Attitude183 decode, Time recv) {
  auto tilt = decode(s);
  if (!tilt) return Count("sentence_incomplete");
  if (attitude_type_ && attitude_type_->value != s.type &&
      IsRecent(attitude_type_->recv, recv, kSilentS))
    return Count("attitude_not_used");
  attitude_type_ = {std::string(s.type), recv};
  if (!tilt->heading_rad && heading_rad_ && IsRecent(heading_rad_->recv, recv, kTogetherS))
    tilt->heading_rad = heading_rad_->value;
  if (!tilt->heading_rad) return Count("attitude_without_heading");
  NavigationSample sample;
  if (called_invalid_) sample.status = InsStatus::kInvalid;
  sample.attitude = AttitudeFromRadians(params_.invert_roll ? -tilt->roll_rad : tilt->roll_rad,
                                        params_.invert_pitch ? -tilt->pitch_rad : tilt->pitch_rad,
                                        *tilt->heading_rad);
  sample.attitude->sigma_rpy_rad = tilt->sigma_rpy_rad;
  Finish(std::move(sample), tilt->time_of_day, recv);
}

void NmeaIns::Finish(NavigationSample sample, std::optional<Duration> time_of_day, Time recv) {
  const auto time = Stamp(time_of_day, recv);
  if (!time) return;
  sample.time = *time;
  sample.source = kSource;
  Emit(std::move(sample));
}

}  // namespace seastitch
