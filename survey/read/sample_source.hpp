#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"

namespace seastitch {

// The samples of a dive, in the order of their reception: from logs, or from survey files.
class SampleSource {
 public:
  virtual ~SampleSource() = default;

  // The next sample; absent at the end. Throws std::runtime_error naming a file that cannot be read
  // to its end.
  virtual std::optional<Received> Next() = 0;
  // The input of the last sample, numbered from 0.
  virtual std::size_t input() const = 0;
  virtual int percent_read() const = 0;
  // What was not used so far, by reason.
  virtual Counters refused() const = 0;
  // Faults of the messages that hold at the last sample.
  virtual std::vector<Condition> conditions() const { return {}; }
};

}  // namespace seastitch
