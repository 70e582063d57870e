#pragma once

#include <vector>

#include "common/core/pose.hpp"
#include "products/survey.hpp"
#include "products/write_products.hpp"

namespace seastitch {

// What the survey holds and what the graph moved; figures of a map are left as they are.
ProductSummary Summarise(const Survey& survey,
                         const std::vector<Pose2>& dead_reckoned,
                         const std::vector<Pose2>& solved);

// Whether the graph moved anything beyond rounding.
bool Moved(const ProductSummary& summary);

// Do no harm: sets outcome and statement from the consistency figures of both maps.
void Judge(const Survey& survey, double harm_tolerance, ProductSummary* summary);

// The same for a solution so far off that it was not even gridded.
void WithholdScattered(double extent_m, ProductSummary* summary);

}  // namespace seastitch
