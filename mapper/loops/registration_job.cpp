#include "mapper/loops/registration_job.hpp"

#include <exception>
#include <utility>

#include "common/core/mounting.hpp"
#include "mapper/loops/solution_judge.hpp"

namespace seastitch {
namespace {

// Calls work; counts an exception.
template <class Work>
void Guarded(std::int64_t* failed, const Work& work) {
  try {
    work();
  } catch (const std::exception&) {
    ++*failed;
  }
}

// prepare: returns a target ready for register_one, or null if it cannot be loaded.
template <class Prepare, class RegisterOne>
void RegisterAll(const Prepare& prepare,
                 const RegisterOne& register_one,
                 RegistrationResultSet* results) {
  for (const LoopPair& pair : results->job.pairs) {
    Guarded(&results->failed, [&] {
      const auto on = prepare(pair);
      if (!on) return;
      RegistrationResult result = register_one(*on, pair);
      results->edges.push_back(ToEdge(pair, result));
      if (!result.statistics) return;
      result.statistics->target = pair.target;
      result.statistics->source = pair.source;
      results->statistics.push_back(*std::move(result.statistics));
    });
  }
}

RegistrationPrior PriorOf(const LoopPair& pair, const LoopCloserParams& params) {
  return {pair.prior.T_a_b, pair.prior.covariance, pair.z_prior_m, params.z_sigma_m};
}

void RegisterByGicp(const Submap& source,
                    const LoopCloserParams& params,
                    const LoadSubmap& load,
                    RegistrationResultSet* results) {
  const auto for_gicp = [&](const Submap& submap, double added_yaw_rad) {
    return GicpSubmap(
        submap.cloud, StraightFromBody(submap.T_map_submap, added_yaw_rad), params.gicp);
  };
  const GicpSubmap laid = for_gicp(source, results->job.pairs.front().source_yaw_rad);
  const auto prepare = [&](const LoopPair& pair) {
    const std::shared_ptr<const Submap> target = load(pair.target);
    return target ? std::optional(for_gicp(*target, pair.target_yaw_rad)) : std::nullopt;
  };
  const auto register_one = [&](const GicpSubmap& on, const LoopPair& pair) {
    return RegisterGicp(on, laid, PriorOf(pair, params), params.gicp, params.registration);
  };
  RegisterAll(prepare, register_one, results);
}

void RegisterByGrid(const Submap& source,
                    const LoopCloserParams& params,
                    const LoadSubmap& load,
                    PreparedSubmaps* prepared,
                    RegistrationResultSet* results) {
  const std::shared_ptr<const RegistrationSubmap> laid =
      prepared->Get(source, results->job.pairs.front().source_yaw_rad);
  const auto prepare = [&](const LoopPair& pair) {
    if (auto kept = prepared->Find(pair.target, pair.target_yaw_rad)) return kept;
    const std::shared_ptr<const Submap> target = load(pair.target);
    return target ? prepared->Get(*target, pair.target_yaw_rad) : nullptr;
  };
  RegistrationParams expected = params.registration;
  if (results->job.noise) expected.noise = *results->job.noise;
  const auto register_one = [&](const RegistrationSubmap& on, const LoopPair& pair) {
    return Align(on, *laid, PriorOf(pair, params), expected);
  };
  RegisterAll(prepare, register_one, results);
}

}  // namespace

RegistrationResultSet Run(RegistrationJob job,
                          const LoopCloserParams& params,
                          const LoadSubmap& load,
                          PreparedSubmaps* prepared) {
  RegistrationResultSet results;
  results.job = std::move(job);
  const std::shared_ptr<const Submap>& closed = results.job.closed;
  if (closed) Guarded(&results.failed, [&] { results.surface = SolutionJudge::Surface(*closed); });
  if (results.job.pairs.empty()) return results;
  Guarded(&results.failed, [&] {
    const auto source = closed ? closed : load(results.job.pairs.front().source);
    if (!source) return;
    if (params.method == RegistrationMethod::kGicp)
      RegisterByGicp(*source, params, load, &results);
    else
      RegisterByGrid(*source, params, load, prepared, &results);
  });
  return results;
}

GraphEdge ToEdge(const LoopPair& pair, const RegistrationResult& result) {
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from = pair.target;
  edge.to = pair.source;
  edge.T_from_to = result.T_target_source;
  edge.information = result.information;
  edge.verdict = result.verdict;
  edge.z_offset_m = result.z_offset_m;
  edge.rms_m = result.rms_m;
  edge.overlap_m2 = result.overlap_m2;
  edge.overlap_center_m = result.overlap_center_m;
  edge.dvl_yaw_rad = pair.dvl_yaw_rad;
  return edge;
}

}  // namespace seastitch
