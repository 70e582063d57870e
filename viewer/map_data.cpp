#include "viewer/map_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "viewer/colours.hpp"
#include "viewer/html.hpp"
#include "viewer/packing.hpp"

namespace seastitch {
namespace {

using JsonValue = nlohmann::ordered_json;

constexpr double kMostCells = 400'000.0;
constexpr double kFinestStepM = 0.002;
// Codes of a value: 1 to kHighestCode; 0: none.
constexpr double kHighestCode = 65535.0;

// Means of the cells that have a value.
std::vector<float> Coarsened(const std::vector<float>& values,
                             const GridGeometry& fine,
                             float none,
                             const GridGeometry& coarse) {
  const int cells_a_side = static_cast<int>(std::lround(coarse.cell_m / fine.cell_m));
  std::vector<double> sums(coarse.size(), 0.0);
  std::vector<int> counts(coarse.size(), 0);
  for (int row = 0; row < fine.rows; ++row)
    for (int col = 0; col < fine.cols; ++col) {
      const float value = values[fine.Index(row, col)];
      if (value == none) continue;
      const std::size_t at = coarse.Index(row / cells_a_side, col / cells_a_side);
      sums[at] += value;
      ++counts[at];
    }
  std::vector<float> means(coarse.size(), none);
  for (std::size_t i = 0; i < means.size(); ++i)
    if (counts[i] > 0) means[i] = static_cast<float>(sums[i] / counts[i]);
  return means;
}

// Of each row the differences of the codes: first all low bytes, then all high bytes.
std::string Planes(const std::vector<std::uint16_t>& codes, int cols) {
  std::string planes(2 * codes.size(), '\0');
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const bool begins_row = i % static_cast<std::size_t>(cols) == 0;
    const auto step = static_cast<std::uint16_t>(codes[i] - (begins_row ? 0 : codes[i - 1]));
    planes[i] = static_cast<char>(step & 0xff);
    planes[codes.size() + i] = static_cast<char>(step >> 8);
  }
  return planes;
}

// North and east in turn, to a decimetre.
JsonValue Flat(const MapLines::Line& north_east) {
  JsonValue numbers = JsonValue::array();
  for (const Eigen::Vector2d& p : north_east)
    for (const double v : {p.x(), p.y()}) numbers.push_back(std::round(10.0 * v) / 10.0);
  return numbers;
}

// Enough points for a picture: none that is nearer than a metre to the one before.
MapLines::Line Thinned(const MapLines::Line& line) {
  MapLines::Line thinned;
  for (const Eigen::Vector2d& p : line)
    if (thinned.empty() || (p - thinned.back()).norm() > 1.0) thinned.push_back(p);
  return thinned;
}

JsonValue Thinned(const std::vector<MapLines::Line>& lines) {
  JsonValue thinned = JsonValue::array();
  for (const MapLines::Line& line : lines) thinned.push_back(Flat(Thinned(line)));
  return thinned;
}

JsonValue Colours(const ColourScale& scale) {
  JsonValue colours = JsonValue::array();
  for (const Rgb& c : scale)
    colours.push_back({std::lround(255 * c.r), std::lround(255 * c.g), std::lround(255 * c.b)});
  return colours;
}

}  // namespace

MapData::MapData(const GridGeometry& geometry)
    : fine_(geometry),
      coarse_(geometry),
      cells_a_side_(std::max(1,
                             static_cast<int>(std::ceil(
                                 std::sqrt(static_cast<double>(geometry.size()) / kMostCells))))) {
  coarse_.cell_m *= cells_a_side_;
  coarse_.rows = (fine_.rows + cells_a_side_ - 1) / cells_a_side_;
  coarse_.cols = (fine_.cols + cells_a_side_ - 1) / cells_a_side_;
}

void MapData::Add(const std::string& name, const std::vector<float>& values, float none) {
  const std::vector<float> means = Coarsened(values, fine_, none, coarse_);
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const float value : means) {
    if (value == none) continue;
    lowest = std::min(lowest, static_cast<double>(value));
    highest = std::max(highest, static_cast<double>(value));
  }
  if (lowest > highest) return;  // no value
  Packed packed{
      name, lowest, std::max(kFinestStepM, (highest - lowest) / (kHighestCode - 1.0)), ""};
  std::vector<std::uint16_t> codes;
  codes.reserve(means.size());
  for (const float value : means)
    codes.push_back(value == none ? std::uint16_t{0}
                                  : static_cast<std::uint16_t>(
                                        1 + std::lround((value - lowest) / packed.step_m)));
  packed.base64 = Base64(Deflated(Planes(codes, coarse_.cols)));
  rasters_.push_back(std::move(packed));
}

std::string MapData::Json(const MapLines& lines) const {
  JsonValue map{{"north_m", coarse_.origin.x()},
                {"east_m", coarse_.origin.y()},
                {"cell_m", coarse_.cell_m},
                {"rows", coarse_.rows},
                {"cols", coarse_.cols},
                {"colours",
                 {{"depth", Colours(DepthColours())}, {"mismatch", Colours(ConsistencyColours())}}},
                {"rasters", JsonValue::array()},
                {"track", Thinned(lines.track)},
                {"track_before", Thinned(lines.track_as_navigated)},
                {"closures", JsonValue::array()},
                {"submaps", JsonValue::array()}};
  for (const Packed& raster : rasters_)
    map["rasters"].push_back({{"name", raster.name},
                              {"lowest", raster.lowest_m},
                              {"step", raster.step_m},
                              {"data", raster.base64}});
  for (const MapLines::Closure& closure : lines.closures)
    map["closures"].push_back({{"line", Flat(closure.line)}, {"used", closure.used}});
  for (const MapLines::Submap& submap : lines.submaps)
    map["submaps"].push_back({{"id", submap.id}, {"outline", Flat(submap.outline)}});
  return WithoutMarkup(map.dump());
}

}  // namespace seastitch
