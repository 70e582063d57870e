#pragma once

#include <string>
#include <vector>

namespace seastitch {

// The name that a word most likely means: the one that the fewest letters have to be changed in.
// Empty where none is near.
std::string NearestName(const std::string& word, const std::vector<std::string>& names);

}  // namespace seastitch
