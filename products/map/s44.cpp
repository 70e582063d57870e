#include "products/map/s44.hpp"

#include <cmath>
#include <numbers>

namespace seastitch {

double S44Order::TvuM(double depth_m) const {
  return std::sqrt(a_m * a_m + b * depth_m * b * depth_m);
}

S44Shares CompareWithS44(const Raster& elevation, const Raster& mismatch) {
  S44Shares shares;
  for (std::size_t i = 0; i < elevation.values.size() && i < mismatch.values.size(); ++i) {
    if (elevation.values[i] == kNoData || mismatch.values[i] == kNoData) continue;
    ++shares.cells;
    const double depth_m = std::abs(double{elevation.values[i]});
    for (std::size_t k = 0; k < kS44Orders.size(); ++k)
      if (mismatch.values[i] <= std::numbers::sqrt2 * kS44Orders[k].TvuM(depth_m))
        ++shares.within[k];
  }
  return shares;
}

}  // namespace seastitch
