#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>

#include "common/core/graph.hpp"
#include "common/core/ids.hpp"
#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"

namespace seastitch {

// The vehicle in the solved map: the newest submap frame that a solution places, and from there on
// as dead reckoning went. Its covariance is that of the frame and of the way since, so it grows
// until the next solution. Pure.
class NavCorrection {
 public:
  // navigation: must live longer.
  explicit NavCorrection(const Navigation* navigation) : navigation_(navigation) {}

  // Submaps that joined the graph, as dead reckoning places them, and edges that place the map.
  void Add(const GraphUpdate& update);
  // A solution that the map follows: where it places the newest frame otherwise, that is a jump.
  void Take(const PoseGraph& solution);
  // Nothing before navigation has a state.
  std::optional<CorrectedNavState> Now() const;

 private:
  struct Frame {
    Time time;
    Pose2 dead_reckoned;
  };
  struct Anchor {
    Frame frame;
    Pose2 T_map_vehicle;  // solved, of the vehicle
    Eigen::Matrix3d covariance;
    MountingErrors mounting;
    bool place_is_known;
  };
  Pose2 Corrected(const Pose2& T_nav_vehicle) const;
  Eigen::Matrix3d Covariance(const NavState& nav) const;

  const Navigation* const navigation_;
  std::map<SubmapId, Frame> frames_;    // from that of the anchor on
  std::optional<std::int64_t> placed_;  // the version from which on something says where the map is
  std::optional<Anchor> anchor_;
  std::int64_t graph_version_ = 0;
  std::int64_t jumps_ = 0;
  double last_jump_m_ = 0.0;
  double last_jump_yaw_rad_ = 0.0;
};

}  // namespace seastitch
