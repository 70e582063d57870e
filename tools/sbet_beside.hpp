#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "codecs/sbet_file.hpp"

namespace seastitch {

// By its name (.sbet, or .out as POSPac writes it) and its size.
bool IsSbet(const std::filesystem::path& path);

// Processed navigation beside the files of a sonar: SBET, MB-System's .fnv and .na0, text with a
// map of its columns beside it (ColumnsFileOf).
bool IsNavigationBeside(const std::filesystem::path& path);
// Its source in NavigationRecord.
bool IsBeside(const std::string& source);
// The one with something to give, by counts of records; empty: none.
std::string BesideAmong(const std::map<std::string, std::int64_t>& counts);

// What an SBET does not hold, from the survey beside it: the week by a time of the survey; the sign
// of the wander angle as that of the three whose heading is nearest to the course made good, over
// the first half hour under way. Throws std::runtime_error naming the file that cannot be read.
SbetParams SbetParamsFor(const std::filesystem::path& path, Time of_survey);

}  // namespace seastitch
