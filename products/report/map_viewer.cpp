#include "products/report/map_viewer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "products/geo/deflate.hpp"
#include "products/report/picture.hpp"
#include "products/report/survey_layers.hpp"

namespace seastitch {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMostCells = 400'000.0;
constexpr double kFinestStepM = 0.002;
// Codes of a value: 1 to kHighestCode; 0: none.
constexpr double kHighestCode = 65535.0;

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 |
              (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : std::uint32_t{0});
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
  }
  return text;
}

// Means of the cells that have a value.
std::vector<float> Coarsened(const std::vector<float>& values,
                             const GridGeometry& fine,
                             const GridGeometry& coarse,
                             int cells_a_side) {
  std::vector<double> sums(coarse.size(), 0.0);
  std::vector<int> counts(coarse.size(), 0);
  for (int row = 0; row < fine.rows; ++row)
    for (int col = 0; col < fine.cols; ++col) {
      const float value = values[fine.Index(row, col)];
      if (value == kNoData) continue;
      const std::size_t at = coarse.Index(row / cells_a_side, col / cells_a_side);
      sums[at] += value;
      ++counts[at];
    }
  std::vector<float> means(coarse.size(), kNoData);
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
Json Flat(const std::vector<Eigen::Vector2d>& north_east) {
  Json numbers = Json::array();
  for (const Eigen::Vector2d& p : north_east)
    for (const double v : {p.x(), p.y()}) numbers.push_back(std::round(10.0 * v) / 10.0);
  return numbers;
}

// Enough points for a picture: none that is nearer than a metre to the one before.
std::vector<Eigen::Vector2d> Thinned(const std::vector<Eigen::Vector2d>& line) {
  std::vector<Eigen::Vector2d> thinned;
  for (const Eigen::Vector2d& p : line)
    if (thinned.empty() || (p - thinned.back()).norm() > 1.0) thinned.push_back(p);
  return thinned;
}

Json Colours(const ColourScale& scale) {
  Json colours = Json::array();
  for (const Rgb& c : scale)
    colours.push_back({std::lround(255 * c.r), std::lround(255 * c.g), std::lround(255 * c.b)});
  return colours;
}

template <class T>
T FieldOf(const VectorFeature& feature, const std::string& name, const T& missing) {
  for (const auto& [field, value] : feature.fields)
    if (field == name)
      if (const T* const held = std::get_if<T>(&value)) return *held;
  return missing;
}

Json LinesOf(const VectorLayer& layer) {
  Json lines = Json::array();
  for (const VectorFeature& feature : layer.features)
    lines.push_back(Flat(Thinned(feature.north_east)));
  return lines;
}

Json ClosuresOf(const VectorLayer& layer) {
  Json closures = Json::array();
  for (const VectorFeature& feature : layer.features) {
    const bool used = FieldOf<double>(feature, "weight", 0.0) >= kAcceptedWeight;
    closures.push_back({{"line", Flat(feature.north_east)}, {"used", used}});
  }
  return closures;
}

Json SubmapsOf(const VectorLayer& layer) {
  Json submaps = Json::array();
  for (const VectorFeature& feature : layer.features)
    submaps.push_back({{"id", FieldOf<std::int64_t>(feature, "submap", -1)},
                       {"outline", Flat(feature.north_east)}});
  return submaps;
}

}  // namespace

MapViewer::MapViewer(const GridGeometry& geometry)
    : fine_(geometry),
      coarse_(geometry),
      cells_a_side_(std::max(1,
                             static_cast<int>(std::ceil(
                                 std::sqrt(static_cast<double>(geometry.size()) / kMostCells))))) {
  coarse_.cell_m *= cells_a_side_;
  coarse_.rows = (fine_.rows + cells_a_side_ - 1) / cells_a_side_;
  coarse_.cols = (fine_.cols + cells_a_side_ - 1) / cells_a_side_;
}

void MapViewer::Add(const std::string& name, const Raster& raster) {
  const std::vector<float> values = Coarsened(raster.values, fine_, coarse_, cells_a_side_);
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const float value : values) {
    if (value == kNoData) continue;
    lowest = std::min(lowest, static_cast<double>(value));
    highest = std::max(highest, static_cast<double>(value));
  }
  if (lowest > highest) return;  // no value
  Packed packed{
      name, lowest, std::max(kFinestStepM, (highest - lowest) / (kHighestCode - 1.0)), ""};
  std::vector<std::uint16_t> codes;
  codes.reserve(values.size());
  for (const float value : values)
    codes.push_back(value == kNoData ? std::uint16_t{0}
                                     : static_cast<std::uint16_t>(
                                           1 + std::lround((value - lowest) / packed.step_m)));
  packed.base64 = Base64(Deflated(Planes(codes, coarse_.cols)));
  rasters_.push_back(std::move(packed));
}

std::string MapViewer::Data(const std::vector<VectorLayer>& layers) const {
  Json map{{"north_m", coarse_.origin.x()},
           {"east_m", coarse_.origin.y()},
           {"cell_m", coarse_.cell_m},
           {"rows", coarse_.rows},
           {"cols", coarse_.cols},
           {"colours",
            {{"depth", Colours(DepthColours())}, {"mismatch", Colours(ConsistencyColours())}}},
           {"rasters", Json::array()}};
  for (const Packed& raster : rasters_)
    map["rasters"].push_back({{"name", raster.name},
                              {"lowest", raster.lowest_m},
                              {"step", raster.step_m},
                              {"data", raster.base64}});
  for (const VectorLayer& layer : layers) {
    if (layer.name == kTrackLayer) map["track"] = LinesOf(layer);
    if (layer.name == kTrackAsNavigatedLayer) map["track_before"] = LinesOf(layer);
    if (layer.name == kEdgeLayer) map["closures"] = ClosuresOf(layer);
    if (layer.name == kFootprintLayer) map["submaps"] = SubmapsOf(layer);
  }
  std::string text = map.dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;)
    text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace seastitch
