#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {

// One measured relative pose T_from_to. Frames are numbered from 0.
struct PoseLink {
  std::size_t from = 0;
  std::size_t to = 0;
  RelativePose relative;
};

// T_i_end of every frame i, chained along the links whose errors add up to the least: the Dijkstra
// projection of Bosse et al., "An Atlas framework for scalable mapping", ICRA 2003. One chain of
// the links says less than all of them together, so it is never too sure. Nothing where no chain
// leads. lever_m: what an error of yaw is worth beside one of position.
std::vector<std::optional<RelativePose>> ChainsTo(std::size_t end,
                                                  std::size_t num_frames,
                                                  const std::vector<PoseLink>& links,
                                                  double lever_m);

}  // namespace seastitch
