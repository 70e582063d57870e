#include <cmath>
#include <cstdio>

#include "products/write_products.hpp"

namespace seastitch {
namespace {

std::string Format(const char* format, double a, double b = 0.0) {
  char text[160];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

}  // namespace

std::string ProductOptions::Validate() const {
  if (!(cell_m >= 0.0) || !std::isfinite(cell_m)) {
    return Format("cell_m = %g, must be > 0, or 0 to choose it from the data", cell_m);
  }
  if (max_cells == 0) return "max_cells = 0, must be > 0";
  if (!(harm_tolerance >= 0.0)) return Format("harm_tolerance = %g, must be >= 0", harm_tolerance);
  if (datum && axes != MapAxes::kNorthEastDown) return "a datum needs a North-East-Down map frame";
  if (datum &&
      !(std::abs(datum->latitude_deg) <= 90.0 && std::abs(datum->longitude_deg) <= 180.0)) {
    return Format("datum = %g, %g, must be degrees of latitude and longitude",
                  datum->latitude_deg,
                  datum->longitude_deg);
  }
  return {};
}

const char* ToString(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCorrected: return "corrected";
    case Outcome::kNothingToCorrect: return "nothing_to_correct";
    case Outcome::kWithheld: return "withheld";
    case Outcome::kTrackAlone: return "track_alone";
  }
  return "unknown";
}

}  // namespace seastitch
