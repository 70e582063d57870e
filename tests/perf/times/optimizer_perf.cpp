#include <benchmark/benchmark.h>

#include <cstdint>

#include "common/core/information.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "optimizer/solver/graph_covariance.hpp"
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

// Of the last 50 submaps, closures as they come: the mean.
void BM_OptimizerOneMoreVertex(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  const std::size_t before = survey.updates.size() - 50;
  PoseGraphOptimizer without{OptimizerParams{}};
  for (std::size_t k = 0; k < before; ++k) without.Add(survey.updates[k]);
  without.Solve();
  PoseGraphOptimizer optimizer = without;
  std::size_t next = before;
  for (auto _ : state) {
    if (next == survey.updates.size()) {
      state.PauseTiming();
      optimizer = without;
      next = before;
      state.ResumeTiming();
    }
    optimizer.Add(survey.updates[next++]);
    benchmark::DoNotOptimize(optimizer.Solve());
  }
}

void BM_OptimizerCovariance(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  FactorGraph graph{static_cast<int>(survey.truth.size()), 0, {}};
  for (const GraphUpdate& update : survey.updates)
    for (const GraphEdge& e : update.edges)
      graph.factors.push_back(
          {e.from.value, e.to.value, e.T_from_to, FactorInformation(e.information)->W});
  const std::vector<double> weights(graph.factors.size(), 1.0);
  for (auto _ : state) benchmark::DoNotOptimize(GraphCovariance::At(graph, survey.truth, weights));
}

// What may be asked for at once: 500 pairs, each of its own two submaps where there are as many.
void BM_OptimizerPairCovariances(benchmark::State& state) {
  const SurveyGraph survey = Survey(state);
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : survey.updates) optimizer.Add(update);
  optimizer.Solve();
  const int last = static_cast<int>(survey.truth.size()) - 1;
  std::vector<std::pair<SubmapId, SubmapId>> pairs;
  for (int k = 0; k < 500; ++k) {
    const int b = 50 + k * (last - 50) / 499;
    pairs.emplace_back(SubmapId{b - 50}, SubmapId{b});
  }
  for (auto _ : state) benchmark::DoNotOptimize(optimizer.RelativeCovariances(pairs));
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
BENCHMARK(BM_OptimizerOneMoreVertex)->Apply(Sizes)->Iterations(50);
BENCHMARK(BM_OptimizerCovariance)->Apply(Sizes);
BENCHMARK(BM_OptimizerPairCovariances)->Apply(SizesWithoutWrong);

}  // namespace
}  // namespace seastitch
