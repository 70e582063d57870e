#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/grid.hpp"
#include "common/core/pose.hpp"
#include "common/core/submap.hpp"
#include "mapper/noise/closure_statistics.hpp"
#include "mapper/noise/variance_components.hpp"

// Registration of two submaps in x, y and yaw (III-A-3), docs/registration.md: a GICP between the
// Gaussians of height-field cells. Tilt is gravity's and is kept exactly; z is estimated as a
// nuisance under a prior. Cells correspond by vertical projection. A search on a coarse grid tries
// every placement in the window of the prior; the best few are refined. Pure and deterministic.
namespace seastitch {

// Cell edges are powers of two metres, so that submaps of different density share levels.
struct RegistrationParams {
  // Smallest cell. The footprint of a sounding is about 0.02 x its range.
  double min_cell_m = 0.125;
  // Cell of the finest level over the mean spacing of points. A smoothing kernel covers 4 pi cells:
  // seven points at this ratio, for a plane of three parameters.
  double cell_per_spacing = 0.75;
  int num_levels = 4;  // cells of 1, 2, 4, 8 x the finest
  // A cloud that would need more cells is cropped to where its points are.
  int max_cells = 1'000'000;

  // Half-width of the window in sigma of the prior. 3 contains the truth in 99 % of cases a
  // direction.
  double window_sigma = 3.0;
  int max_modes = 5;
  // Cells x yaw hypotheses of one search; a window above it is searched on the next coarser level.
  int max_search_cells = 100'000;

  // Lower bound of the noise of a sounding, which is estimated from the data.
  double min_sounding_sigma_m = 0.001;
  // Noise expected between the two submaps.
  VarianceComponents noise;
  // Position error added to every result: 20 ms of latency at 1 m/s.
  double min_position_sigma_m = 0.02;

  double min_overlap_m2 = 10.0;
  // Fewest independent patches (4 pi cells) of overlap. A placement has four parameters.
  double min_patches = 8.0;
  // Ambiguity: another placement fits as well where the log-likelihoods, over the same number of
  // patches, differ by less than the larger of two bounds. min_evidence_nats is the most that a
  // thousand chance placements reach. The margin a patch covers errors of the model (0.2 nats: 1.5
  // times the variance of the difference).
  double min_evidence_nats = 12.0;
  double ambiguity_margin_nats_per_patch = 0.2;
  // Residual sigma over the scatter of soundings about the smooth seabed.
  double max_residual_ratio = 2.0;
  // A direction is known where the slopes of both submaps agree by this many sigma of chance.
  double min_slope_significance = 6.0;
  // Chi-square, 3 degrees of freedom, of the result against the prior: 0.1 % of true ones exceed.
  double max_prior_chi2 = 16.3;
};

// A submap prepared for registration: heights, slopes and densities on a pyramid of grids in its
// level frame. Prepared once; about 36 B a cell.
class RegistrationSubmap {
 public:
  // Smoothed seabed at the centre of a cell: a plane fitted under a Gaussian kernel of one cell.
  struct Cell {
    float height_m = 0.0f;  // above `height_datum_m`; positive down
    float slope_x = 0.0f;
    float slope_y = 0.0f;
    // Variance of the height for soundings of unit variance where noise is 1; 0: no height here.
    float variance = 0.0f;
    float soundings = 0.0f;  // in this very cell
    // Covariance of height and slope, likewise. Not zero where the soundings, or the noisier ones,
    // are to one side of the cell.
    float covariance_x = 0.0f;
    float covariance_y = 0.0f;
    float scatter = 0.0f;  // variance of single soundings about the plane [m2]
    float noise = 1.0f;    // variance of soundings here over that of typical ones (LocalNoise)
  };
  struct Level {
    int number = 0;  // cells of 2^number m
    Grid<Cell> grid;
    double cell_m() const { return grid.geometry().cell_m; }
  };

  RegistrationSubmap() = default;

  // Ignores points that are not finite or have no soundings. R_level_submap: LevelFromBody().
  // empty() without a usable point.
  static RegistrationSubmap Prepare(const PointCloud& cloud,
                                    const Eigen::Matrix3d& R_level_submap,
                                    const RegistrationParams& params);

  bool empty() const { return levels_.empty(); }
  const std::vector<Level>& levels() const { return levels_; }  // fine to coarse
  // Mean height of the soundings in the level frame: with the vehicle as origin, its altitude.
  double height_datum_m() const { return height_datum_m_; }
  // Scatter of single soundings about the smooth seabed: noise, and relief finer than a kernel.
  double sounding_sigma_m() const { return sounding_sigma_m_; }

 private:
  std::vector<Level> levels_;
  double height_datum_m_ = 0.0;
  double sounding_sigma_m_ = 0.0;
};

// What is known of the placement before the seabeds are compared.
struct RegistrationPrior {
  Pose2 T_target_source;  // level frames
  // Covariance of x, y [m] and yaw [rad] of T_target_source, axes of the target's level frame.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  // Height of the source's frame less that of the target's [m], positive down, and its sigma.
  double z_m = 0.0;
  double z_sigma_m = 1.0;
};

struct RegistrationResult {
  LoopVerdict verdict = LoopVerdict::kNotConverged;
  // Level frames; the prior where registration found nothing better.
  Pose2 T_target_source;
  // Inverse covariance of T_target_source (x, y [m], yaw [rad]; axes of the target's level frame),
  // by registration alone, without the prior. Singular where the seabed leaves a direction open.
  // Zero unless accepted.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  // Height of the source's seabed less that of the target's, positive down: tide, draft, sound
  // speed.
  double z_offset_m = 0.0;
  double z_offset_sigma_m = 0.0;
  double rms_m = 0.0;  // of the height differences of smoothed cells, z_offset_m taken out
  double overlap_m2 = 0.0;
  Eigen::Vector2d overlap_center_m = Eigen::Vector2d::Zero();  // axes of the target's level frame
  double sounding_sigma_m = 0.0;  // noise of a sounding, estimated from the residuals
  double shared_sigma_m = 0.0;    // of errors that neighbouring soundings share
  double cell_m = 0.0;            // of the finest level used
  int known_directions = 0;       // rank of the information, 0 to 3
  int modes = 0;                  // modes of the search that were refined
  // Log-likelihood ratios against chance [nats]: of the best placement, and of the best elsewhere.
  double score = 0.0;
  double runner_up_score = 0.0;
  // For the noise estimate of the survey, where accepted: likelihood of the noise, and the parts of
  // the covariance. The caller sets the submaps' ids.
  std::optional<ClosureStatistics> statistics;
};

// Registers source on target: pose, covariance and verdict. A prior that is no prior (not finite,
// no covariance) gives kNotConverged. docs/registration.md explains the method.
RegistrationResult Align(const RegistrationSubmap& target,
                         const RegistrationSubmap& source,
                         const RegistrationPrior& prior,
                         const RegistrationParams& params = {});

}  // namespace seastitch
