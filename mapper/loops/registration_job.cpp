#include "mapper/loops/registration_job.hpp"

#include <exception>
#include <optional>
#include <utility>
#include <vector>

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

// prepare: returns a target ready for register_one, or null if it cannot be loaded. Only
// register_one is called by for_each.
template <class Prepare, class RegisterOne>
void RegisterAll(const Prepare& prepare,
                 const RegisterOne& register_one,
                 const ForEach& for_each,
                 RegistrationResultSet* results) {
  using Target = decltype(prepare(results->job.pairs.front()));
  struct Attempt {
    LoopPair pair;
    Target on;
    std::optional<RegistrationResult> result;
    std::int64_t failed = 0;
  };
  std::vector<Attempt> attempts;
  for (const LoopPair& pair : results->job.pairs)
    Guarded(&results->failed, [&] {
      if (auto on = prepare(pair)) attempts.push_back({pair, std::move(on), std::nullopt});
    });
  for_each(attempts.size(), [&](std::size_t i) {
    Attempt& attempt = attempts[i];
    Guarded(&attempt.failed, [&] { attempt.result = register_one(*attempt.on, attempt.pair); });
  });
  for (Attempt& attempt : attempts) {
    results->failed += attempt.failed;
    if (!attempt.result) continue;
    results->edges.push_back(ToEdge(attempt.pair, *attempt.result));
    if (!attempt.result->statistics) continue;
    attempt.result->statistics->target = attempt.pair.target;
    attempt.result->statistics->source = attempt.pair.source;
    results->statistics.push_back(*std::move(attempt.result->statistics));
  }
}

// What all registrations of a job share.
struct Shared {
  const LoopCloserParams& params;
  const LoadSubmap& load;
  const ForEach& for_each;
};

RegistrationPrior PriorOf(const LoopPair& pair, const LoopCloserParams& params) {
  return {pair.prior.T_a_b, pair.prior.covariance, pair.z_prior_m, params.z_sigma_m};
}

void RegisterByGicp(const Submap& source, const Shared& shared, RegistrationResultSet* results) {
  const auto& [params, load, for_each] = shared;
  const auto for_gicp = [&](const Submap& submap, double added_yaw_rad) {
    return GicpSubmap(
        submap.cloud, StraightFromBody(submap.T_map_submap, added_yaw_rad), params.gicp);
  };
  const GicpSubmap source_cloud = for_gicp(source, results->job.pairs.front().source_yaw_rad);
  const auto prepare = [&](const LoopPair& pair) {
    const std::shared_ptr<const Submap> target = load(pair.target);
    return target ? std::optional(for_gicp(*target, pair.target_yaw_rad)) : std::nullopt;
  };
  const auto register_one = [&](const GicpSubmap& target_cloud, const LoopPair& pair) {
    return RegisterGicp(
        target_cloud, source_cloud, PriorOf(pair, params), params.gicp, params.registration);
  };
  RegisterAll(prepare, register_one, for_each, results);
}

void RegisterByGrid(const Submap& source,
                    const Shared& shared,
                    PreparedSubmaps* prepared,
                    RegistrationResultSet* results) {
  const auto& [params, load, for_each] = shared;
  const std::shared_ptr<const RegistrationSubmap> source_surface =
      prepared->Get(source, results->job.pairs.front().source_yaw_rad);
  const auto prepare = [&](const LoopPair& pair) {
    if (auto kept = prepared->Find(pair.target, pair.target_yaw_rad)) return kept;
    const std::shared_ptr<const Submap> target = load(pair.target);
    return target ? prepared->Get(*target, pair.target_yaw_rad) : nullptr;
  };
  RegistrationParams expected = params.registration;
  if (results->job.noise) expected.noise = *results->job.noise;
  const auto register_one = [&](const RegistrationSubmap& target_surface, const LoopPair& pair) {
    return Align(target_surface, *source_surface, PriorOf(pair, params), expected);
  };
  RegisterAll(prepare, register_one, for_each, results);
}

}  // namespace

RegistrationResultSet Run(RegistrationJob job,
                          const LoopCloserParams& params,
                          const LoadSubmap& load,
                          PreparedSubmaps* prepared,
                          const ForEach& for_each) {
  RegistrationResultSet results;
  results.job = std::move(job);
  const std::shared_ptr<const Submap>& closed = results.job.closed;
  if (closed) Guarded(&results.failed, [&] { results.surface = SolutionJudge::Surface(*closed); });
  if (results.job.pairs.empty()) return results;
  Guarded(&results.failed, [&] {
    const auto source = closed ? closed : load(results.job.pairs.front().source);
    if (!source) return;
    const Shared shared{params, load, for_each};
    if (params.method == RegistrationMethod::kGicp)
      RegisterByGicp(*source, shared, &results);
    else
      RegisterByGrid(*source, shared, prepared, &results);
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
