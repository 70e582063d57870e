#include "mapper/registration/registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "mapper/registration/grid_alignment.hpp"
#include "mapper/registration/height_grid.hpp"
#include "mapper/registration/known_directions.hpp"
#include "mapper/registration/window_search.hpp"

namespace seastitch {
namespace {

using Level = RegistrationSubmap::Level;

constexpr double kMaxCoordinateM = 1e6;

// The levels that both submaps have, from fine to coarse.
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

// Area of an overlap, and its middle in the source's axes.
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

// One mode of the search, refined from coarse to fine levels.
struct Candidate {
  Eigen::Vector2d center_source;
  Alignment fit;                           // on the finest level reached
  double search_evidence_per_patch = 0.0;  // on the level of the search
};

// The best candidate, with its information.
struct Solution {
  Candidate best;
  KnownDirections known;
};

// Smallest gain of information that justifies a finer grid: 3 % of sigma in each direction.
constexpr double kWorthwhileNats = 0.1;
// Search radius for nearby rivals, in cells of the search. A kernel with a sigma of one cell leaves
// a tenth of the amplitude of a wave of three cells: such rivals, and some beyond, are in reach.
constexpr double kRivalReachCells = 4.0;
constexpr double kRivalYawVariance = 1e-8;  // only the yaw of the best hypothesis
// A step below a tenth of a sigma is negligible.
constexpr double kPolishedChi2 = 0.01;
constexpr int kMaxPolishSteps = 20;
// Damping after a step back. Cells at the rim enter and leave with every step, and full steps could
// alternate for ever.
constexpr double kTurnedBackDamping = 0.6;
// A misfit above the noise is accepted if the relief explains this many times more: the surfaces
// then agree, and share an error. This does not apply if a direction is open: curved crests fit
// worse further along.
constexpr double kClearRelief = 10.0;

const Candidate& Best(const std::vector<Candidate>& candidates) {
  return *std::max_element(
      candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        if (a.fit.converged != b.fit.converged) return b.fit.converged;
        return a.fit.Score() < b.fit.Score();
      });
}

// One registration, in four steps: search, refine, descend, judge.
class Registrar {
 public:
  Registrar(const RegistrationSubmap& target,
            const RegistrationSubmap& source,
            const RegistrationPrior& prior,
            const RegistrationParams& params)
      : levels_(CommonLevels(target, source)),
        prior_(prior),
        noise_{params.noise,
               Hypotenuse(target.sounding_sigma_m(), source.sounding_sigma_m()) / std::sqrt(2.0),
               Hypotenuse(target.height_datum_m(), source.height_datum_m())},
        params_(params) {
    result_.T_target_source = prior.T_target_source;
  }

  RegistrationResult Run() {
    result_.verdict = Verdict();
    if (result_.verdict != LoopVerdict::kAccepted) result_.information.setZero();
    return result_;
  }

 private:
  LoopVerdict Verdict() {
    if (levels_.empty()) return LoopVerdict::kLittleOverlap;
    const std::size_t search_level = SearchLevel();
    std::vector<Candidate> candidates = Search(search_level);
    if (candidates.empty()) return LoopVerdict::kLittleOverlap;
    Refine(search_level, &candidates);
    if (!OverlapsEnough(search_level, candidates)) return LoopVerdict::kLittleOverlap;
    for (Candidate& c : candidates) c.search_evidence_per_patch = c.fit.EvidencePerPatch();
    Select(search_level, &candidates);
    Solution solution = Inform(search_level, Best(candidates));
    const std::size_t level = Descend(search_level, &candidates, &solution);
    AddRivalsNearby(solution.best, search_level, level, &candidates);
    return Judge(level, candidates, &solution);
  }

  // --- Search

  // Twice the finest cell size: it suffices for the search, and averages more noise.
  std::size_t SearchLevel() const {
    std::size_t level = std::min<std::size_t>(1, levels_.size() - 1);
    while (level + 1 < levels_.size() &&
           SearchCost(*levels_[level].target, *levels_[level].source, prior_, params_) >
               params_.max_search_cells)
      ++level;
    return level;
  }

  // Candidates from the modes of the window; none if the overlap is too small.
  std::vector<Candidate> Search(std::size_t level) {
    const LevelPair& grids = levels_[level];
    const std::vector<SearchMode> modes =
        SearchWindow(*grids.target, *grids.source, prior_, params_);
    result_.modes = static_cast<int>(modes.size());
    std::vector<Candidate> candidates;
    double most_cells = 0.0;
    for (const SearchMode& mode : modes) {
      const Overlap overlap = OverlapAt(grids, mode.T_target_source);
      candidates.push_back({overlap.center_source, {.at = {mode.T_target_source, 0.0}}});
      most_cells = std::max(most_cells, overlap.cells);
    }
    if (!(Area(most_cells, level) >= params_.min_overlap_m2)) candidates.clear();
    return candidates;
  }

  // --- Refine

  GridAligner Aligner(std::size_t level, const Eigen::Vector2d& center_source) const {
    return {*levels_[level].target, *levels_[level].source, prior_, noise_, center_source, params_};
  }

  // Aligns every candidate on one level, starting at its result of the coarser level.
  void Refine(std::size_t level, std::vector<Candidate>* candidates) const {
    for (Candidate& c : *candidates) c.fit = Aligner(level, c.center_source).Align(c.fit.at);
  }

  bool OverlapsEnough(std::size_t level, const std::vector<Candidate>& candidates) const {
    double most = 0.0;
    for (const Candidate& c : candidates) most = std::max(most, c.fit.cells);
    return Area(most, level) >= params_.min_overlap_m2;
  }

  double Area(double cells, std::size_t level) const {
    const double cell = levels_[level].source->cell_m();
    return cells * cell * cell;
  }

  // Removes repetitions, and candidates that are clearly worse than the best: a finer grid does not
  // improve them. One that did not converge is the best only where none did; Polish() then decides.
  void Select(std::size_t level, std::vector<Candidate>* candidates) const {
    const Alignment best = Best(*candidates).fit;
    std::erase_if(*candidates, [&](const Candidate& c) {
      return c.fit.Score() < best.Score() && !FitsAlike(best, c.fit, 2.0);
    });
    EraseRepeated(level, candidates);
  }

  // Candidates within a tenth of a cell of each other are one.
  void EraseRepeated(std::size_t level, std::vector<Candidate>* candidates) const {
    const double cell = levels_[level].source->cell_m();
    std::vector<Candidate> apart;
    for (const Candidate& c : *candidates) {
      const bool repeated = std::any_of(apart.begin(), apart.end(), [&](const Candidate& kept) {
        const Pose2& a = kept.fit.at.T_target_source;
        const Pose2& b = c.fit.at.T_target_source;
        return kept.fit.converged == c.fit.converged &&
               (a * c.center_source - b * c.center_source).norm() < 0.1 * cell &&
               (a.Translation() - b.Translation()).norm() < 0.1 * cell;
      });
      if (!repeated) apart.push_back(c);
    }
    *candidates = std::move(apart);
  }

  // True if another hypothesis fits about as well as the best. Compared per patch, because on a
  // repetitive seabed a larger overlap is no argument.
  bool FitsAlike(const Alignment& best, const Alignment& other, double tolerance) const {
    if (!(other.evidence >= 0.5 * params_.min_evidence_nats)) return false;
    const double patches = std::min(best.DegreesOfFreedom(), other.DegreesOfFreedom());
    const double deficit = patches * (best.evidence / best.DegreesOfFreedom() -
                                      other.evidence / other.DegreesOfFreedom()) +
                           best.log_prior - other.log_prior;
    return deficit < tolerance * std::max(params_.min_evidence_nats,
                                          params_.ambiguity_margin_nats_per_patch * patches);
  }

  // --- Descend

  Solution Inform(std::size_t level, const Candidate& candidate) const {
    Solution solution{candidate, {}};
    Inform(Aligner(level, candidate.center_source), &solution.best.fit, &solution.known);
    return solution;
  }

  void Inform(const GridAligner& aligner, Alignment* fit, KnownDirections* known) const {
    fit->information = aligner.Inform(*fit);
    *known = KnownDirectionsOf(aligner, *fit, *fit->information, prior_, params_);
  }

  // Descends to finer grids as long as the information of the best candidate grows. A finer grid
  // resolves more relief, but costs more time and has more noise. Returns the level where it ends.
  std::size_t Descend(std::size_t level,
                      std::vector<Candidate>* candidates,
                      Solution* solution) const {
    while (level > 0) {
      std::vector<Candidate> finer = *candidates;
      Refine(level - 1, &finer);
      Select(level - 1, &finer);
      Solution next = Inform(level - 1, Best(finer));
      if (!(next.known.Information() > solution->known.Information() + kWorthwhileNats)) break;
      *solution = std::move(next);
      *candidates = std::move(finer);
      --level;
    }
    return level;
  }

  // Adds rivals near the best hypothesis. The coarse grid can hide nearby minima: if a patch has
  // clearly more evidence on the finer level, this level is searched as far as the kernel of the
  // search reaches.
  void AddRivalsNearby(const Candidate& best,
                       std::size_t search_level,
                       std::size_t level,
                       std::vector<Candidate>* candidates) const {
    if (best.search_evidence_per_patch >= 0.5 * best.fit.EvidencePerPatch()) return;
    const Hypothesis& at = best.fit.at;
    const double cell = levels_[level].source->cell_m();
    const double reach = kRivalReachCells * levels_[search_level].source->cell_m();
    const GridAligner aligner = Aligner(level, best.center_source);
    const Eigen::Matrix3d to_pose = aligner.CenterJacobian(at.T_target_source).inverse();
    const double sigma = reach / params_.window_sigma;
    const Eigen::Vector3d variances(sigma * sigma, sigma * sigma, kRivalYawVariance);
    RegistrationPrior around = prior_;
    around.T_target_source = at.T_target_source;
    around.covariance = to_pose * variances.asDiagonal() * to_pose.transpose();
    for (const SearchMode& mode :
         SearchWindow(*levels_[level].target, *levels_[level].source, around, params_)) {
      const Eigen::Vector2d apart =
          mode.T_target_source * best.center_source - at.T_target_source * best.center_source;
      if (apart.norm() < cell) continue;
      candidates->push_back(
          {best.center_source, aligner.Align({mode.T_target_source, at.shift_m})});
    }
  }

  // --- Judge

  LoopVerdict Judge(std::size_t level,
                    const std::vector<Candidate>& candidates,
                    Solution* solution) {
    const Eigen::Vector2d center_source = solution->best.center_source;
    const Alignment refined = solution->best.fit;
    const GridAligner aligner = Aligner(level, center_source);
    Alignment& fit = solution->best.fit;
    KnownDirections& known = solution->known;
    const bool polished = Polish(aligner, &fit, &known);
    Report(aligner, fit, known, level);
    const bool rival = FindRival(refined, center_source, candidates, known);

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
    result_.statistics = StatisticsOf(aligner, fit, known);
    return LoopVerdict::kAccepted;
  }

  // Newton steps without the prior, only along the known directions: the result must not contain
  // the prior, which the graph has already. False if they do not converge.
  bool Polish(const GridAligner& aligner, Alignment* fit, KnownDirections* known) const {
    double damping = 1.0;
    Eigen::Vector3d last_move = Eigen::Vector3d::Zero();  // in units of the prior's sigma
    for (int i = 0; i <= kMaxPolishSteps; ++i) {
      if (known->rank() == 0) return true;
      const SmallVector step = known->gain * fit->information->gradient;
      if (known->Chi2(step) < kPolishedChi2) return true;
      const Eigen::Vector3d whitened_move = known->directions * step;
      if (whitened_move.dot(last_move) < 0.0) damping *= kTurnedBackDamping;
      last_move = whitened_move;
      const Eigen::Vector3d move = damping * (known->whiten.inverse() * whitened_move);
      if (!move.allFinite()) return false;
      // On a slope the height depends on the position.
      const double lift =
          fit->information->shift_step_m + fit->information->eliminate.col(3).dot(move);
      const Hypothesis at = aligner.Moved(fit->at, {move.x(), move.y(), move.z(), lift});
      Alignment moved = aligner.Evaluate(at, fit->noise_scale);
      if (!(moved.patches >= 1.0)) {
        moved.information = std::move(fit->information);
        *fit = std::move(moved);
        return false;
      }
      *fit = std::move(moved);
      Inform(aligner, fit, known);
    }
    return false;
  }

  // True if a candidate fits as well and differs by more than the uncertainty of both.
  bool FindRival(const Alignment& best,
                 const Eigen::Vector2d& center_source,
                 const std::vector<Candidate>& candidates,
                 const KnownDirections& known) {
    bool rival = false;
    if (known.rank() == 0) return rival;
    for (const Candidate& other : candidates) {
      const Pose2& a = best.at.T_target_source;
      const Pose2& b = other.fit.at.T_target_source;
      Eigen::Vector3d apart;
      apart << b * center_source - a * center_source, WrapAngle(b.yaw - a.yaw);
      if (known.Chi2(known.Coordinates(apart)) < 2.0 * params_.max_prior_chi2) continue;
      result_.runner_up_score = std::max(result_.runner_up_score, other.fit.Score());
      rival = rival || FitsAlike(best, other.fit, 1.0);
    }
    return rival;
  }

  double PriorChi2(const GridAligner& aligner,
                   const Alignment& fit,
                   const KnownDirections& known) const {
    Eigen::Vector3d d = fit.at.T_target_source.Vector() - prior_.T_target_source.Vector();
    d[2] = WrapAngle(d[2]);
    const SmallVector c = known.Coordinates(aligner.CenterJacobian(fit.at.T_target_source) * d);
    const SmallMatrix both = known.covariance + SmallMatrix::Identity(known.rank(), known.rank());
    return c.dot(both.ldlt().solve(c));
  }

  void Report(const GridAligner& aligner,
              const Alignment& fit,
              const KnownDirections& known,
              std::size_t level) {
    const AlignmentInformation& info = *fit.information;
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
                                 const Alignment& fit,
                                 const KnownDirections& known) const {
    const AlignmentInformation& info = *fit.information;
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
  // So clear a match outside the window shows that the prior is too narrow. It is registered again
  // with a window of twice the width.
  of_cells.covariance *= 4.0;
  return Registrar(target, source, of_cells, params).Run();
}

}  // namespace seastitch
