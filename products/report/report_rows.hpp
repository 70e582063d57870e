#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "products/survey.hpp"
#include "products/write_products.hpp"

// Values that both report.json and report.html have.
namespace seastitch {

// CRC-32 of the configuration, for people to compare: eight hexadecimal digits.
std::string ConfigurationHash(std::uint32_t crc);

// Percentage of the whole; NaN where the whole is 0.
double Percent(double part, double whole);

// Input that is not in the map, by reason.
std::map<std::string, std::int64_t> Refused(const Survey& survey, const ProductOptions& options);

// Counters of navigation, by name.
std::map<std::string, std::int64_t> NavigationCounters(const DiveReport& dive);

// Newest state of a dive's track; null without one.
const TrackState* LastState(const Survey& survey, std::int32_t chain);

// Why the components of the noise are not known; empty: they are.
std::string WhyNoNoise(const ProductSummary& summary, const ProductOptions& options);

// An estimated mounting error and its 1 sigma.
struct MountingRow {
  const char* name;  // in report.json
  const char* label;
  double value;
  double sigma;
  const char* unit;  // HTML
};

// Mounting errors of one dive that the graph estimated; empty where it accepted no closure with a
// submap of that dive.
std::vector<MountingRow> MountingRows(const Survey& survey, std::int32_t chain = 0);

}  // namespace seastitch
