#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/core/geo_point.hpp"

namespace seastitch {

// Height of the zero of depth (chart datum, or a geoid) above the WGS 84 ellipsoid [m]: a grid over
// longitude and latitude, with bilinear interpolation.
class DatumHeight {
 public:
  DatumHeight() = default;
  // ESRI ASCII grid in degrees: ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter,
  // cellsize, NODATA_value or not, then rows from north to south. Throws std::runtime_error
  // "NAME: what is wrong".
  static DatumHeight Parse(const std::string& text, const std::string& name);

  bool empty() const { return metres_.empty(); }
  // Nothing outside the grid, or next to a point without data.
  std::optional<double> At(const GeoPoint& point) const;
  const std::string& text() const { return text_; }

 private:
  std::size_t columns_ = 0, rows_ = 0;
  double west_deg_ = 0.0, north_deg_ = 0.0;  // of the first point
  double cell_deg_ = 0.0;
  std::vector<double> metres_;  // by rows from the north; NaN: no data
  std::string text_;
};

}  // namespace seastitch
