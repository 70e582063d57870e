#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/core/survey_noise.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Record of the time offsets that navigation suspected and corrected in a dive: of each sensor the
// estimate with the smallest sigma. Navigation itself forgets an offset within minutes, so that the
// last state of a dive may have none. Pure.
class StampOffsetRecord {
 public:
  explicit StampOffsetRecord(const NavigationParams& params) : params_(params) {}

  // Call it after navigation has taken a sample.
  void Look(const Navigation& navigation);
  std::vector<StampOffsetEstimate> estimates() const;

 private:
  struct Best {
    SuspectedOffset offset;
    double suspected_s = 0.0;
  };

  const NavigationParams params_;
  std::map<NavSensor, Best> best_;
  std::optional<Time> looked_;
};

}  // namespace seastitch
