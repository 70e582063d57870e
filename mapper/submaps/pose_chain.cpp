#include "mapper/submaps/pose_chain.hpp"

#include <functional>
#include <queue>
#include <utility>

namespace seastitch {
namespace {

struct Neighbour {
  std::size_t frame;
  RelativePose relative;  // T_frame_here
};

std::vector<std::vector<Neighbour>> NeighboursOf(std::size_t num_frames,
                                                 const std::vector<PoseLink>& links) {
  std::vector<std::vector<Neighbour>> neighbours(num_frames);
  for (const PoseLink& link : links) {
    neighbours[link.to].push_back({link.from, link.relative});
    neighbours[link.from].push_back({link.to, Inverse(link.relative)});
  }
  return neighbours;
}

// Mean square error of a point at the lever.
double Spread(const Eigen::Matrix3d& covariance, double lever_m) {
  return covariance(0, 0) + covariance(1, 1) + lever_m * lever_m * covariance(2, 2);
}

}  // namespace

std::vector<std::optional<RelativePose>> ChainsTo(std::size_t end,
                                                  std::size_t num_frames,
                                                  const std::vector<PoseLink>& links,
                                                  double lever_m) {
  const std::vector<std::vector<Neighbour>> neighbours = NeighboursOf(num_frames, links);
  std::vector<std::optional<RelativePose>> chains(num_frames);
  std::vector<bool> settled(num_frames, false);
  using Reached = std::pair<double, std::size_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
  chains[end] = RelativePose{};
  queue.push({0.0, end});
  while (!queue.empty()) {
    const std::size_t here = queue.top().second;
    queue.pop();
    if (settled[here]) continue;
    settled[here] = true;
    for (const auto& [frame, relative] : neighbours[here]) {
      if (settled[frame]) continue;
      const RelativePose chain = Compose(relative, *chains[here]);
      const double spread = Spread(chain.covariance, lever_m);
      if (chains[frame] && !(spread < Spread(chains[frame]->covariance, lever_m))) continue;
      chains[frame] = chain;
      queue.push({spread, frame});
    }
  }
  return chains;
}

}  // namespace seastitch
