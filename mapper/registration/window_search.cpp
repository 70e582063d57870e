#include "mapper/registration/window_search.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "mapper/registration/correlator.hpp"
#include "mapper/registration/height_grid.hpp"
#include "mapper/registration/smoothing.hpp"

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;

constexpr double kEverywhereM = 1e9;

// The prior of the source's centre in the target, and of yaw.
struct CenterPrior {
  Eigen::Vector2d center_target;
  double yaw;
  Eigen::Matrix3d covariance;
};

CenterPrior AboutCenter(const RegistrationPrior& prior, const Eigen::Vector2d& center_source) {
  const Eigen::Vector2d arm = prior.T_target_source.Rotation() * center_source;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J(0, 2) = -arm.y();
  J(1, 2) = arm.x();
  return {prior.T_target_source * center_source,
          prior.T_target_source.yaw,
          J * prior.covariance * J.transpose()};
}

// The cells of the source that may overlap the target for poses within the window. Yaw turns them
// about their centre, where it moves them least.
struct SourceShape {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
  Eigen::Vector2d half_size_m = Eigen::Vector2d::Zero();  // along the target's axes, for every yaw
};

// Calls visit(p) with the centre of every cell of the source that falls on the target if the prior
// is moved by up to `reach`.
template <class Visit>
void ForEachCellWithin(const Grid<Cell>& source,
                       const GridGeometry& target,
                       const Pose2& T_target_source,
                       const Eigen::Vector2d& reach,
                       Visit visit) {
  const GridGeometry& g = source.geometry();
  const Eigen::Matrix2d R = T_target_source.Rotation();
  const Eigen::Vector2d low = target.origin - reach;
  const Eigen::Vector2d high =
      target.origin + target.cell_m * Eigen::Vector2d(target.rows, target.cols) + reach;
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      if (!(source(row, col).variance > 0.0f)) continue;
      const Eigen::Vector2d p = g.Center(row, col);
      const Eigen::Vector2d q = R * p + T_target_source.Translation();
      if ((q.array() >= low.array()).all() && (q.array() <= high.array()).all()) visit(p);
    }
  }
}

SourceShape ShapeOf(const Grid<Cell>& source,
                    const GridGeometry& target,
                    const RegistrationPrior& prior,
                    const RegistrationParams& params) {
  const double yaw_reach = std::min(kPi, params.window_sigma * std::sqrt(prior.covariance(2, 2)));
  const auto shape_within = [&](const Eigen::Vector2d& reach) {
    SourceShape shape;
    double count = 0.0;
    ForEachCellWithin(source, target, prior.T_target_source, reach, [&](const Eigen::Vector2d& p) {
      shape.center += p;
      count += 1.0;
    });
    if (count == 0.0) return shape;
    shape.center /= count;
    const Eigen::Matrix2d R = prior.T_target_source.Rotation();
    double squared_radius = 0.0;
    ForEachCellWithin(source, target, prior.T_target_source, reach, [&](const Eigen::Vector2d& p) {
      const Eigen::Vector2d arm = R * (p - shape.center);
      squared_radius = std::max(squared_radius, arm.squaredNorm());
      shape.half_size_m = shape.half_size_m.cwiseMax(arm.cwiseAbs());
    });
    shape.radius_m = std::sqrt(squared_radius);
    shape.half_size_m =
        (shape.half_size_m.array() + shape.radius_m * std::min(yaw_reach, 1.0)).min(shape.radius_m);
    return shape;
  };
  const SourceShape all = shape_within(Eigen::Vector2d::Constant(kEverywhereM));
  const Eigen::Matrix3d C = AboutCenter(prior, all.center).covariance;
  const Eigen::Vector2d reach(params.window_sigma * std::sqrt(C(0, 0)),
                              params.window_sigma * std::sqrt(C(1, 1)));
  return shape_within((reach.array() + all.radius_m * yaw_reach).matrix());
}

// The cells of the target at which the source's centre is tried, and the yaws.
struct LagWindow {
  int first_row;
  int first_col;
  int rows;  // 0: target and source never overlap in the window
  int cols;
  int half_rows;  // of the box that contains the source at every yaw
  int half_cols;
  int half_yaws;
  double yaw_step;

  int ImageRows() const { return rows + 2 * half_rows; }
  int ImageCols() const { return cols + 2 * half_cols; }
};

// First cell and number of cells of one axis within `reach` of `middle` where the source still
// touches the target.
std::pair<int, int> Range(double middle, double reach, int target_cells, int source_half) {
  const double first = std::max(std::floor(middle - reach), -1.0 * source_half);
  const double last = std::min(std::ceil(middle + reach), 1.0 * target_cells + source_half - 1.0);
  if (!(first <= last)) return {0, 0};
  return {static_cast<int>(first), static_cast<int>(last - first) + 1};
}

LagWindow WindowOf(const GridGeometry& target,
                   const SourceShape& shape,
                   const CenterPrior& prior,
                   const RegistrationParams& params) {
  const double cell = target.cell_m;
  const auto reach = [&](int axis) {
    return params.window_sigma * std::sqrt(prior.covariance(axis, axis));
  };
  const Eigen::Vector2d middle =
      (prior.center_target - target.origin) / cell - Eigen::Vector2d(0.5, 0.5);
  LagWindow w;
  w.half_rows = static_cast<int>(std::ceil(shape.half_size_m.x() / cell)) + 1;
  w.half_cols = static_cast<int>(std::ceil(shape.half_size_m.y() / cell)) + 1;
  std::tie(w.first_row, w.rows) = Range(middle.x(), reach(0) / cell, target.rows, w.half_rows);
  std::tie(w.first_col, w.cols) = Range(middle.y(), reach(1) / cell, target.cols, w.half_cols);
  // Half a step of yaw moves the rim by 3/4 of a cell, most of the area by less.
  w.yaw_step = 1.5 * cell / std::max(shape.radius_m, cell);
  w.half_yaws =
      static_cast<int>(std::ceil(std::max(0.0, std::min(reach(2), kPi) / w.yaw_step - 0.5)));
  return w;
}

// Three layers: a mask of known cells, their heights, and the squares of the heights.
struct Layers {
  std::vector<double> known;
  std::vector<double> height;
  std::vector<double> square;
  explicit Layers(std::size_t size) : known(size, 0.0), height(size, 0.0), square(size, 0.0) {}
  void Set(std::size_t i, double z) {
    known[i] = 1.0;
    height[i] = z;
    square[i] = z * z;
  }
};

struct Spectra {
  Correlator::Spectrum known;
  Correlator::Spectrum height;
  Correlator::Spectrum square;
};

Spectra Transform(Correlator* correlator, const Layers& layers) {
  return {correlator->Transform(layers.known),
          correlator->Transform(layers.height),
          correlator->Transform(layers.square)};
}

// A position of the source's centre in the window, with the yaw that fits best there.
struct Place {
  double score = -std::numeric_limits<double>::infinity();
  double yaw = 0.0;
};

class Searcher {
 public:
  Searcher(const RegistrationSubmap::Level& target,
           const RegistrationSubmap::Level& source,
           const RegistrationPrior& prior,
           const RegistrationParams& params)
      : target_(target.grid),
        source_(source.grid),
        cell_m_(target.cell_m()),
        shape_(ShapeOf(source_, target_.geometry(), prior, params)),
        prior_(prior),
        center_prior_(AboutCenter(prior, shape_.center)),
        prior_information_(center_prior_.covariance.inverse()),
        params_(params),
        window_(WindowOf(target_.geometry(), shape_, center_prior_, params)),
        correlator_(window_.ImageRows(), window_.ImageCols(), std::max(1, window_.rows)) {}

  std::vector<SearchMode> Run() {
    if (window_.rows == 0 || window_.cols == 0 || shape_.radius_m == 0.0) return {};
    const Spectra target = Transform(&correlator_, TargetLayers());
    std::vector<Place> places(static_cast<std::size_t>(window_.rows) *
                              static_cast<std::size_t>(window_.cols));
    for (int i = -window_.half_yaws; i <= window_.half_yaws; ++i) {
      const double yaw = center_prior_.yaw + i * window_.yaw_step;
      const Spectra source = Transform(&correlator_, SourceLayers(yaw));
      KeepBetter(target, source, yaw, &places);
    }
    return Modes(places);
  }

 private:
  std::size_t At(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(correlator_.cols()) +
           static_cast<std::size_t>(col);
  }

  // The target's cells that any position in the window can reach. The first belongs to the lowest
  // lag.
  Layers TargetLayers() const {
    Layers out(At(correlator_.rows(), 0));
    const GridGeometry& g = target_.geometry();
    const int first_row = window_.first_row - window_.half_rows;
    const int first_col = window_.first_col - window_.half_cols;
    const int rows = std::min(window_.ImageRows(), g.rows - first_row);
    const int cols = std::min(window_.ImageCols(), g.cols - first_col);
    for (int row = std::max(0, -first_row); row < rows; ++row) {
      for (int col = std::max(0, -first_col); col < cols; ++col) {
        const Cell& cell = target_(first_row + row, first_col + col);
        if (cell.variance > 0.0f) out.Set(At(row, col), cell.height_m);
      }
    }
    return out;
  }

  // The source turned by yaw about its centre, sampled at the target's spacing.
  Layers SourceLayers(double yaw) const {
    Layers out(At(correlator_.rows(), 0));
    const Eigen::Matrix2d R_source_target = Eigen::Rotation2Dd(-yaw).toRotationMatrix();
    CellsAround around;
    HeightSample sample;
    for (int row = 0; row <= 2 * window_.half_rows; ++row) {
      for (int col = 0; col <= 2 * window_.half_cols; ++col) {
        const Eigen::Vector2d q(row - window_.half_rows, col - window_.half_cols);
        const Eigen::Vector2d p = shape_.center + R_source_target * (cell_m_ * q);
        if (Interpolate(source_, p, &around, &sample))
          out.Set(At(row, col), sample.height_m + prior_.z_m);
      }
    }
    return out;
  }

  // Scores every lag with enough overlap, and keeps those that are better than in `places`.
  void KeepBetter(const Spectra& target,
                  const Spectra& source,
                  double yaw,
                  std::vector<Place>* places) {
    const std::size_t size = At(window_.rows, 0);
    const auto keep = [size](const double* values, std::vector<double>* out) {
      out->assign(values, values + size);
    };
    keep(correlator_.Correlate(source.known, target.known), &count_);
    keep(correlator_.Correlate(source.known, target.height), &sum_target_);
    keep(correlator_.Correlate(source.height, target.known), &sum_source_);
    keep(correlator_.Correlate(source.known, target.square, source.square, target.known),
         &squares_);
    const double* products = correlator_.Correlate(source.height, target.height);

    const SmoothingKernel kernel;
    const double patch_cells = kernel.PatchCells();
    const double min_cells = std::max(0.5 * params_.min_patches * patch_cells,
                                      0.5 * params_.min_overlap_m2 / (cell_m_ * cell_m_));
    const double floor = params_.min_sounding_sigma_m * params_.min_sounding_sigma_m;
    for (int row = 0; row < window_.rows; ++row) {
      for (int col = 0; col < window_.cols; ++col) {
        const std::size_t i = At(row, col);
        const double n = count_[i];
        if (!(n >= min_cells)) continue;
        const double mean_target = sum_target_[i] / n;
        const double mean_source = sum_source_[i] / n;
        const double relief =
            squares_[i] / n - mean_target * mean_target - mean_source * mean_source;
        const double covariance = products[i] / n - mean_target * mean_source;
        const double shift = (mean_target - mean_source) / prior_.z_sigma_m;
        const double score = AgreementScore(n / patch_cells,
                                            std::max(relief, 0.0) + floor,
                                            std::max(relief - 2.0 * covariance, 0.0) + floor) -
                             0.5 * shift * shift + LogPrior(CenterAt(row, col), yaw);
        Place& place = (*places)[PlaceAt(row, col)];
        if (score > place.score) place = {score, yaw};
      }
    }
  }

  Eigen::Vector2d CenterAt(int row, int col) const {
    return target_.geometry().Center(window_.first_row + row, window_.first_col + col);
  }

  double LogPrior(const Eigen::Vector2d& center, double yaw) const {
    Eigen::Vector3d d;
    d << center - center_prior_.center_target, yaw - center_prior_.yaw;
    return -0.5 * d.dot(prior_information_ * d);
  }

  std::size_t PlaceAt(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(window_.cols) +
           static_cast<std::size_t>(col);
  }

  // The modes with the highest prominence: the drop of the score from a peak to the saddle to a
  // higher peak, or to the score of chance. All peaks along one crest are one mode.
  std::vector<SearchMode> Modes(const std::vector<Place>& places) const {
    struct Peak {
      std::size_t place;
      double prominence;
    };
    std::vector<std::size_t> falling;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (std::isfinite(places[i].score)) falling.push_back(i);
    std::stable_sort(falling.begin(), falling.end(), [&](std::size_t a, std::size_t b) {
      return places[a].score > places[b].score;
    });
    // Union-find over falling scores: islands appear and join. Each is identified by its highest
    // place.
    constexpr std::size_t kUnderWater = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> parent(places.size(), kUnderWater);
    const auto summit = [&](std::size_t i) {
      while (parent[i] != i) i = parent[i] = parent[parent[i]];
      return i;
    };
    std::vector<Peak> peaks;
    const auto drown = [&](std::size_t top, double level) {
      peaks.push_back({top, places[top].score - std::max(level, 0.0)});
    };
    for (const std::size_t i : falling) {
      const int row = static_cast<int>(i / static_cast<std::size_t>(window_.cols));
      const int col = static_cast<int>(i % static_cast<std::size_t>(window_.cols));
      parent[i] = i;
      for (int r = std::max(0, row - 1); r <= std::min(window_.rows - 1, row + 1); ++r) {
        for (int c = std::max(0, col - 1); c <= std::min(window_.cols - 1, col + 1); ++c) {
          if (parent[PlaceAt(r, c)] == kUnderWater) continue;
          std::size_t higher = summit(i);
          std::size_t lower = summit(PlaceAt(r, c));
          if (higher == lower) continue;
          if (places[higher].score < places[lower].score) std::swap(higher, lower);
          if (lower != i) drown(lower, places[i].score);
          parent[lower] = higher;
        }
      }
    }
    for (const std::size_t i : falling)
      if (parent[i] == i) drown(i, 0.0);
    std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) {
      return a.prominence > b.prominence;
    });
    if (peaks.size() > static_cast<std::size_t>(params_.max_modes))
      peaks.resize(static_cast<std::size_t>(params_.max_modes));
    std::vector<SearchMode> modes;
    for (const Peak& peak : peaks) modes.push_back(ModeAt(peak.place, places[peak.place]));
    std::stable_sort(modes.begin(), modes.end(), [](const SearchMode& a, const SearchMode& b) {
      return a.score > b.score;
    });
    return modes;
  }

  SearchMode ModeAt(std::size_t index, const Place& place) const {
    const auto cols = static_cast<std::size_t>(window_.cols);
    const Eigen::Vector2d p =
        CenterAt(static_cast<int>(index / cols), static_cast<int>(index % cols)) -
        Eigen::Rotation2Dd(place.yaw).toRotationMatrix() * shape_.center;
    return {{p.x(), p.y(), WrapAngle(place.yaw)}, place.score};
  }

  const Grid<Cell>& target_;
  const Grid<Cell>& source_;
  double cell_m_;
  SourceShape shape_;
  RegistrationPrior prior_;
  CenterPrior center_prior_;
  Eigen::Matrix3d prior_information_;
  const RegistrationParams& params_;
  LagWindow window_;
  Correlator correlator_;
  // values of every lag at one yaw
  std::vector<double> count_;
  std::vector<double> sum_target_;
  std::vector<double> sum_source_;
  std::vector<double> squares_;
};

}  // namespace

double AgreementScore(double patches, double relief_variance, double difference_variance) {
  return 0.5 * patches * std::log(relief_variance / difference_variance);
}

double SearchCost(const RegistrationSubmap::Level& target,
                  const RegistrationSubmap::Level& source,
                  const RegistrationPrior& prior,
                  const RegistrationParams& params) {
  const SourceShape shape = ShapeOf(source.grid, target.grid.geometry(), prior, params);
  const LagWindow w =
      WindowOf(target.grid.geometry(), shape, AboutCenter(prior, shape.center), params);
  return 1.0 * w.ImageRows() * w.ImageCols() * (2.0 * w.half_yaws + 1.0);
}

std::vector<SearchMode> SearchWindow(const RegistrationSubmap::Level& target,
                                     const RegistrationSubmap::Level& source,
                                     const RegistrationPrior& prior,
                                     const RegistrationParams& params) {
  return Searcher(target, source, prior, params).Run();
}

}  // namespace seastitch
