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

// Registration of two submaps in x, y and yaw: Gauss-Newton alignment of two height grids whose
// cells carry a variance (a height-field form of GICP). docs/registration.md explains it; it is
// III-A-3 of the paper in docs/design.md. Roll and pitch stay as gravity gave them; z is estimated
// as a nuisance parameter under a prior. Cells are associated by vertical projection. A search on a
// coarse grid tries every hypothesis in the window of the prior; the best few are refined. Pure and
// deterministic. Frames: level frame of a submap: its origin, axes forward, right, down with roll
// and pitch taken out. All heights are z in that frame: positive down.
namespace seastitch {

// Cell edges are powers of two metres, so that submaps of different point density share levels.
struct RegistrationParams {
  // Lower bound of the finest cell. A beam's footprint, about 0.02 times its range, reaches it at 6
  // m.
  double min_cell_m = 0.125;
  // Edge of the finest cell divided by the mean spacing of points, before it is rounded up to a
  // power of two. The smoothing kernel averages 4 pi cells: at 0.75 seven points, which are enough
  // for the three parameters of a plane.
  double cell_per_spacing = 0.75;
  int num_levels = 4;  // cells of 1, 2, 4, 8 times the finest
  // Maximum number of cells of a grid. A cloud that would need more is cropped to where most of its
  // points are, and then gets larger cells.
  int max_cells = 1'000'000;

  // Half-width of the search window along each axis, in sigma of the prior. 3 contains the true
  // pose in 99 % of cases (99.7 % per axis).
  double window_sigma = 3.0;
  int max_modes = 5;  // local maxima of the search, of highest prominence, that are refined
  // Maximum number of cells times yaw hypotheses of one search. A search that needs more is done on
  // the next coarser level.
  int max_search_cells = 100'000;

  // Lower bound of the estimated noise of a sounding, 1 sigma.
  double min_sounding_sigma_m = 0.001;
  // Expected noise of the height differences of two submaps, as ratios and random walks.
  VarianceComponents noise;
  // Position error added in quadrature to every result, each axis: 20 ms of latency at 1 m/s.
  double min_position_sigma_m = 0.02;

  double min_overlap_m2 = 10.0;
  // Smallest overlap in patches (4 pi cells, one independent measurement each). A fit has four
  // parameters, and its statistics need as many degrees of freedom.
  double min_patches = 8.0;
  // Smallest evidence of the best hypothesis (log-likelihood ratio against chance): the most that a
  // thousand chance hypotheses reach. A rival with at least half as much makes the pair ambiguous
  // where evidence plus log prior, evidence taken per patch over the patches of the smaller
  // overlap, is lower than that of the best by less than this, or by less than
  // ambiguity_margin_nats_per_patch times the patches. The latter allows for errors of the noise
  // model: 0.2 = 0.5 log(1.5) is a variance of the height differences that is wrong by 1.5 times.
  double min_evidence_nats = 12.0;
  double ambiguity_margin_nats_per_patch = 0.2;
  // Largest ratio of the residuals' sigma to its expectation from sounding noise and shared errors.
  double max_residual_ratio = 2.0;
  // Smallest significance of a known direction: eigenvalue of the Hessian along it (units of the
  // prior), in standard deviations of what noise alone would make of it.
  double min_slope_significance = 6.0;
  // Largest chi-square of the result against the prior, 3 degrees of freedom: 0.1 % of true results
  // exceed 16.3.
  double max_prior_chi2 = 16.3;
};

// Submap prepared for registration: heights, slopes and densities on a pyramid of grids in its
// level frame, about 36 B per cell. Prepare it once and keep it for all its registrations.
class RegistrationSubmap {
 public:
  // Smoothed seabed at the centre of a cell: a plane fitted under a Gaussian kernel with a sigma of
  // one cell.
  struct Cell {
    float height_m = 0.0f;  // z below height_datum_m(), positive down
    float slope_x = 0.0f;   // dz/dx, x forward in the level frame
    float slope_y = 0.0f;   // dz/dy, y to the right
    // Variance of the mean height of one cell's soundings, if a typical sounding (noise = 1) had
    // unit variance. The kernel averages 4 pi cells, so that height_m has 1 / (4 pi) of it. 0: no
    // height.
    float variance = 0.0f;
    float soundings = 0.0f;  // number of soundings inside this cell
    // Covariance of height and slope, in the same unit. Not zero where the soundings, or the
    // noisier ones, are to one side of the cell.
    float covariance_x = 0.0f;
    float covariance_y = 0.0f;
    float scatter = 0.0f;  // variance of single soundings about the plane [m2]
    float noise = 1.0f;    // variance of soundings here, divided by the typical one (LocalNoise)
  };
  struct Level {
    int number = 0;  // cells of 2^number m
    Grid<Cell> grid;
    double cell_m() const { return grid.geometry().cell_m; }
  };

  RegistrationSubmap() = default;

  // Ignores points that are not finite or have no soundings. R_level_submap: rotation from the
  // submap's frame to its level frame, LevelFromBody(T_map_submap). empty() with too few points.
  static RegistrationSubmap Prepare(const PointCloud& cloud,
                                    const Eigen::Matrix3d& R_level_submap,
                                    const RegistrationParams& params);

  bool empty() const { return levels_.empty(); }
  const std::vector<Level>& levels() const { return levels_; }  // fine to coarse
  // Mean z of the soundings in the level frame [m], positive down. The origin is the vehicle, so
  // that this is its mean altitude.
  double height_datum_m() const { return height_datum_m_; }
  // Scatter: standard deviation of single soundings about the smooth seabed [m], from noise and
  // from relief finer than the kernel.
  double sounding_sigma_m() const { return sounding_sigma_m_; }

 private:
  std::vector<Level> levels_;
  double height_datum_m_ = 0.0;
  double sounding_sigma_m_ = 0.0;
};

// Prior of the hypothesis, before the seabeds are compared.
struct RegistrationPrior {
  Pose2 T_target_source;  // takes coordinates in the source's level frame to the target's
  // Covariance of x, y [m] and yaw [rad] of T_target_source, axes of the target's level frame.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  // z of the source's frame minus z of the target's frame [m], positive down, and 1 sigma of the
  // difference of the two seabeds after it (the mapper uses LoopCloserParams::z_sigma_m).
  double z_m = 0.0;
  double z_sigma_m = 1.0;
};

struct RegistrationResult {
  LoopVerdict verdict = LoopVerdict::kNotConverged;  // use the rest where it is kAccepted
  // Level frames. The prior's pose where the search found none; see the verdict.
  Pose2 T_target_source;
  // Inverse covariance of T_target_source (x, y [m], yaw [rad]; axes of the target's level frame),
  // from the registration alone, without the prior. Singular where the seabed makes a direction
  // unobservable. Zero unless accepted.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  // Height offset that is left after the prior's z_m: z of the source's seabed minus z of the
  // target's, positive down, from tide, draft and sound speed.
  double z_offset_m = 0.0;
  double z_offset_sigma_m = 0.0;
  double rms_m = 0.0;  // of the height differences of smoothed cells, without z_offset_m
  double overlap_m2 = 0.0;
  Eigen::Vector2d overlap_center_m = Eigen::Vector2d::Zero();  // axes of the target's level frame
  double sounding_sigma_m = 0.0;  // noise of a sounding, estimated from the residuals
  double shared_sigma_m = 0.0;    // of correlated errors of neighbouring soundings
  double cell_m = 0.0;            // of the finest level used
  int known_directions = 0;       // rank of the information, 0 to 3
  int modes = 0;                  // modes of the search that were refined
  // Evidence plus log prior [nats]: of the best hypothesis, and of the best one farther from it
  // than the uncertainty of both.
  double score = 0.0;
  double runner_up_score = 0.0;
  // Input of the NoiseEstimator, if accepted: likelihood of the survey's noise, and the parts of
  // the covariance. The caller sets the submaps' ids.
  std::optional<ClosureStatistics> statistics;
};

// Registers source on target: pose, information and verdict. A prior that is not finite or whose
// covariance is not positive definite gives kNotConverged. docs/registration.md explains the
// method.
RegistrationResult Align(const RegistrationSubmap& target,
                         const RegistrationSubmap& source,
                         const RegistrationPrior& prior,
                         const RegistrationParams& params = {});

}  // namespace seastitch
