#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "mapper/loop_closer.hpp"
#include "mapper/registration/prepared_submaps.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// Registrations of one source submap, to be run wherever there is time. Owns what it needs.
struct RegistrationJob {
  std::shared_ptr<const Submap> closed;  // joins the graph with the result; null: looked at again
  std::vector<LoopPair> pairs;           // of one source
  // That the registrations expect; absent: params.registration.noise.
  std::optional<VarianceComponents> noise{};
};

struct RegistrationResultSet {
  RegistrationJob job;
  std::vector<GraphEdge> edges;               // in the order of the pairs; not of every pair
  std::vector<ClosureStatistics> statistics;  // of those accepted, in their order
  std::optional<RegistrationSubmap> surface;  // of job.closed, for the do-no-harm check
  std::int64_t failed = 0;                    // registrations that ended in an exception
};

// The cloud of a closed submap; null where it cannot be had.
using LoadSubmap = std::function<std::shared_ptr<const Submap>(SubmapId)>;

// Registers the source on each of its targets. A target that is prepared is not loaded; one that
// cannot be loaded gives no edge. An exception costs the pair that it came from, is counted and
// goes no further. prepared: of params.registration. Pure but for `load`.
RegistrationResultSet Run(RegistrationJob job,
                          const LoopCloserParams& params,
                          const LoadSubmap& load,
                          PreparedSubmaps* prepared);

// Loop-closure edge of a registration result.
GraphEdge ToEdge(const LoopPair& pair, const RegistrationResult& result);

}  // namespace seastitch
