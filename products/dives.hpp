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
  // Accepted loop closures (kBelievedWeight) with other dives, by their index in Survey::dives.
  std::map<std::size_t, int> closures;
  std::size_t group = 0;  // of dives joined by closures: the lowest of their indices
};

// In the order of survey.dives; empty where there are none.
std::vector<DiveInMap> DivesInMap(const Survey& survey);

// One sentence for each dive: joined to which others, by how many closures, or joined to none.
// Empty for less than two dives.
std::vector<std::string> SentencesOf(const std::vector<DiveInMap>& dives);

}  // namespace seastitch
