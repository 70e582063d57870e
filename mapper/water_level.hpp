#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// How far the water line lies above the map's zero of depth, at every time: of a tide gauge, or
// predicted. Between two entries it changes evenly; outside of them it is the nearest one's.
class WaterLevel {
 public:
  WaterLevel() = default;
  // One line an entry, in order of time: UTC as 2026-05-02T10:20:30Z (T or a blank, Z or nothing,
  // seconds with decimals or none) or seconds since 1970, then metres, positive up; between them a
  // comma, semicolon or tab. Lines that begin with '#' are left out, and a first one that names the
  // columns. Throws std::runtime_error "NAME:LINE: what is wrong".
  static WaterLevel Parse(const std::string& text, const std::string& name);

  bool empty() const { return entries_.empty(); }
  // 0 where it is empty.
  double At(Time t) const;
  // Whether it was stated within `reach` of this time.
  bool Covers(Time t, Duration reach) const;
  const std::string& text() const { return text_; }

 private:
  std::map<Time, double> entries_;
  std::string text_;
};

}  // namespace seastitch
