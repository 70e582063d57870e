#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/for_each.hpp"
#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "mapper/loops/loop_closer.hpp"
#include "mapper/registration/prepared_submaps.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// Job: registrations of one source submap, to be run on any thread. Owns what it needs.
struct RegistrationJob {
  std::shared_ptr<const Submap> closed;  // joins the graph with the results; null: retries
  std::vector<LoopPair> pairs;           // of one source
  // Noise that the registrations expect; std::nullopt: params.registration.noise.
  std::optional<VarianceComponents> noise{};
};

struct RegistrationResultSet {
  RegistrationJob job;
  std::vector<GraphEdge> edges;               // in the order of the pairs; not of every pair
  std::vector<ClosureStatistics> statistics;  // of those accepted, in their order
  std::optional<RegistrationSubmap> surface;  // of job.closed, for the do-no-harm check
  std::int64_t failed = 0;                    // registrations that ended in an exception
};

// Loads a closed submap with its cloud; null where it cannot be loaded.
using LoadSubmap = std::function<std::shared_ptr<const Submap>(SubmapId)>;

// Registers the source on each of its targets. A target that is in `prepared` is not loaded; one
// that cannot be loaded gives no edge. An exception ends the registration of its pair only, and is
// counted. prepared: cache of submaps prepared with params.registration. for_each: runs the
// registrations. Pure, except for `load`.
RegistrationResultSet Run(RegistrationJob job,
                          const LoopCloserParams& params,
                          const LoadSubmap& load,
                          PreparedSubmaps* prepared,
                          const ForEach& for_each = ForEachInTurn);

// Loop-closure edge of a registration result.
GraphEdge ToEdge(const LoopPair& pair, const RegistrationResult& result);

}  // namespace seastitch
