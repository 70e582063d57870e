#include "codecs/navigation/sbet_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kNumbers = 17;

}  // namespace

std::string SbetParams::Validate() const {
  if (wander_sign < -1 || wander_sign > 1) return "wander_sign must be -1, 0 or 1";
  if (!(leap_seconds >= 0.0 && leap_seconds < 100.0)) return "leap_seconds must be 0 to 100";
  return "";
}

SbetFileReader::SbetFileReader(const SbetParams& params) : params_(params) {
  if (const std::string problem = params.Validate(); !problem.empty())
    throw std::invalid_argument(problem);
}

SurveyReader::Look SbetFileReader::LookAt(Bytes /*bytes*/, bool /*at_end*/) const {
  return Record(kNumbers * sizeof(double));
}

void SbetFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  ByteReader in(record);
  std::array<double, kNumbers> v{};
  for (double& number : v) number = in.Le<double>();
  const bool usable = std::all_of(v.begin(), v.end(), [](double n) { return std::abs(n) < 1e9; }) &&
                      v[0] >= 0.0 && v[0] <= 2.0 * kGpsWeekS && std::abs(v[1]) <= kPi / 2.0 &&
                      std::abs(v[2]) <= 2.0 * kPi;
  if (!usable) return Count("sbet_malformed");
  last_s_ = WeekSecondsNear(v[0], last_s_.value_or(v[0]));

  NavigationRecord sample;
  sample.source = "sbet";
  sample.time = params_.week_start + FromSeconds(*last_s_ - params_.leap_seconds);
  sample.position = GeoPosition{v[1], WrapAngle(v[2])};
  sample.height_m = v[3];
  const double wander_rad = params_.wander_sign * v[10];
  sample.attitude = AttitudeFromRadians(v[7], v[8], v[9] + wander_rad);
  const double c = std::cos(wander_rad);
  const double s = std::sin(wander_rad);
  sample.velocity =
      GeoVelocity{{c * v[4] - s * v[5], s * v[4] + c * v[5], params_.velocity_up ? -v[6] : v[6]}};
  out->emplace_back(std::move(sample));
}

}  // namespace seastitch
