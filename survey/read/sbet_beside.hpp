#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "codecs/navigation/sbet_file.hpp"

namespace seastitch {

// True for an SBET, by its name (.sbet, or .out as POSPac names it) and its size.
bool IsSbet(const std::filesystem::path& path);

// True for processed navigation beside a sonar's files: SBET, MB-System's .fnv and .na0, and text
// with a file that describes its columns (HasTextColumns).
bool IsExternalNavigation(const std::filesystem::path& path);
// True if `source` (of a NavigationRecord) is such navigation.
bool IsExternal(const std::string& source);
// First source of such navigation that has records. counts: records by source. Empty: none.
std::string BesideAmong(const std::map<std::string, std::int64_t>& counts);

// A position of a survey's own files.
struct TimedPosition : GeoPoint {
  Time time;
};

// Parameters that an SBET does not contain, from the survey: the GPS week, by a time of the survey;
// the sign of the wander angle (-1, 0 or 1), as the one whose heading agrees best with the course
// over ground in the first half hour under way; leap_seconds 0 if its times are UTC, so that its
// positions agree better with the survey's own. Throws std::runtime_error with the name of a file
// that cannot be read.
SbetParams SbetParamsFor(const std::filesystem::path& path,
                         Time of_survey,
                         const std::vector<TimedPosition>& own = {});

}  // namespace seastitch
