#pragma once

#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Text of poses.txt: one line per submap, "id x y z qx qy qz qw" of T_map_submap, with all digits
// of a double. z, roll and pitch are dead reckoned.
std::string PosesTxt(const Survey& survey, const std::vector<Pose2>& T_map_level);

// Text of graph.g2o: VERTEX_SE2 (x y yaw of the level frame, solved), FIX of the first, EDGE_SE2 of
// dead reckoning and of accepted loop closures, EDGE_PRIOR_SE2 of position fixes; information as
// upper triangle by rows. Edges are corrected by the estimated mounting errors, because vertices
// are. Edges of a submap that the survey does not have are left out.
std::string GraphG2o(const Survey& survey, const SurveyPoses& poses);

}  // namespace seastitch
