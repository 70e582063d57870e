#include "mapper/input/datum_height.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kHighestM = 10'000.0;
constexpr double kMaxPoints = 50e6;

// Reads a text word by word; an empty word at its end.
class Words {
 public:
  explicit Words(std::string_view text) : left_(text) {}
  std::string_view Next() {
    constexpr std::string_view kBlanks = " \t\r\n";
    left_.remove_prefix(std::min(left_.find_first_not_of(kBlanks), left_.size()));
    const std::string_view word = left_.substr(0, left_.find_first_of(kBlanks));
    left_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view left_;
};

std::optional<double> Number(std::string_view word) {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool usable =
      error == std::errc() && stop == word.data() + word.size() && std::isfinite(value);
  return usable ? std::optional(value) : std::nullopt;
}

}  // namespace

DatumHeight DatumHeight::Parse(const std::string& text, const std::string& name) {
  const auto wrong = [&name](const std::string& what) {
    return std::runtime_error(name + ": " + what);
  };
  Words words(text);
  std::map<std::string, double> header;
  std::string_view word = words.Next();
  while (!word.empty() && std::isalpha(static_cast<unsigned char>(word[0]))) {
    std::string key(word);
    std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) {
      return static_cast<char>(std::tolower(c));
    });
    const auto value = Number(words.Next());
    if (!value) throw wrong("no number after " + key);
    header[key] = *value;
    word = words.Next();
  }
  for (const char* const key : {"ncols", "nrows", "cellsize"})
    if (!header.contains(key)) throw wrong(std::string("no ESRI ASCII grid: no ") + key);
  const double columns = header["ncols"], rows = header["nrows"], cell_deg = header["cellsize"];
  if (!(columns >= 1.0) || !(rows >= 1.0) || !(columns * rows <= kMaxPoints) || !(cell_deg > 0.0))
    throw wrong("ncols, nrows and cellsize are those of no grid");
  DatumHeight grid;
  grid.text_ = text;
  grid.columns_ = static_cast<std::size_t>(columns);
  grid.rows_ = static_cast<std::size_t>(rows);
  grid.cell_deg_ = cell_deg;
  // Position of the south-west point on one axis.
  const auto corner = [&](const std::string& axis) {
    if (header.contains(axis + "llcenter")) return header[axis + "llcenter"];
    if (header.contains(axis + "llcorner")) return header[axis + "llcorner"] + 0.5 * cell_deg;
    throw wrong("no " + axis + "llcorner");
  };
  grid.west_deg_ = corner("x");
  grid.north_deg_ = corner("y") + cell_deg * static_cast<double>(grid.rows_ - 1);
  if (!(std::abs(grid.north_deg_) <= 91.0) || !(std::abs(grid.west_deg_) <= 361.0))
    throw wrong("its corner is not in degrees of longitude and latitude");
  for (; !word.empty(); word = words.Next()) {
    const auto metres = Number(word);
    if (!metres) throw wrong("'" + std::string(word) + "' is not a number of metres");
    const bool missing = header.contains("nodata_value") && *metres == header["nodata_value"];
    if (!missing && std::abs(*metres) > kHighestM)
      throw wrong("'" + std::string(word) + "' m is no height");
    grid.metres_.push_back(missing ? std::numeric_limits<double>::quiet_NaN() : *metres);
    if (grid.metres_.size() > grid.columns_ * grid.rows_) break;
  }
  if (grid.metres_.size() != grid.columns_ * grid.rows_)
    throw wrong("not ncols x nrows values but " + std::to_string(grid.metres_.size()));
  return grid;
}

std::optional<double> DatumHeight::At(const GeoPoint& point) const {
  if (empty()) return std::nullopt;
  // Grids may count longitudes from -180 or from 0.
  double east_deg = std::fmod(Rad2Deg(point.longitude_rad) - west_deg_ + 0.5 * cell_deg_, 360.0);
  if (east_deg < 0.0) east_deg += 360.0;
  const auto last = [](std::size_t count) { return static_cast<double>(count - 1); };
  const double column = east_deg / cell_deg_ - 0.5;
  const double row = (north_deg_ - Rad2Deg(point.latitude_rad)) / cell_deg_;
  const bool inside = column <= last(columns_) + 0.5 && row >= -0.5 && row <= last(rows_) + 0.5;
  if (!inside) return std::nullopt;
  const double x = std::clamp(column, 0.0, last(columns_));
  const double y = std::clamp(row, 0.0, last(rows_));
  const auto left = static_cast<std::size_t>(x), above = static_cast<std::size_t>(y);
  const double u = x - std::floor(x), v = y - std::floor(y);
  double sum = 0.0;
  const auto add = [&](std::size_t r, std::size_t c, double weight) {
    if (weight > 0.0) sum += weight * metres_[r * columns_ + c];
  };
  add(above, left, (1.0 - u) * (1.0 - v));
  add(above, left + 1, u * (1.0 - v));
  add(above + 1, left, (1.0 - u) * v);
  add(above + 1, left + 1, u * v);
  return std::isnan(sum) ? std::nullopt : std::optional(sum);
}

}  // namespace seastitch
