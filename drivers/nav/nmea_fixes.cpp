#include "drivers/nav/nmea_fixes.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {
namespace {

// Factor of sigma if the USBL system reports an error with a valid position.
constexpr double kDoubtfulTimes = 3.0;
// A fix older than the last one by more than this shows that the device's clock was set. A smaller
// step back is a late fix.
constexpr double kClockWasSetS = 60.0;

bool IsMeasured(FixQuality quality) {
  return quality >= FixQuality::kAutonomous && quality <= FixQuality::kRtkFloat;
}

}  // namespace

NmeaFixes::NmeaFixes(const NmeaFixParams& params)
    : NmeaCodec(params.needs_checksum, params.clock), params_(params) {}

bool NmeaFixes::Take(const NmeaSentence& s, Time recv) {
  if (s.type == "GGA") {
    TakeGga(s, recv);
  } else if (s.type == "PSIMSSB") {
    TakePsimssb(s, recv);
  } else if (s.type == "ZDA") {
    if (const auto device = DecodeZda(s)) SetDate(*device, recv);
  } else if (s.type == "RMC") {  // only the date: GGA also states the quality of the position
    const auto rmc = DecodeRmc(s);
    if (rmc && rmc->midnight && rmc->time_of_day) SetDate(*rmc->midnight + *rmc->time_of_day, recv);
    return false;
  } else {
    return false;
  }
  return true;
}

void NmeaFixes::TakeGga(const NmeaSentence& s, Time recv) {
  const auto gga = DecodeGga(s);
  if (!gga) return Count("sentence_incomplete");
  if (!gga->position) return Count("no_position");
  if (!IsMeasured(gga->quality)) return Count("not_measured");
  const double dilution = params_.source == "gps" ? std::max(1.0, gga->hdop.value_or(1.0)) : 1.0;
  Fix(*gga->position, params_.sigma_m * dilution, gga->time_of_day, recv);
}

void NmeaFixes::TakePsimssb(const NmeaSentence& s, Time recv) {
  const auto found = DecodePsimssb(s);
  if (!found) return Count("sentence_incomplete");
  if (!found->valid) return Count("no_position");
  if (!found->position) return Count("not_absolute");
  if (params_.transponder.empty()) params_.transponder = found->transponder;
  if (found->transponder != params_.transponder) return Count("other_transponder");
  // The system's own accuracy excludes errors of mounting and sound speed.
  const double sigma_m = std::max(params_.sigma_m, found->accuracy_m.value_or(0.0));
  Fix(*found->position,
      found->error.empty() ? sigma_m : kDoubtfulTimes * sigma_m,
      found->time_of_day,
      recv);
}

void NmeaFixes::Fix(const GeoPoint& point,
                    double sigma_m,
                    std::optional<Duration> time_of_day,
                    Time recv) {
  const auto time = Stamp(time_of_day, recv);
  if (!time) return;
  if (last_) {
    const double since_s = ToSeconds(*time - *last_);
    if (since_s > -kClockWasSetS && (since_s <= 0.0 || since_s < params_.interval_s))
      return Count("too_soon");
  }
  last_ = time;
  Emit(PositionFix{point, *time, sigma_m * sigma_m * Eigen::Matrix2d::Identity(), params_.source});
}

}  // namespace seastitch
