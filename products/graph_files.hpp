#pragma once

#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "products/survey.hpp"

namespace seastitch {

// poses.txt: "id x y z qx qy qz qw", one line a submap, map frame of the input, every digit of a
// double; z, roll and pitch as dead reckoned.
std::string PosesTxt(const Survey& survey, const std::vector<Pose2>& T_map_level);

// graph.g2o: VERTEX_SE2 (x y yaw of the level frame), FIX of the first, EDGE_SE2 of dead reckoning
// and of accepted loop closures, EDGE_PRIOR_SE2 of position fixes; information as upper triangle by
// rows. The estimated errors of mounting are removed from the edges, so that edges and vertices
// agree. Edges of a submap that the survey does not have are left out.
std::string GraphG2o(const Survey& survey, const SurveyPoses& poses);

}  // namespace seastitch
