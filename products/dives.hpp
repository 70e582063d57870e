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
  // Believed loop closures (kBelievedWeight) with other dives, by their place in Survey::dives.
  std::map<std::size_t, int> closures;
  std::size_t group = 0;  // dives that closures join have one; the lowest of their places
};

// In the order of survey.dives; empty where there are none.
std::vector<DiveInMap> DivesInMap(const Survey& survey);

// Which dives are joined, by how many closures, and which stand apart: one sentence each. Empty for
// less than two.
std::vector<std::string> SentencesOf(const std::vector<DiveInMap>& dives);

}  // namespace seastitch
