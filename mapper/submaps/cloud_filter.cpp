#include "mapper/submaps/cloud_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "mapper/submaps/cell_index.hpp"
#include "mapper/submaps/lane_median.hpp"

namespace seastitch {
namespace {

// A window of 5 x 5 columns. Its median remains on the seabed while at most 12 columns are off it.
constexpr int kReach = 2;
constexpr int kSide = 2 * kReach + 1;
constexpr std::size_t kWindow = kSide * kSide;
constexpr std::size_t kStepsOfWindow = kSide * (kSide - 1);
static_assert(CellIndex::kBorder == kReach && CellIndex::kTileSide == kLanes);

// The points of a cloud by column, and the height of each column.
class Columns {
 public:
  Columns(const PointCloud& cloud, double cell_m) : cloud_(cloud), cell_m_(cell_m) {
    std::vector<std::uint32_t> column_of(cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d p = cloud.points[i].cast<double>();
      column_of[i] = static_cast<std::uint32_t>(
          index_.FindOrAdd({CellOf(p.x(), cell_m), CellOf(p.y(), cell_m), 0}));
    }
    begin_.assign(index_.size() + 1, 0);
    for (const std::uint32_t c : column_of) ++begin_[c + 1];
    for (std::size_t c = 0; c < index_.size(); ++c) begin_[c + 1] += begin_[c];
    points_.resize(cloud.size());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      points_[next[column_of[i]]++] = static_cast<std::uint32_t>(i);
    }
    heights_.resize(index_.size());
    soundings_.resize(index_.size());
    std::vector<std::uint32_t> sorted;
    for (std::size_t c = 0; c < index_.size(); ++c) SetHeight(c, &sorted);
  }

  const CellIndex& index() const { return index_; }
  float height(std::size_t column) const { return heights_[column]; }
  float soundings(std::size_t column) const { return soundings_[column]; }
  const std::uint32_t* begin(std::size_t column) const { return points_.data() + begin_[column]; }
  const std::uint32_t* end(std::size_t column) const { return points_.data() + begin_[column + 1]; }
  double cell_m() const { return cell_m_; }
  const PointCloud& cloud() const { return cloud_; }

 private:
  // Sets a column's height to the median of its soundings.
  void SetHeight(std::size_t column, std::vector<std::uint32_t>* sorted) {
    sorted->assign(begin(column), end(column));
    std::sort(sorted->begin(), sorted->end(), [this](std::uint32_t a, std::uint32_t b) {
      return cloud_.points[a].z() < cloud_.points[b].z();
    });
    float total = 0.0f;
    for (const std::uint32_t i : *sorted) total += cloud_.soundings[i];
    soundings_[column] = total;
    float below = 0.0f;
    for (const std::uint32_t i : *sorted) {
      below += cloud_.soundings[i];
      heights_[column] = cloud_.points[i].z();
      if (2.0f * below >= total) return;
    }
  }

  const PointCloud& cloud_;
  double cell_m_;
  CellIndex index_;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> points_;
  std::vector<float> heights_;
  std::vector<float> soundings_;
};

// The columns of a tile of the index, with those around it.
class TileColumns {
 public:
  TileColumns(const Columns& columns, std::size_t tile) : numbers_(columns.index().BlockOf(tile)) {
    for (std::size_t k = 0; k < numbers_.size(); ++k) {
      const bool is_there = numbers_[k] != CellIndex::kNoCell;
      heights_[k] =
          is_there ? columns.height(numbers_[k]) : std::numeric_limits<float>::quiet_NaN();
      soundings_[k] = is_there ? columns.soundings(numbers_[k]) : 0.0f;
    }
  }

  // Column x, y of the tile; those of the border have numbers below 0 and from kTileSide on.
  std::uint32_t At(int x, int y) const { return numbers_[Place(x, y)]; }
  // Of the columns x, y to x, y + 7. Of a column without points NaN, and 0 soundings.
  Lanes HeightsFrom(int x, int y) const { return Eigen::Map<const Lanes>(&heights_[Place(x, y)]); }
  Lanes SoundingsFrom(int x, int y) const {
    return Eigen::Map<const Lanes>(&soundings_[Place(x, y)]);
  }

 private:
  static std::size_t Place(int x, int y) {
    return static_cast<std::size_t>((x + kReach) * CellIndex::kBlockSide + y + kReach);
  }
  CellIndex::Block numbers_;
  std::array<float, std::tuple_size_v<CellIndex::Block>> heights_;
  std::array<float, std::tuple_size_v<CellIndex::Block>> soundings_;
};

// The seabed around the centre of each column of a row: height [m], slopes [m per column], scatter
// [m]; soundings: in the window.
struct RowSeabed {
  Lanes height, slope_x, slope_y, sigma, soundings;
};

// Median difference in height between columns that are neighbours along x (or along y).
Lanes MedianSteps(const TileColumns& tile, int x, int along_x) {
  std::array<Lanes, kStepsOfWindow> steps;
  std::size_t n = 0;
  for (int dx = -kReach; dx <= kReach - along_x; ++dx)
    for (int dy = -kReach; dy <= kReach - (1 - along_x); ++dy)
      steps[n++] =
          tile.HeightsFrom(x + dx + along_x, dy + 1 - along_x) - tile.HeightsFrom(x + dx, dy);
  return UpperMedians(&steps);
}

RowSeabed FitRow(const TileColumns& tile, int x) {
  RowSeabed row;
  row.slope_x = MedianSteps(tile, x, 1);
  row.slope_y = MedianSteps(tile, x, 0);
  row.soundings.setZero();
  std::array<Lanes, kWindow> levelled;
  std::size_t n = 0;
  for (int dx = -kReach; dx <= kReach; ++dx) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      levelled[n++] = tile.HeightsFrom(x + dx, dy) - row.slope_x * static_cast<float>(dx) -
                      row.slope_y * static_cast<float>(dy);
      row.soundings += tile.SoundingsFrom(x + dx, dy);
    }
  }
  std::array<Lanes, kWindow> deviations = levelled;
  row.height = UpperMedians(&levelled);
  for (Lanes& deviation : deviations) deviation = (deviation - row.height).abs();
  constexpr float kSigmaOfMedianDeviation = 1.4826f;  // for a Gaussian
  row.sigma = kSigmaOfMedianDeviation * UpperMedians(&deviations);
  return row;
}

// Decides which points of the columns of one tile are outliers, compared with the seabed around
// each.
class TileJudge {
 public:
  TileJudge(const Columns& columns,
            const std::vector<PingSpan>& pings,
            const CloudFilterParams& params,
            std::size_t tile)
      : columns_(columns), pings_(pings), params_(params), tile_(columns, tile) {}

  // Sets the points of these columns: 1 if it stays, else 0.
  void Judge(std::vector<std::uint8_t>* is_seabed) {
    for (int x = 0; x < CellIndex::kTileSide; ++x) {
      if (IsEmptyRow(x)) continue;
      const RowSeabed row = FitRow(tile_, x);
      for (int y = 0; y < CellIndex::kTileSide; ++y) {
        const std::uint32_t c = tile_.At(x, y);
        if (c == CellIndex::kNoCell) continue;
        const LocalSeabed seabed(row, columns_.index().keys()[c], y);
        for (const std::uint32_t* i = columns_.begin(c); i != columns_.end(c); ++i)
          (*is_seabed)[*i] = IsSeabed(*i, seabed, x, y) ? 1 : 0;
      }
    }
  }

 private:
  // Of one column: see RowSeabed.
  struct LocalSeabed {
    LocalSeabed(const RowSeabed& row, const CellKey& key, int lane)
        : height(row.height[lane]),
          slope_x(row.slope_x[lane]),
          slope_y(row.slope_y[lane]),
          sigma(row.sigma[lane]),
          soundings(row.soundings[lane]),
          center_x(static_cast<float>(key.x) + 0.5f),
          center_y(static_cast<float>(key.y) + 0.5f) {}
    float height, slope_x, slope_y, sigma, soundings;
    float center_x, center_y;  // [columns]
  };

  bool IsEmptyRow(int x) const {
    for (int y = 0; y < CellIndex::kTileSide; ++y)
      if (tile_.At(x, y) != CellIndex::kNoCell) return false;
    return true;
  }

  bool IsSeabed(std::uint32_t i, const LocalSeabed& seabed, int x, int y) const {
    const float others = seabed.soundings - columns_.cloud().soundings[i];
    if (others < static_cast<float>(params_.min_neighbours)) return false;
    const float tolerance = std::max(static_cast<float>(params_.min_spike_m),
                                     static_cast<float>(params_.spike_sigmas) * seabed.sigma);
    const float off = HeightOff(i, seabed);
    return std::abs(off) <= tolerance || IsSupported(off, seabed, x, y);
  }

  float HeightOff(std::uint32_t i, const LocalSeabed& seabed) const {
    const Eigen::Vector3f& p = columns_.cloud().points[i];
    const auto cell = static_cast<float>(columns_.cell_m());
    const float dx = p.x() / cell - seabed.center_x;
    const float dy = p.y() / cell - seabed.center_y;
    return p.z() - seabed.height - seabed.slope_x * dx - seabed.slope_y * dy;
  }

  // Counts the soundings at the same height in this column and its neighbours. If two pings have
  // points here, soundings of both must be at that height.
  bool IsSupported(float off, const LocalSeabed& seabed, int x, int y) const {
    const auto same = static_cast<float>(params_.min_spike_m);
    float support = -1.0f;  // the sounding itself does not count
    float total = -1.0f;
    PingSpan came, saw;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        const std::uint32_t c = tile_.At(x + dx, y + dy);
        if (c == CellIndex::kNoCell) continue;
        total += columns_.soundings(c);
        for (const std::uint32_t* j = columns_.begin(c); j != columns_.end(c); ++j) {
          came.Add(pings_[*j]);
          if (std::abs(HeightOff(*j, seabed) - off) > same) continue;
          saw.Add(pings_[*j]);
          support += columns_.cloud().soundings[*j];
        }
      }
    }
    return (saw.HasTwo() || !came.HasTwo()) && support >= static_cast<float>(params_.min_support) &&
           support >= static_cast<float>(params_.min_support_fraction) * total;
  }

  const Columns& columns_;
  const std::vector<PingSpan>& pings_;
  const CloudFilterParams& params_;
  TileColumns tile_;
};

}  // namespace

SoundingGate CheckSounding(const Eigen::Vector3d& p_map,
                           const Eigen::Vector3d& p_map_vehicle,
                           const CloudFilterParams& params) {
  const Eigen::Vector3d offset = p_map - p_map_vehicle;
  const double range_m = offset.norm();
  if (!std::isfinite(range_m)) return SoundingGate::kNotFinite;
  if (range_m < params.min_range_m) return SoundingGate::kTooNear;
  if (range_m > params.max_range_m) return SoundingGate::kTooFar;
  if (offset.z() <= 0.0) return SoundingGate::kAboveVehicle;
  return SoundingGate::kPass;
}

std::vector<std::uint8_t> FindSeabed(const PointCloud& cloud_level,
                                     const std::vector<PingSpan>& pings,
                                     const CloudFilterParams& params,
                                     const ForEach& for_each) {
  std::vector<std::uint8_t> seabed(cloud_level.size(), 0);
  const double cell_m = CellForDensity(
      cloud_level.points, cloud_level.soundings, params.voxel_m, params.soundings_per_column);
  const Columns columns(cloud_level, cell_m);
  constexpr std::size_t kPart = 8;
  const std::size_t tiles = columns.index().tiles();
  for_each((tiles + kPart - 1) / kPart, [&](std::size_t part) {
    const std::size_t end = std::min(tiles, (part + 1) * kPart);
    for (std::size_t tile = part * kPart; tile < end; ++tile)
      TileJudge(columns, pings, params, tile).Judge(&seabed);
  });
  return seabed;
}

}  // namespace seastitch
