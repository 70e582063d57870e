#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "products/geo/raster.hpp"

// Total vertical uncertainty (TVU) of IHO Standards for Hydrographic Surveys, S-44 edition 6.1.0,
// table 1.
namespace seastitch {

// Largest TVU at 95 % confidence at a depth d: sqrt(a^2 + (b d)^2).
struct S44Order {
  const char* name;  // as in the standard
  const char* key;   // in report.json
  double a_m;
  double b;

  double TvuM(double depth_m) const;
};

inline constexpr std::array<S44Order, 4> kS44Orders{{{"Exclusive Order", "exclusive", 0.15, 0.0075},
                                                     {"Special Order", "special", 0.25, 0.0075},
                                                     {"Order 1a, 1b", "order_1", 0.5, 0.013},
                                                     {"Order 2", "order_2", 1.0, 0.023}}};

// Of the cells that several submaps show, the number whose swath mismatch is at most sqrt(2) TVU:
// a mismatch is a difference of two soundings. It shows how well soundings repeat, not an error
// that all of them share.
struct S44Shares {
  std::uint64_t cells = 0;
  std::array<std::uint64_t, kS44Orders.size()> within{};
};
S44Shares CompareWithS44(const Raster& elevation, const Raster& mismatch);

}  // namespace seastitch
