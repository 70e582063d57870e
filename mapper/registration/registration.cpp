#include "mapper/registration/registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "mapper/registration/grid_alignment.hpp"
#include "mapper/registration/height_grid.hpp"
#include "mapper/registration/window_search.hpp"

namespace seastitch {
namespace {

using Level = RegistrationSubmap::Level;

constexpr double kMaxCoordinateM = 1e6;

// Levels that both submaps have, fine to coarse.
struct LevelPair {
  const Level* target;
  const Level* source;
};

std::vector<LevelPair> CommonLevels(const RegistrationSubmap& target,
                                    const RegistrationSubmap& source) {
  std::vector<LevelPair> out;
  for (const Level& t : target.levels())
    for (const Level& s : source.levels())
      if (t.number == s.number) out.push_back({&t, &s});
  return out;
}

bool Usable(const RegistrationPrior& prior) {
  const Eigen::Matrix3d& C = prior.covariance;
  const Eigen::Vector3d T = prior.T_target_source.Vector();
  if (!(C.allFinite() && T.allFinite() && T.cwiseAbs().maxCoeff() < kMaxCoordinateM &&
        std::abs(prior.z_m) < kMaxCoordinateM && prior.z_sigma_m > 0.0 &&
        prior.z_sigma_m < kMaxCoordinateM))
    return false;
  return C.isApprox(C.transpose(), 1e-6) && C.llt().info() == Eigen::Success;
}

struct Overlap {
  double cells = 0.0;
  Eigen::Vector2d center_source = Eigen::Vector2d::Zero();
};

Overlap OverlapAt(const LevelPair& level, const Pose2& T_target_source) {
  const GridGeometry& g = level.source->grid.geometry();
  const Eigen::Matrix2d R = T_target_source.Rotation();
  Overlap out;
  CellsAround around;
  HeightSample sample;
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      if (!(level.source->grid(row, col).variance > 0.0f)) continue;
      const Eigen::Vector2d p = g.Center(row, col);
      if (!Interpolate(level.target->grid, R * p + T_target_source.Translation(), &around, &sample))
        continue;
      out.center_source += p;
      out.cells += 1.0;
    }
  }
  if (out.cells > 0.0) out.center_source /= out.cells;
  return out;
}

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 3, 1>;

// What is known of a placement after a fit, in prior sigma: columns of `directions` are unit
// vectors of whitened (position of the centre, yaw), `covariance` is that of the coordinates along
// them.
struct Knowledge {
  SmallMatrix directions;  // 3 x rank
  SmallMatrix covariance;  // rank x rank
  SmallMatrix gain;        // rank x 3: coordinates from a gradient
  Eigen::Matrix3d whiten;  // (centre, yaw) to prior sigma
  int rank() const { return static_cast<int>(directions.cols()); }
  SmallVector Coordinates(const Eigen::Vector3d& centre_and_yaw) const {
    return directions.transpose() * (whiten * centre_and_yaw);
  }
  // Nats that the prior gains.
  double Information() const {
    double sum = 0.0;
    if (rank() == 0) return sum;
    const SmallVector variances =
        Eigen::SelfAdjointEigenSolver<SmallMatrix>(covariance).eigenvalues();
    for (const double v : variances) sum += 0.5 * std::log1p(1.0 / std::max(v, 1e-12));
    return sum;
  }
};

Knowledge Learn(const GridAligner& aligner,
                const Fit& fit,
                const FitInformation& info,
                const RegistrationPrior& prior,
                const RegistrationParams& params) {
  Knowledge known;
  const Eigen::Matrix3d J = aligner.CenterJacobian(fit.at.T_target_source);
  const Eigen::Matrix3d L = (J * prior.covariance * J.transpose()).llt().matrixL();
  known.whiten = L.inverse();
  const Eigen::Matrix3d hessian = L.transpose() * info.hessian * L;
  const Eigen::Matrix3d noise = L.transpose() * info.noise_hessian * L;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(hessian);
  std::vector<int> columns;
  double open_slopes = 0.0;  // one-sided Hessian along the open directions
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d v = eigen.eigenvectors().col(i);
    const double along = v.dot(noise * v);
    if (eigen.eigenvalues()[i] > params.min_slope_significance * along / std::sqrt(fit.patches))
      columns.push_back(i);
    else
      open_slopes += eigen.eigenvalues()[i] + along;
  }
  known.directions = eigen.eigenvectors()(Eigen::all, columns);
  const SmallMatrix V = known.directions;
  const SmallMatrix uncoupled = (V.transpose() * hessian * V).inverse();
  known.gain = uncoupled * V.transpose() * L.transpose();
  known.covariance = known.gain * info.gradient_covariance * known.gain.transpose();
  // A pipe may lie a prior sigma further along itself, and its direction is not known exactly:
  // slopes along it, which differ from patch to patch by chance, couple the open directions to the
  // known ones. The coupling's covariance is V^T H V open_slopes / patches; what is open moves by
  // one prior sigma.
  known.covariance += uncoupled * (open_slopes / fit.patches);
  const double position_variance = params.min_position_sigma_m * params.min_position_sigma_m;
  const SmallMatrix to_position = V.transpose() * known.whiten.leftCols<2>();
  known.covariance += position_variance * to_position * to_position.transpose();
  return known;
}

// One mode on its way from coarse to fine; fits by level, fine first.
struct Candidate {
  Placement at;
  Eigen::Vector2d center_source;
  std::vector<Fit> fits;
};

class Registrar {
 public:
  Registrar(const RegistrationSubmap& target,
            const RegistrationSubmap& source,
            const RegistrationPrior& prior,
            const RegistrationParams& params)
      : levels_(CommonLevels(target, source)),
        prior_(prior),
        noise_{params.noise,
               std::hypot(target.sounding_sigma_m(), source.sounding_sigma_m()) / std::sqrt(2.0),
               std::hypot(target.height_datum_m(), source.height_datum_m())},
        params_(params) {
    result_.T_target_source = prior.T_target_source;
  }

  RegistrationResult Run() {
    result_.verdict = Judge();
    if (result_.verdict != LoopVerdict::kAccepted) result_.information.setZero();
    return result_;
  }

 private:
  GridAligner Aligner(std::size_t level, const Eigen::Vector2d& center_source) const {
    return {*levels_[level].target, *levels_[level].source, prior_, noise_, center_source, params_};
  }

  // Twice the finest: the search needs no more, and noise is less there.
  std::size_t SearchLevel() const {
    std::size_t level = std::min<std::size_t>(1, levels_.size() - 1);
    while (level + 1 < levels_.size() &&
           SearchCost(*levels_[level].target, *levels_[level].source, prior_, params_) >
               params_.max_search_cells)
      ++level;
    return level;
  }

  // Aligns on one level, from where the coarser one ended.
  void AlignAll(std::size_t level, std::vector<Candidate>* candidates) const {
    for (Candidate& c : *candidates) {
      c.fits[level] = Aligner(level, c.center_source).Align(c.at);
      c.at = c.fits[level].at;
    }
  }

  // Drops what is clearly worse than the best, and repetitions. A candidate that did not converge
  // counts against the others but is never the best. Empty where none converged.
  void Select(std::size_t level, std::vector<Candidate>* candidates) const {
    if (std::none_of(candidates->begin(), candidates->end(), [&](const Candidate& c) {
          return c.fits[level].converged;
        })) {
      candidates->clear();
      return;
    }
    // What is clearly worse already does not become better on a finer grid.
    const Fit best = Best(*candidates, level).fits[level];
    std::erase_if(*candidates, [&](const Candidate& c) {
      return c.fits[level].Score() < best.Score() && !FitsAlike(best, c.fits[level], 2.0);
    });
    EraseRepeated(level, candidates);
  }

  // Modes that met at one place, to a tenth of a cell, are one.
  void EraseRepeated(std::size_t level, std::vector<Candidate>* candidates) const {
    const double cell = levels_[level].source->cell_m();
    std::vector<Candidate> apart;
    for (const Candidate& c : *candidates) {
      const bool repeated = std::any_of(apart.begin(), apart.end(), [&](const Candidate& kept) {
        const Pose2& a = kept.at.T_target_source;
        const Pose2& b = c.at.T_target_source;
        return kept.fits[level].converged == c.fits[level].converged &&
               (a * c.center_source - b * c.center_source).norm() < 0.1 * cell &&
               (a.Translation() - b.Translation()).norm() < 0.1 * cell;
      });
      if (!repeated) apart.push_back(c);
    }
    *candidates = std::move(apart);
  }

  // Whether another place agrees about as well as the best: patch by patch, since a larger overlap
  // is no argument on a seabed that repeats itself.
  bool FitsAlike(const Fit& best, const Fit& other, double tolerance) const {
    if (!(other.evidence >= 0.5 * params_.min_evidence_nats)) return false;
    const double patches = std::min(best.Witnesses(), other.Witnesses());
    const double deficit =
        patches * (best.evidence / best.Witnesses() - other.evidence / other.Witnesses()) +
        best.log_prior - other.log_prior;
    return deficit < tolerance * std::max(params_.min_evidence_nats,
                                          params_.ambiguity_margin_nats_per_patch * patches);
  }

  LoopVerdict Judge() {
    if (levels_.empty()) return LoopVerdict::kLittleOverlap;
    const std::size_t search_level = SearchLevel();
    const std::vector<SearchMode> modes =
        SearchWindow(*levels_[search_level].target, *levels_[search_level].source, prior_, params_);
    if (modes.empty()) return LoopVerdict::kLittleOverlap;
    result_.modes = static_cast<int>(modes.size());
    std::vector<Candidate> candidates;
    double most_cells = 0.0;
    for (const SearchMode& mode : modes) {
      const Overlap overlap = OverlapAt(levels_[search_level], mode.T_target_source);
      candidates.push_back(
          {{mode.T_target_source, 0.0}, overlap.center_source, std::vector<Fit>(levels_.size())});
      most_cells = std::max(most_cells, overlap.cells);
    }
    if (!(Area(most_cells, search_level) >= params_.min_overlap_m2))
      return LoopVerdict::kLittleOverlap;
    AlignAll(search_level, &candidates);
    if (!(Area(MostCells(candidates, search_level), search_level) >= params_.min_overlap_m2))
      return LoopVerdict::kLittleOverlap;
    Select(search_level, &candidates);
    if (candidates.empty()) return LoopVerdict::kNotConverged;
    Lesson lesson = LessonOf(Best(candidates, search_level), search_level);
    const std::size_t level = Descend(search_level, &candidates, &lesson);
    const Candidate best = Best(candidates, level);
    AddRivalsNearby(best, search_level, level, &candidates);
    return JudgeBest(best, candidates, level, lesson);
  }

  // What the fit of a candidate on a level says.
  struct Lesson {
    FitInformation info;
    Knowledge known;
  };

  Lesson LessonOf(const Candidate& candidate, std::size_t level) const {
    const GridAligner aligner = Aligner(level, candidate.center_source);
    const Fit& fit = candidate.fits[level];
    const FitInformation info = aligner.Inform(fit);
    return {info, Learn(aligner, fit, info, prior_, params_)};
  }

  // A finer grid follows more relief, costs more, and carries more noise: goes down as long as it
  // tells more. `lesson`: of the best candidate, there and where it ends.
  std::size_t Descend(std::size_t level, std::vector<Candidate>* candidates, Lesson* lesson) const {
    while (level > 0) {
      std::vector<Candidate> finer = *candidates;
      AlignAll(level - 1, &finer);
      Select(level - 1, &finer);
      if (finer.empty()) break;
      Lesson next = LessonOf(Best(finer, level - 1), level - 1);
      if (!(next.known.Information() > lesson->known.Information() + kWorthwhileNats)) break;
      *lesson = std::move(next);
      *candidates = std::move(finer);
      --level;
    }
    return level;
  }

  // What the search's cells smooth away they cannot tell apart. Where a patch says more on the
  // finer level, looks around the best place there, as far as the kernel of the search reaches.
  void AddRivalsNearby(const Candidate& best,
                       std::size_t search_level,
                       std::size_t level,
                       std::vector<Candidate>* candidates) const {
    if (best.fits[search_level].EvidenceAPatch() >= 0.5 * best.fits[level].EvidenceAPatch()) return;
    const double cell = levels_[level].source->cell_m();
    const double reach = kRivalReachCells * levels_[search_level].source->cell_m();
    const GridAligner aligner = Aligner(level, best.center_source);
    const Eigen::Matrix3d to_pose = aligner.CenterJacobian(best.at.T_target_source).inverse();
    const double sigma = reach / params_.window_sigma;
    const Eigen::Vector3d variances(sigma * sigma, sigma * sigma, kRivalYawVariance);
    RegistrationPrior around = prior_;
    around.T_target_source = best.at.T_target_source;
    around.covariance = to_pose * variances.asDiagonal() * to_pose.transpose();
    for (const SearchMode& mode :
         SearchWindow(*levels_[level].target, *levels_[level].source, around, params_)) {
      const Eigen::Vector2d apart =
          mode.T_target_source * best.center_source - best.at.T_target_source * best.center_source;
      if (apart.norm() < cell) continue;
      Candidate other = best;
      other.fits[level] = aligner.Align({mode.T_target_source, best.at.shift_m});
      other.at = other.fits[level].at;
      candidates->push_back(other);
    }
  }

  // A kernel of sigma one cell leaves a tenth of a wave of three cells; such places and some
  // beyond.
  static constexpr double kRivalReachCells = 4.0;
  static constexpr double kRivalYawVariance = 1e-8;  // the best place's yaw alone

  // A grid that narrows sigma by less than 3 % in each direction is not worth its time.
  static constexpr double kWorthwhileNats = 0.1;

  static double MostCells(const std::vector<Candidate>& candidates, std::size_t level) {
    double most = 0.0;
    for (const Candidate& c : candidates) most = std::max(most, c.fits[level].cells);
    return most;
  }

  double Area(double cells, std::size_t level) const {
    const double cell = levels_[level].source->cell_m();
    return cells * cell * cell;
  }

  static const Candidate& Best(const std::vector<Candidate>& candidates, std::size_t level) {
    return *std::max_element(
        candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
          if (a.fits[level].converged != b.fits[level].converged) return b.fits[level].converged;
          return a.fits[level].Score() < b.fits[level].Score();
        });
  }

  LoopVerdict JudgeBest(const Candidate& best,
                        const std::vector<Candidate>& candidates,
                        std::size_t level,
                        const Lesson& lesson) {
    const GridAligner aligner = Aligner(level, best.center_source);
    Fit fit = best.fits[level];
    auto [info, known] = lesson;
    const bool polished = Polish(aligner, &fit, &info, &known);
    Report(aligner, fit, info, known, level);
    const bool rival = FindRival(best, candidates, level, known);

    if (!(result_.overlap_m2 >= params_.min_overlap_m2 && fit.patches >= params_.min_patches))
      return LoopVerdict::kLittleOverlap;
    if (known.rank() == 0 || !(fit.evidence >= params_.min_evidence_nats))
      return LoopVerdict::kDegenerate;
    if (!polished) return LoopVerdict::kNotConverged;
    if (rival) return LoopVerdict::kAmbiguous;
    const double misfit = fit.difference_variance / fit.expected_variance;
    if (!(misfit <= params_.max_residual_ratio * params_.max_residual_ratio ||
          (known.rank() == 3 && fit.relief_variance >= kClearRelief * fit.difference_variance)))
      return LoopVerdict::kPoorFit;
    if (!(PriorChi2(aligner, fit, known) <= params_.max_prior_chi2))
      return LoopVerdict::kOutsideWindow;
    if (!result_.information.allFinite()) return LoopVerdict::kNotConverged;
    result_.statistics = StatisticsOf(aligner, fit, info, known);
    return LoopVerdict::kAccepted;
  }

  // Where the surfaces explain this many times what is left between them, a fit is not called poor
  // for being worse than the noise: the error is shared, and counted as such. Not where a direction
  // is open: crests that bend fit poorly, but clearly, further along.
  static constexpr double kClearRelief = 10.0;

  // Newton steps without the prior, along the known directions alone: what is published must not
  // hold the prior, which the graph has already.
  bool Polish(const GridAligner& aligner, Fit* fit, FitInformation* info, Knowledge* known) const {
    double damping = 1.0;
    Eigen::Vector3d last_move = Eigen::Vector3d::Zero();  // in prior sigma
    for (int i = 0; i <= kMaxPolishSteps; ++i) {
      if (known->rank() == 0) return true;
      const SmallVector step = known->gain * info->gradient;
      if (step.dot(known->covariance.ldlt().solve(step)) < kPolishedChi2) return true;
      const Eigen::Vector3d whitened_move = known->directions * step;
      if (whitened_move.dot(last_move) < 0.0) damping *= kTurnedBackDamping;
      last_move = whitened_move;
      const Eigen::Vector3d move = damping * (known->whiten.inverse() * whitened_move);
      if (!move.allFinite()) return false;
      const Placement at = aligner.Moved(fit->at, {move.x(), move.y(), move.z(), 0.0});
      *fit = aligner.Describe(at, fit->noise_scale);
      if (!(fit->patches >= 1.0)) return false;
      *info = aligner.Inform(*fit);
      *known = Learn(aligner, *fit, *info, prior_, params_);
    }
    return false;
  }

  // Steps of a tenth of a sigma change nothing that matters.
  static constexpr double kPolishedChi2 = 0.01;
  static constexpr int kMaxPolishSteps = 20;
  // Cells at the rim enter and leave with every step. Full steps then turn back and forth for ever.
  static constexpr double kTurnedBackDamping = 0.6;

  // Whether a place fits alike that differs by more than the uncertainty of both.
  bool FindRival(const Candidate& best,
                 const std::vector<Candidate>& candidates,
                 std::size_t level,
                 const Knowledge& known) {
    bool rival = false;
    if (known.rank() == 0) return rival;
    const Fit& fit = best.fits[level];
    for (const Candidate& other : candidates) {
      const Pose2& a = fit.at.T_target_source;
      const Pose2& b = other.fits[level].at.T_target_source;
      Eigen::Vector3d apart;
      apart << b * best.center_source - a * best.center_source, WrapAngle(b.yaw - a.yaw);
      const SmallVector d = known.Coordinates(apart);
      if (d.dot(known.covariance.ldlt().solve(d)) < 2.0 * params_.max_prior_chi2) continue;
      result_.runner_up_score = std::max(result_.runner_up_score, other.fits[level].Score());
      rival = rival || FitsAlike(fit, other.fits[level], 1.0);
    }
    return rival;
  }

  double PriorChi2(const GridAligner& aligner, const Fit& fit, const Knowledge& known) const {
    Eigen::Vector3d d = fit.at.T_target_source.Vector() - prior_.T_target_source.Vector();
    d[2] = WrapAngle(d[2]);
    const SmallVector c = known.Coordinates(aligner.CenterJacobian(fit.at.T_target_source) * d);
    const SmallMatrix both = known.covariance + SmallMatrix::Identity(known.rank(), known.rank());
    return c.dot(both.ldlt().solve(c));
  }

  void Report(const GridAligner& aligner,
              const Fit& fit,
              const FitInformation& info,
              const Knowledge& known,
              std::size_t level) {
    result_.T_target_source = fit.at.T_target_source;
    result_.z_offset_m = -fit.at.shift_m;
    result_.z_offset_sigma_m = info.shift_sigma_m;
    result_.rms_m = std::sqrt(fit.difference_variance);
    result_.overlap_m2 = Area(fit.cells, level);
    result_.overlap_center_m = aligner.Center(fit.at.T_target_source);
    result_.sounding_sigma_m = info.sounding_sigma_m;
    result_.shared_sigma_m = info.shared_sigma_m;
    result_.cell_m = levels_[level].source->cell_m();
    result_.score = fit.Score();
    result_.known_directions = known.rank();
    if (known.rank() == 0) return;
    const SmallMatrix J = known.directions.transpose() * known.whiten *
                          aligner.CenterJacobian(fit.at.T_target_source);
    const SmallMatrix information = known.covariance.inverse();
    const Eigen::Matrix3d full = J.transpose() * information * J;
    result_.information = 0.5 * (full + full.transpose());
  }

  ClosureStatistics StatisticsOf(const GridAligner& aligner,
                                 const Fit& fit,
                                 const FitInformation& info,
                                 const Knowledge& known) const {
    const Eigen::Matrix2d R = fit.at.T_target_source.Rotation();
    const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::ColMajor, 3, 4> gain =
        known.gain * info.eliminate;
    const auto by = [&](const Eigen::Matrix4d& of_gradient) -> SmallMatrix {
      const SmallMatrix covariance = gain * of_gradient * gain.transpose();
      return 0.5 * (covariance + covariance.transpose());
    };
    ClosureStatistics s;
    s.scatter = info.scatter;
    s.altitude_m = noise_.altitude_m;
    s.likelihood = BoundedLikelihood(RestrictedLikelihood(info.blocks, R, noise_.altitude_m));
    s.white = by(info.sources.white);
    s.correlated_error = by(info.sources.correlated_error);
    s.position_walk = by(info.sources.position_walk);
    s.heading_walk = by(info.sources.heading_walk);
    s.fixed = known.covariance - known.gain * info.gradient_covariance * known.gain.transpose() +
              info.shift_information * gain.col(3) * gain.col(3).transpose() + by(info.structure);
    s.jacobian = known.directions.transpose() * known.whiten *
                 aligner.CenterJacobian(fit.at.T_target_source);
    s.registered_under = s.stated_under = noise_.components;
    return s;
  }

  std::vector<LevelPair> levels_;
  RegistrationPrior prior_;
  ExpectedNoise noise_;
  const RegistrationParams& params_;
  RegistrationResult result_;
};

}  // namespace

RegistrationResult Align(const RegistrationSubmap& target,
                         const RegistrationSubmap& source,
                         const RegistrationPrior& prior,
                         const RegistrationParams& params) {
  RegistrationPrior of_cells = prior;
  of_cells.z_m = prior.z_m + source.height_datum_m() - target.height_datum_m();
  if (!Usable(of_cells)) return {};
  const RegistrationResult result = Registrar(target, source, of_cells, params).Run();
  if (result.verdict != LoopVerdict::kOutsideWindow || !(result.score >= params.min_evidence_nats))
    return result;
  // A match this clear outside the window is no chance: the prior is too narrow. It is judged again
  // in a window of twice the width.
  of_cells.covariance *= 4.0;
  return Registrar(target, source, of_cells, params).Run();
}

}  // namespace seastitch
