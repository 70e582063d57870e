#pragma once

#include <string>
#include <vector>

namespace seastitch {

// The name most similar to a word (fewest letters to change); empty if none is similar.
std::string NearestName(const std::string& word, const std::vector<std::string>& names);

}  // namespace seastitch
