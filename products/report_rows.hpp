#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "products/survey.hpp"
#include "products/write_products.hpp"

// Figures that report.json and report.html have in common.
namespace seastitch {

// Percent of the whole; not a number where that is nothing.
double Percent(double part, double whole);

// Input that is not in the map, by reason.
std::map<std::string, std::int64_t> Refused(const Survey& survey, const ProductOptions& options);

// Counters of navigation, by name.
std::map<std::string, std::int64_t> NavigationCounters(const ProductOptions& options);

// An estimated error of mounting, with its sigma.
struct MountingRow {
  const char* name;  // in report.json
  const char* label;
  double value;
  double sigma;
  const char* unit;  // HTML
};

// Errors of mounting that the graph estimated; none where it had no closure to do so.
std::vector<MountingRow> MountingRows(const Survey& survey, const ProductSummary& summary);

}  // namespace seastitch
