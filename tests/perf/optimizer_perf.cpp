#include <benchmark/benchmark.h>

#include <cstdint>

#include "common/core/information.hpp"
#include "optimizer/normal_equations.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "optimizer/robust_solver.hpp"
#include "tests/optimizer/ceres_solver.hpp"
#include "tests/optimizer/survey_graph.hpp"

// The optimizer on lawn-mower surveys of N submaps in lines of 50, 5 loop closures each. Argument
// 2: wrong closures in percent. Times include the covariances.
namespace seastitch {
namespace {

SurveyGraph Survey(const benchmark::State& state) {
  SurveyOptions options;
  options.vertices = static_cast<int>(state.range(0));
  options.per_line = options.vertices < 500 ? 10 : 50;
  options.wrong_among = 3 * options.closures;
  options.wrong_share = 0.01 * static_cast<double>(state.range(1));
  return SimulateSurvey(options);
}

void BM_OptimizerFullSolve(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  for (auto _ : state) {
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    for (const GraphUpdate& update : survey.updates) optimizer.Add(update);
    benchmark::DoNotOptimize(optimizer.Solve());
  }
}

void BM_OptimizerOneMoreVertex(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  PoseGraphOptimizer without{OptimizerParams{}};
  for (std::size_t k = 0; k + 1 < survey.updates.size(); ++k) without.Add(survey.updates[k]);
  without.Solve();
  for (auto _ : state) {
    state.PauseTiming();
    PoseGraphOptimizer optimizer = without;
    optimizer.Add(survey.updates.back());
    state.ResumeTiming();
    benchmark::DoNotOptimize(optimizer.Solve());
  }
}

void BM_OptimizerCovariance(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  FactorGraph graph{static_cast<int>(survey.truth.size()), 0, {}};
  for (const GraphUpdate& update : survey.updates)
    for (const GraphEdge& e : update.edges)
      graph.factors.push_back(
          {e.from.value, e.to.value, {e.T_from_to, FactorInformation(e.information)->W}, {}});
  const std::vector<double> weights(graph.factors.size(), 1.0);
  for (auto _ : state) {
    NormalEquations equations(graph);
    equations.Linearise(survey.truth);
    equations.Factorize(weights);
    benchmark::DoNotOptimize(equations.Covariance(graph.num_vertices - 1));
  }
}

// What the mapper asks for after a solution, at most: 16 submaps with 31 others each.
void BM_OptimizerPairCovariances(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : survey.updates) optimizer.Add(update);
  optimizer.Solve();
  std::vector<std::pair<SubmapId, SubmapId>> pairs;
  for (int k = 0; k < 16; ++k)
    for (int i = 1; i <= 31; ++i) {
      const int b = 40 + k * (static_cast<int>(survey.truth.size()) - 41) / 15;
      pairs.emplace_back(SubmapId{b - i}, SubmapId{b});
    }
  for (auto _ : state) benchmark::DoNotOptimize(optimizer.RelativeCovariances(pairs));
}

// The same problem for both: plain squares from dead reckoning, for Ceres knows no graduation.
struct SquaresProblem {
  FactorGraph graph;
  SolverStart start;
};
SquaresProblem Squares(const SurveyGraph& survey) {
  SquaresProblem problem{{static_cast<int>(survey.truth.size()), 0, {}}, {}};
  for (const GraphUpdate& update : survey.updates) {
    problem.start.dead_reckoned.push_back(update.vertices[0].dead_reckoned);
    for (const GraphEdge& e : update.edges)
      problem.graph.factors.push_back(
          {e.from.value, e.to.value, {e.T_from_to, FactorInformation(e.information)->W}, {}});
  }
  return problem;
}

// Poses and covariances.
void BM_OptimizerSquares(benchmark::State& state) {
  const SquaresProblem problem = Squares(Survey(state));
  for (auto _ : state)
    benchmark::DoNotOptimize(
        SolveRobust(problem.graph, problem.start, problem.graph.num_vertices - 1, {}));
}

// Poses alone.
void BM_CeresSquares(benchmark::State& state) {
  const SquaresProblem problem = Squares(Survey(state));
  for (auto _ : state)
    benchmark::DoNotOptimize(SolveWithCeres(problem.graph, problem.start.dead_reckoned, 1e-8));
}

void SizesWithoutWrong(benchmark::internal::Benchmark* b) {
  for (const std::int64_t vertices : {100, 1000, 10000}) b->Args({vertices, 0});
  b->ArgNames({"vertices", "wrong_percent"})->Unit(benchmark::kMillisecond);
}

void Sizes(benchmark::internal::Benchmark* b) {
  for (const std::int64_t vertices : {100, 1000, 10000})
    for (const std::int64_t wrong_percent : {0, 10}) b->Args({vertices, wrong_percent});
  b->ArgNames({"vertices", "wrong_percent"})->Unit(benchmark::kMillisecond);
}

BENCHMARK(BM_OptimizerFullSolve)->Apply(Sizes);
BENCHMARK(BM_OptimizerOneMoreVertex)->Apply(Sizes);
BENCHMARK(BM_OptimizerCovariance)->Apply(Sizes);
BENCHMARK(BM_OptimizerPairCovariances)->Apply(SizesWithoutWrong);
BENCHMARK(BM_OptimizerSquares)->Apply(SizesWithoutWrong);
BENCHMARK(BM_CeresSquares)->Apply(SizesWithoutWrong);

}  // namespace
}  // namespace seastitch
