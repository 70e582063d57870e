#include "mapper/navigation/navigation_params.hpp"

#include <cmath>
#include <cstdio>

#include "common/core/geo_point.hpp"

namespace seastitch {
namespace {

constexpr double kQuarterMeridianKm = 1e4;

}  // namespace

double DeclinationAt(const NavigationParams& p, Time t) {
  constexpr double kYearS = 365.2425 * 86'400.0;
  const double year = 1970.0 + ToSeconds(t.time_since_epoch()) / kYearS;
  return p.declination_rad + p.declination_rad_per_year * (year - p.declination_year);
}

double ConvergenceLimitM(const NavigationParams& p, double datum_latitude_rad) {
  return p.attitude_heading_rad.sigma * kMeanEarthRadiusM / std::abs(std::tan(datum_latitude_rad));
}

std::string NorthSentence(const NavigationParams& p, double datum_latitude_rad) {
  const double limit_km = 1e-3 * ConvergenceLimitM(p, datum_latitude_rad);
  const double transport_degph = Rad2Deg(p.max_speed_mps / kMeanEarthRadiusM) * 3600.0;
  char text[240];
  if (limit_km < kQuarterMeridianKm)
    std::snprintf(
        text,
        sizeof text,
        "north is the datum's: beyond %.3g km east or west of it the meridians are turned "
        "by more than the heading sensor's sigma; the transport rate left out is at most "
        "%.2f deg/h",
        limit_km,
        transport_degph);
  else
    std::snprintf(text,
                  sizeof text,
                  "north is the datum's: so near the equator the meridians turn by less than the "
                  "heading sensor's sigma; the transport rate left out is at most %.2f deg/h",
                  transport_degph);
  return text;
}

}  // namespace seastitch
