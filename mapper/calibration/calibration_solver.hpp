#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "common/core/calibration.hpp"
#include "common/core/time.hpp"
#include "mapper/calibration/overlap_rows.hpp"

namespace seastitch {

// Rows of two submaps, by their index.
struct OverlapOfPair {
  std::size_t target = 0;
  std::size_t source = 0;
  std::vector<OverlapRow> rows;
};

// Calls a function with every pair of submaps, always the same in the same order.
using ForEachPair = std::function<void(const std::function<void(const OverlapOfPair&)>&)>;

// Estimate of the integration errors of a survey from the overlaps of its submaps: least squares
// over the errors themselves and those of place and attitude of each submap, whose priors are
// random walks that come back (Ornstein-Uhlenbeck) with a mean of zero over the survey. The stated
// sigma is 1.5 times the largest of that of the model and those by the scatter of parts of the
// seabed and of pairs. times: of the submaps, rising. A value is applied that is beyond 4 sigma and
// a smallest step, if the differences of overlaps fall when it is tried, with at least 10 pairs and
// 3,000 cells, and no value larger than kLargestCalibration. Reads the pairs three times.
CalibrationEstimate EstimateCalibration(const std::vector<Time>& times, const ForEachPair& pairs);

}  // namespace seastitch
