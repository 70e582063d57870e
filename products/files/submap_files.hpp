#pragma once

#include <filesystem>

#include "products/survey.hpp"

namespace seastitch {

// Writes submap_ID.pcd of every submap with points into `dir`: its points, sheared by its dive's
// mounting errors, and its frame at `poses`. Removes those of an earlier, longer run. Throws
// std::runtime_error naming the file.
void RewriteSubmaps(const Survey& survey,
                    const SurveyPoses& poses,
                    const std::filesystem::path& dir);

}  // namespace seastitch
