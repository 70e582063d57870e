#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Water level over time: height of the water line above the map's zero of depth [m, positive up],
// from a tide gauge or a prediction. Linear between two entries; outside, that of the nearest
// entry.
class WaterLevel {
 public:
  WaterLevel() = default;
  // One line an entry, in order of time: UTC as 2026-05-02T10:20:30Z (T or a blank, Z or nothing,
  // seconds with decimals or none) or seconds since 1970, then metres, positive up; between them a
  // comma, semicolon or tab. Lines that begin with '#' are left out, and a first one that names the
  // columns. Throws std::runtime_error "NAME:LINE: what is wrong".
  static WaterLevel Parse(const std::string& text, const std::string& name);

  bool empty() const { return entries_.empty(); }
  // 0 without entries.
  double At(Time t) const;
  // True if an entry lies within `reach` of this time.
  bool Covers(Time t, Duration reach) const;
  const std::string& text() const { return text_; }

 private:
  std::map<Time, double> entries_;
  std::string text_;
};

}  // namespace seastitch
