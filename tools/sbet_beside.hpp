#pragma once

#include <filesystem>

#include "codecs/sbet_file.hpp"

namespace seastitch {

// By its name (.sbet, or .out as POSPac writes it) and its size.
bool IsSbet(const std::filesystem::path& path);

// What an SBET does not hold, from the survey beside it: the week by a time of the survey; the sign
// of the wander angle as that of the three whose heading is nearest to the course made good, over
// the first half hour under way. Throws std::runtime_error naming the file that cannot be read.
SbetParams SbetParamsFor(const std::filesystem::path& path, Time of_survey);

}  // namespace seastitch
