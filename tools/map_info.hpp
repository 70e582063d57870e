#pragma once

#include <filesystem>
#include <vector>

namespace seastitch {

// Prints what a finished map holds, and whether another replay can use it. Throws DataError if it
// cannot: see ReadFinishedMap().
void PrintMap(const std::filesystem::path& folder, bool json);

// Prints what survey files hold and how a replay would use them, dive by dive: sonar, time, place,
// depths, the sensors that are used, and what is missing. Inputs as of a replay. Throws as
// DivesAmong(); DataError if no dive can be mapped.
void PrintSurvey(const std::vector<std::filesystem::path>& inputs, bool json);

}  // namespace seastitch
