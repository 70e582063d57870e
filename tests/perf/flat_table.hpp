#pragma once

#include <cstdint>
#include <vector>

#include "tests/perf/registration_trial.hpp"

namespace seastitch {

// False acceptance where nothing can be known, under every noise that a survey may have learned.
void PrintFlatTable(const std::vector<SeabedClass>& classes, int pairs, std::uint64_t first_seed);

}  // namespace seastitch
