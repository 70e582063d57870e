#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "products/survey.hpp"

namespace seastitch {

// One of several dives in one map.
struct DiveInMap {
  std::string name;
  std::size_t submaps = 0;
  // Accepted loop closures (kAcceptedWeight) with other dives, by their index in Survey::dives.
  std::map<std::size_t, int> closures;
  std::size_t group = 0;  // of dives joined by closures: the lowest of their indices
};

// In the order of survey.dives; empty for a single dive.
std::vector<DiveInMap> DivesInMap(const Survey& survey);

// One sentence per dive: to which dives loop closures join it, and how many; or that none do. Empty
// for fewer than two dives.
std::vector<std::string> SentencesOf(const std::vector<DiveInMap>& dives);

}  // namespace seastitch
