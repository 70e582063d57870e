#pragma once

#include <vector>

#include "common/core/pose.hpp"
#include "products/survey.hpp"
#include "products/write_products.hpp"

namespace seastitch {

// Counts the survey's submaps, soundings and loop closures, and measures the graph's correction.
// Leaves the consistency of the maps empty.
ProductSummary Summarise(const Survey& survey,
                         const std::vector<Pose2>& dead_reckoned,
                         const std::vector<Pose2>& solved);

// True: the graph moved a submap by more than rounding.
bool Moved(const ProductSummary& summary);

// Do no harm (WriteProducts()): sets outcome and statement from the consistency of both maps.
void Judge(const Survey& survey, double harm_tolerance, ProductSummary* summary);

// The same for a solution whose submaps are spread too far for a grid: kWithheld.
void WithholdScattered(double extent_m, ProductSummary* summary);

}  // namespace seastitch
