#include "optimizer/robust_solver.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace seastitch {
namespace {

bool IsRobust(const Factor& factor) { return std::isfinite(factor.loss.c2); }

double SquaredResidual(const FactorGraph& graph, std::size_t k, const std::vector<Pose2>& poses) {
  return Residual(graph, k, poses).squaredNorm();
}

// What the robust losses, all together, are at the moment. Plain squares stay what they are.
struct Stage {
  enum class Shape {
    kSquares,    // s
    kGraduated,  // GraduatedLoss at mu
  };
  Shape shape = Shape::kSquares;
  double mu = GraduatedLoss::kFinalMu;
  std::vector<bool> on;  // one a factor; off: nothing
  // As how many, at most, those count together that may share one error.
  double cluster_counts = kEachForItself;

  static constexpr double kEachForItself = std::numeric_limits<double>::infinity();

  double Share(const Factor& factor) const {
    return std::min(1.0, cluster_counts / factor.cluster_size);
  }
  double Value(const Factor& factor, std::size_t k, double s) const {
    if (!IsRobust(factor)) return s;
    if (!on[k]) return 0.0;
    return Share(factor) * (shape == Shape::kGraduated ? factor.loss.Value(s, mu) : s);
  }
  double Weight(const Factor& factor, std::size_t k, double s) const {
    if (!IsRobust(factor)) return 1.0;
    if (!on[k]) return 0.0;
    return Share(factor) * (shape == Shape::kGraduated ? factor.loss.Weight(s, mu) : 1.0);
  }
  double Bend(const Factor& factor, std::size_t k, double s) const {
    const bool bends = IsRobust(factor) && on[k] && shape == Shape::kGraduated;
    return bends ? Share(factor) * factor.loss.Bend(s, mu) : 0.0;
  }
};

// Newton's method on the poses of a graph, under one stage after another. A factor of H costs as
// much as twenty solves with it, so that it is kept, and preconditions conjugate gradients, until
// they take too many iterations.
class Minimiser {
 public:
  explicit Minimiser(const FactorGraph& graph) : graph_(graph), equations_(graph) {}

  void StartFrom(std::vector<Pose2> poses) {
    poses_ = std::move(poses);
    equations_.Linearise(poses_);
  }

  // Near the minimum of the squares of those that are on, from anywhere: first the headings, which
  // alone make the problem non-linear, then the positions. Stays where it is where some vertex is
  // tied to nothing.
  void StartFromHeadings(const Stage& squares, const std::vector<Pose2>& poses) {
    StartFrom(poses);
    const std::vector<double> weights = Weights(squares);
    for (const auto unknowns :
         {NormalEquations::Unknowns::kHeadings, NormalEquations::Unknowns::kPositions}) {
      equations_.Linearise(poses_, unknowns);
      if (!equations_.Factorize(weights)) break;
      poses_ = PosesAfter(equations_.Step(weights).by);
    }
    has_factor_ = false;
    equations_.Linearise(poses_);
  }

  // So many steps of re-weighted least squares, as far as they lead down.
  void Descend(const Stage& stage, int steps) {
    for (int n = 0; n < steps; ++n)
      if (ReweightedStep(stage) == 0.0) return;
  }

  // One step at the weights given, with the bends of the stage where they are below 1; false where
  // none is possible.
  bool Step(const Stage& stage, const std::vector<double>& weights) {
    std::vector<double> bends = Bends(stage);
    for (std::size_t k = 0; k < bends.size(); ++k)
      if (weights[k] == 1.0) bends[k] = 0.0;
    const std::optional<NewtonStep> step = Direction(weights, bends);
    if (step) StartFrom(PosesAfter(step->by));
    return step.has_value();
  }

  // Until the poses stand still. False where so many steps are not enough.
  bool Minimise(const Stage& stage, int max_steps) {
    double last = std::numeric_limits<double>::infinity();
    for (int n = 0; n < max_steps; ++n) {
      const double sigmas = BestStep(stage);
      if (sigmas < kStill || (sigmas < kStiff && sigmas > kShrinks * last)) return true;
      last = sigmas;
    }
    return false;
  }

  // Of the poses, each factor at its weight. Nothing where some vertex is tied to nothing.
  std::optional<GraphCovariance> Covariance(const std::vector<double>& weights, int newest) {
    has_factor_ = equations_.Factorize(weights);
    if (!has_factor_) return std::nullopt;
    return equations_.Covariance(newest);
  }

  std::vector<double> Weights(const Stage& stage) const {
    std::vector<double> weights;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      weights.push_back(stage.Weight(graph_.factors[k], k, equations_.SquaredResidual(k)));
    return weights;
  }

  // The largest squared residual of those that are on, in units of its threshold.
  double WorstRatio(const Stage& stage) const {
    double worst = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      if (stage.on[k])
        worst = std::max(worst, equations_.SquaredResidual(k) / graph_.factors[k].loss.c2);
    return worst;
  }

  const std::vector<Pose2>& poses() const { return poses_; }

 private:
  // Steps below the first [standard deviations] are rounding; below the second they may be, where
  // they shrink no more.
  static constexpr double kStill = 1e-6;
  static constexpr double kStiff = 1e-5;
  static constexpr double kShrinks = 0.5;
  static constexpr int kMaxHalvings = 4;
  static constexpr int kMaxDoublings = 10;
  static constexpr int kMaxIterations = 12;  // of conjugate gradients
  static constexpr int kManyIterations = 7;  // from here on a new factor pays

  std::vector<double> Bends(const Stage& stage) const {
    std::vector<double> bends;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      bends.push_back(stage.Bend(graph_.factors[k], k, equations_.SquaredResidual(k)));
    return bends;
  }

  // Of the cost, from where the squared residuals were these. Summed as differences: of the costs
  // of a large graph too few digits are left.
  double ChangeFrom(const std::vector<double>& before, const Stage& stage) const {
    double change = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      change +=
          stage.Value(factor, k, equations_.SquaredResidual(k)) - stage.Value(factor, k, before[k]);
    }
    return change;
  }

  std::vector<double> SquaredResiduals() const {
    std::vector<double> squared;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      squared.push_back(equations_.SquaredResidual(k));
    return squared;
  }

  std::vector<Pose2> PosesAfter(const Eigen::VectorXd& by) const {
    std::vector<Pose2> poses = poses_;
    for (std::size_t v = 0; v < poses.size(); ++v) {
      const auto d = by.segment<3>(3 * static_cast<Eigen::Index>(v));
      poses[v] = {poses[v].x + d.x(), poses[v].y + d.y(), poses[v].yaw + d.z()};
    }
    return poses;
  }

  // False, and nothing moved, where the step leads up.
  bool Try(const Stage& stage, const NewtonStep& step) {
    const std::vector<Pose2> here = poses_;
    const std::vector<double> before = SquaredResiduals();
    StartFrom(PosesAfter(step.by));
    const bool leads_down = step.sigmas < kStiff || ChangeFrom(before, stage) <= 0.0;
    if (!leads_down) StartFrom(here);
    return leads_down;
  }

  // -H^-1 g. What conjugate gradients have when they run out of iterations leads down all the same.
  std::optional<NewtonStep> Direction(const std::vector<double>& weights,
                                      const std::vector<double>& bends) {
    if (has_factor_) {
      NewtonStep step = equations_.IteratedStep(weights, bends, kMaxIterations);
      has_factor_ = step.iterations < kManyIterations;
      return step;
    }
    has_factor_ = equations_.FactorizeNewton(weights, bends);
    if (!has_factor_) return std::nullopt;
    return equations_.Step(weights);
  }

  // With the bends, or half of it and so on where that leads up. Gives the length of the whole step
  // in standard deviations; 0 where none leads down.
  double BestStep(const Stage& stage) {
    std::optional<NewtonStep> step = Direction(Weights(stage), Bends(stage));
    for (int n = 0; step && n < kMaxHalvings; ++n) {
      if (Try(stage, *step)) {
        if (n == 0 && step->bends_down) GoFurther(stage, *step);
        return step->sigmas;
      }
      step->by *= 0.5;
    }
    return ReweightedStep(stage);
  }

  // Where losses bend down, as between believing and refusing a closure, the step is far too short:
  // on in its direction, by as much, twice as much and so on, while that leads down.
  void GoFurther(const Stage& stage, NewtonStep step) {
    step.sigmas = std::numeric_limits<double>::infinity();
    for (int n = 0; n < kMaxDoublings && Try(stage, step); ++n) step.by *= 2.0;
  }

  // Without the bends, which always leads down in the end: damped after Levenberg and Marquardt
  // where the plain step does not.
  double ReweightedStep(const Stage& stage) {
    const std::vector<double> weights = Weights(stage);
    const auto step = Direction(weights, std::vector<double>(weights.size(), 0.0));
    if (step && Try(stage, *step)) return step->sigmas;
    has_factor_ = false;
    for (double damping = 1e-3; damping < 1e6; damping *= 10.0) {
      if (!equations_.Factorize(weights, damping)) continue;
      if (const NewtonStep damped = equations_.Step(weights); Try(stage, damped))
        return damped.sigmas;
    }
    return 0.0;
  }

  const FactorGraph& graph_;
  NormalEquations equations_;
  bool has_factor_ = false;
  std::vector<Pose2> poses_;
};

// Where every weight is still above zero: the paper's remark 5.
double FirstMu(double worst_ratio) {
  const double mu = 1.0 / (2.0 * worst_ratio - 1.0);
  return mu > 0.0 ? std::min(mu, GraduatedLoss::kFinalMu) : GraduatedLoss::kFinalMu;
}

// Squared Mahalanobis distance of what the factor says from what the graph without it says, from
// the residual r and its open part A (GraphCovariance::of_residual) in a graph that has the factor
// with weight w: innovation (I - w A)^-1 r, of covariance I + A (I - w A)^-1.
double InnovationSquared(const Eigen::Vector3d& r, const Eigen::Matrix3d& A, double w) {
  constexpr double kLeastRedundancy = 1e-7;  // below, nothing but the factor itself speaks of it
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
  const Eigen::Vector3d r_k = eigen.eigenvectors().transpose() * r;
  double squared = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double open = std::max(eigen.eigenvalues()(k), 0.0);
    const double redundancy = std::max(1.0 - w * open, kLeastRedundancy);
    const double innovation = r_k(k) / redundancy;
    squared += innovation * innovation / (1.0 + open / redundancy);
  }
  return squared;
}

double InnovationSquared(const FactorGraph& graph, std::size_t k, const RobustSolution& solution) {
  return InnovationSquared(Residual(graph, k, solution.T_map_vertex),
                           solution.covariance->of_residual[k],
                           solution.weights[k]);
}

// 0.999 of chi-square, 3 degrees of freedom.
constexpr double kThreshold = 16.27;

// By how much dead reckoning's squared errors exceed what it says of them: the median of its
// innovations, so that the few that wrong closures spoil do not count. Around one loop all are the
// same, right or wrong: of few nothing is concluded, and of many no more than surveys have shown.
double DeadReckoningScale(const FactorGraph& graph, const RobustSolution& solution) {
  constexpr double kMedian = 2.366;    // of chi-square, 3 degrees of freedom
  constexpr double kUnchecked = 1e-3;  // below, no closure speaks of the step
  constexpr std::size_t kFew = 10;
  constexpr double kMaxScale = 4.0;
  if (!solution.covariance) return 1.0;
  std::vector<double> squared;
  for (std::size_t k = 0; k < graph.factors.size(); ++k) {
    if (!graph.factors[k].is_step) continue;
    const double s = InnovationSquared(graph, k, solution);
    if (s > kUnchecked) squared.push_back(s);
  }
  if (squared.size() < kFew) return 1.0;
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::clamp(*middle / kMedian, 1.0, kMaxScale);
}

// Of a factor that is believed: how far it lies from all else, in units of twice its threshold:
// beyond 1 goes one honest one in millions, so that a large sound graph is solved once. 0 up to 1.
double Strain(const FactorGraph& graph, std::size_t k, const RobustSolution& solution) {
  const Factor& factor = graph.factors[k];
  const double threshold =
      IsRobust(factor) ? factor.loss.c2 : kThreshold * solution.dead_reckoning_scale;
  const double limit = 2.0 * threshold;
  // Most pass by a bound on the innovation: no eigenvalue of A exceeds its trace.
  const double redundancy = 1.0 - solution.covariance->of_residual[k].trace();
  const double s = SquaredResidual(graph, k, solution.T_map_vertex);
  if (redundancy > 0.0 && s <= limit * redundancy * redundancy) return 0.0;
  const double strain = InnovationSquared(graph, k, solution) / limit;
  return strain > 1.0 ? strain : 0.0;
}

// Of a factor that is refused: by how much it would fit what the others say, its threshold over its
// distance. 0 up to 1.
double Fit(const FactorGraph& graph, std::size_t k, const RobustSolution& solution) {
  const double fit = graph.factors[k].loss.c2 / InnovationSquared(graph, k, solution);
  return fit > 1.0 ? fit : 0.0;
}

std::vector<double> Doubts(const FactorGraph& graph, const RobustSolution& solution) {
  std::vector<double> doubts(graph.factors.size(), 0.0);
  if (!solution.covariance) return doubts;
  for (std::size_t k = 0; k < doubts.size(); ++k) {
    // A mounting further off than was thought is what is sought.
    if (graph.factors[k].j == graph.mounting_vertex) continue;
    doubts[k] = solution.weights[k] > 0.0 ? Strain(graph, k, solution) : Fit(graph, k, solution);
  }
  return doubts;
}

bool IsAnyStrained(const RobustSolution& solution) {
  for (std::size_t k = 0; k < solution.weights.size(); ++k)
    if (solution.weights[k] > 0.0 && solution.doubts[k] > 0.0) return true;
  return false;
}

// The thresholds pass over so many honest ones by chance; with no weight at all are fewer still.
bool RefusesMoreThanChance(const FactorGraph& graph,
                           const RobustSolution& solution,
                           double inlier_probability) {
  const double by_chance = 2.0 * (1.0 - inlier_probability);
  const auto refused = std::count(solution.weights.begin(), solution.weights.end(), 0.0);
  const auto robust = std::count_if(graph.factors.begin(), graph.factors.end(), IsRobust);
  return static_cast<double>(refused) > by_chance * static_cast<double>(robust);
}

class RobustSolver {
 public:
  RobustSolver(const FactorGraph& graph, int newest, const SolverParams& params)
      : graph_(graph),
        minimiser_(graph),
        all_(graph.factors.size(), true),
        newest_(newest),
        params_(params) {}

  RobustSolution Solve(const SolverStart& start) {
    if (auto solution = GoOn(start)) return *std::move(solution);
    RobustSolution solution = FromDeadReckoning(start.dead_reckoned);
    solution.scale_when_chosen = solution.dead_reckoning_scale;
    return solution;
  }

 private:
  RobustSolution FromDeadReckoning(const std::vector<Pose2>& dead_reckoned) {
    RobustSolution solution = Graduate(dead_reckoned, all_, Stage::kEachForItself);
    if (!CallsForASecond(solution)) return solution;
    const double cluster_counts = kClusterCounts * solution.dead_reckoning_scale;
    RobustSolution other =
        Graduate(dead_reckoned, NearDeadReckoning(dead_reckoned), cluster_counts);
    return CostByClusters(other, cluster_counts) < CostByClusters(solution, cluster_counts)
               ? other
               : solution;
  }

  bool CallsForASecond(const RobustSolution& solution) const {
    return RefusesMoreThanChance(graph_, solution, params_.inlier_probability) ||
           IsAnyStrained(solution);
  }

  // On from the last solution, where what is new contradicts nothing: every new robust factor is
  // believed, every old one weighs what it did, none is more in doubt than when the graph was
  // last solved from dead reckoning, and the votes would be as many as then.
  std::optional<RobustSolution> GoOn(const SolverStart& start) {
    if (start.T_map_vertex.empty()) return std::nullopt;
    std::vector<double> weights;
    for (const std::optional<double>& weight : start.weights)
      weights.push_back(weight.value_or(1.0));
    minimiser_.StartFrom(start.T_map_vertex);
    if (!minimiser_.Step(last_stage(), weights) ||
        !AreAlike(weights, minimiser_.Weights(last_stage())) ||
        !minimiser_.Minimise(last_stage(), params_.max_iterations))
      return std::nullopt;
    RobustSolution solution = JudgedSolution(true);
    if (!AreAlike(weights, solution.weights) || HasAnyChanged(start.doubts, solution.doubts) ||
        (CallsForASecond(solution) &&
         HasChanged(start.scale_when_chosen, solution.dead_reckoning_scale)))
      return std::nullopt;
    solution.doubts = start.doubts;
    solution.scale_when_chosen = start.scale_when_chosen;
    return solution;
  }

  static bool HasChanged(double before, double now) {
    return now > kSame * before || before > kSame * now;
  }

  static bool AreAlike(const std::vector<double>& a, const std::vector<double>& b) {
    constexpr double kSameWeight = 0.2;  // what a verdict may move without being another one
    return std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
      return std::abs(x - y) < kSameWeight;
    });
  }

  static bool HasAnyChanged(const std::vector<double>& before, const std::vector<double>& now) {
    return !std::equal(before.begin(), before.end(), now.begin(), [](double x, double y) {
      return !HasChanged(x, y);
    });
  }

  // From dead reckoning to near the minimum of the squares of those that are on, and on to the
  // robust minimum of all, each for itself: how clusters count is for finding it alone.
  RobustSolution Graduate(const std::vector<Pose2>& dead_reckoned,
                          const std::vector<bool>& on,
                          double cluster_counts) {
    const Stage squares{Stage::Shape::kSquares, 0.0, on, cluster_counts};
    minimiser_.StartFromHeadings(squares, dead_reckoned);
    minimiser_.Descend(squares, kStepsForSquares);
    for (double mu = FirstMu(minimiser_.WorstRatio(squares)); mu < GraduatedLoss::kFinalMu;
         mu *= params_.graduation_step)
      minimiser_.Descend({Stage::Shape::kGraduated, mu, on, cluster_counts}, kStepsAStage);
    minimiser_.Descend(last_stage(cluster_counts), kStepsAStage);
    const bool converged = minimiser_.Minimise(last_stage(), params_.max_iterations);
    return JudgedSolution(converged);
  }

  // Where the minimiser stands, and how well that holds together.
  RobustSolution JudgedSolution(bool converged) {
    RobustSolution solution = Solution();
    solution.converged = converged;
    FindCovariance(&solution);
    solution.dead_reckoning_scale = DeadReckoningScale(graph_, solution);
    solution.doubts = Doubts(graph_, solution);
    return solution;
  }

  // Where the minimiser stands.
  RobustSolution Solution() const {
    RobustSolution solution;
    solution.T_map_vertex = minimiser_.poses();
    solution.weights = minimiser_.Weights(last_stage());
    return solution;
  }

  // For the choice between two: a step of dead reckoning that many clusters contradict is at fault,
  // however far off.
  double CostByClusters(const RobustSolution& solution, double cluster_counts) {
    const Stage stage = last_stage(cluster_counts);
    double cost = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      const double value =
          stage.Value(factor, k, SquaredResidual(graph_, k, solution.T_map_vertex));
      const bool is_plain_step = factor.i != kMap && !IsRobust(factor);
      cost += is_plain_step ? std::min(value, kFault) : value;
    }
    return cost;
  }

  void FindCovariance(RobustSolution* solution) {
    solution->covariance = minimiser_.Covariance(solution->weights, newest_);
  }

  // The factors that lie within the chi-square gate of dead reckoning alone.
  std::vector<bool> NearDeadReckoning(const std::vector<Pose2>& dead_reckoned) {
    const Stage alone{Stage::Shape::kSquares, 0.0, std::vector<bool>(all_.size(), false)};
    minimiser_.StartFrom(dead_reckoned);
    RobustSolution solution = Solution();
    solution.weights = minimiser_.Weights(alone);
    FindCovariance(&solution);
    std::vector<bool> near(all_.size(), false);
    if (!solution.covariance) return near;
    for (std::size_t k = 0; k < near.size(); ++k)
      near[k] = InnovationSquared(graph_, k, solution) < graph_.factors[k].loss.c2;
    return near;
  }

  Stage last_stage(double cluster_counts = Stage::kEachForItself) const {
    return {Stage::Shape::kGraduated, GraduatedLoss::kFinalMu, all_, cluster_counts};
  }

  static constexpr double kClusterCounts = 2.0;  // where dead reckoning is as good as it says
  static constexpr double kFault = 80.0;  // two and a half clusters, where these count as two
  static constexpr double kSame = 1.02;   // doubts and votes up to so many times each other
  static constexpr int kStepsForSquares = 3;
  static constexpr int kStepsAStage = 2;

  const FactorGraph& graph_;
  Minimiser minimiser_;
  const std::vector<bool> all_;
  const int newest_;
  const SolverParams params_;
};

}  // namespace

RobustSolution SolveRobust(const FactorGraph& graph,
                           const SolverStart& start,
                           int newest,
                           const SolverParams& params) {
  return RobustSolver(graph, newest, params).Solve(start);
}

}  // namespace seastitch
