#include "mapper/submaps/cloud_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mapper/submaps/cell_index.hpp"

namespace seastitch {
namespace {

// A window of 5 x 5 columns. Its median remains on the seabed while at most 12 columns are off it.
constexpr int kReach = 2;
constexpr int kSide = 2 * kReach + 1;
constexpr std::size_t kWindow = kSide * kSide;

// The heights of a window's columns.
class Heights {
 public:
  Heights() { values_.fill(std::numeric_limits<float>::infinity()); }
  void Add(float height) { values_[size_++] = height; }
  const float* begin() const { return values_.data(); }
  const float* end() const { return values_.data() + size_; }

  // Median: of an even number the upper one, of none 0. Computed as the largest value that has at
  // most half of the others below it: for so few values, counting without branches is faster than a
  // selection.
  float Median() const {
    constexpr float kNever = -std::numeric_limits<float>::infinity();
    const auto half = static_cast<int>(size_ / 2);
    float median = kNever;
    for (const float value : *this) {
      int below = 0;
      for (const float other : values_) below += other < value ? 1 : 0;
      median = std::max(median, below <= half ? value : kNever);
    }
    return size_ == 0 ? 0.0f : median;
  }

 private:
  static constexpr std::size_t kPadded = 28;  // a window, rounded up to vectors of four
  static_assert(kPadded >= kWindow);
  std::array<float, kPadded> values_;
  std::size_t size_ = 0;
};

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

  std::size_t size() const { return index_.size(); }
  const CellKey& key(std::size_t column) const { return index_.keys()[column]; }
  std::size_t At(std::int32_t x, std::int32_t y) const { return index_.Find({x, y, 0}); }
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

// The columns around one column; CellIndex::kNone for those without points.
struct Neighbourhood {
  std::array<std::size_t, kWindow> columns;
  float soundings = 0.0f;

  std::size_t at(int dx, int dy) const {
    return columns[static_cast<std::size_t>((dx + kReach) * kSide + dy + kReach)];
  }
};

Neighbourhood Around(const Columns& columns, std::size_t column) {
  Neighbourhood window;
  const CellKey key = columns.key(column);
  for (int dx = -kReach; dx <= kReach; ++dx) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      const std::size_t c = columns.At(key.x + dx, key.y + dy);
      window.columns[static_cast<std::size_t>((dx + kReach) * kSide + dy + kReach)] = c;
      if (c != CellIndex::kNone) window.soundings += columns.soundings(c);
    }
  }
  return window;
}

// The seabed around the centre of one column: height [m], slopes [m per column], scatter [m].
struct LocalSeabed {
  float height = 0.0f;
  float slope_x = 0.0f;
  float slope_y = 0.0f;
  float sigma = 0.0f;
};

// Median difference in height between columns that are neighbours along x (or along y).
float MedianStep(const Columns& columns, const Neighbourhood& window, int along_x) {
  Heights steps;
  for (int dx = -kReach; dx <= kReach - along_x; ++dx) {
    for (int dy = -kReach; dy <= kReach - (1 - along_x); ++dy) {
      const std::size_t a = window.at(dx, dy);
      const std::size_t b = window.at(dx + along_x, dy + 1 - along_x);
      if (a == CellIndex::kNone || b == CellIndex::kNone) continue;
      steps.Add(columns.height(b) - columns.height(a));
    }
  }
  return steps.Median();
}

LocalSeabed Fit(const Columns& columns, const Neighbourhood& window) {
  LocalSeabed seabed;
  seabed.slope_x = MedianStep(columns, window, 1);
  seabed.slope_y = MedianStep(columns, window, 0);
  Heights levelled;
  for (int dx = -kReach; dx <= kReach; ++dx) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      const std::size_t c = window.at(dx, dy);
      if (c == CellIndex::kNone) continue;
      levelled.Add(columns.height(c) - seabed.slope_x * static_cast<float>(dx) -
                   seabed.slope_y * static_cast<float>(dy));
    }
  }
  seabed.height = levelled.Median();
  Heights deviations;
  for (const float height : levelled) deviations.Add(std::abs(height - seabed.height));
  constexpr float kSigmaOfMedianDeviation = 1.4826f;  // for a Gaussian
  seabed.sigma = kSigmaOfMedianDeviation * deviations.Median();
  return seabed;
}

// Decides which points of one column are outliers, compared with the seabed around it.
class ColumnJudge {
 public:
  ColumnJudge(const Columns& columns,
              const std::vector<PingSpan>& pings,
              std::size_t column,
              const CloudFilterParams& params)
      : columns_(columns), pings_(pings), params_(params), key_(columns.key(column)) {
    window_ = Around(columns, column);
    seabed_ = Fit(columns, window_);
    tolerance_ = std::max(static_cast<float>(params.min_spike_m),
                          static_cast<float>(params.spike_sigmas) * seabed_.sigma);
  }

  bool IsSeabed(std::uint32_t i) const {
    const float others = window_.soundings - columns_.cloud().soundings[i];
    if (others < static_cast<float>(params_.min_neighbours)) return false;
    const float off = HeightOff(i);
    return std::abs(off) <= tolerance_ || IsSupported(off);
  }

 private:
  float HeightOff(std::uint32_t i) const {
    const Eigen::Vector3f& p = columns_.cloud().points[i];
    const auto cell = static_cast<float>(columns_.cell_m());
    const float dx = p.x() / cell - (static_cast<float>(key_.x) + 0.5f);
    const float dy = p.y() / cell - (static_cast<float>(key_.y) + 0.5f);
    return p.z() - seabed_.height - seabed_.slope_x * dx - seabed_.slope_y * dy;
  }

  // Counts the soundings at the same height in this column and its neighbours. If two pings have
  // points here, soundings of both must be at that height.
  bool IsSupported(float off) const {
    const auto same = static_cast<float>(params_.min_spike_m);
    float support = -1.0f;  // the sounding itself does not count
    float total = -1.0f;
    PingSpan came, saw;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        const std::size_t c = window_.at(dx, dy);
        if (c == CellIndex::kNone) continue;
        total += columns_.soundings(c);
        for (const std::uint32_t* j = columns_.begin(c); j != columns_.end(c); ++j) {
          came.Add(pings_[*j]);
          if (std::abs(HeightOff(*j) - off) > same) continue;
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
  CellKey key_;
  Neighbourhood window_;
  LocalSeabed seabed_;
  float tolerance_ = 0.0f;
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
  constexpr std::size_t kPart = 256;
  for_each((columns.size() + kPart - 1) / kPart, [&](std::size_t part) {
    const std::size_t end = std::min(columns.size(), (part + 1) * kPart);
    for (std::size_t c = part * kPart; c < end; ++c) {
      const ColumnJudge judge(columns, pings, c, params);
      for (const std::uint32_t* i = columns.begin(c); i != columns.end(c); ++i) {
        seabed[*i] = judge.IsSeabed(*i) ? 1 : 0;
      }
    }
  });
  return seabed;
}

}  // namespace seastitch
