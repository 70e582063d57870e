#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/ids.hpp"
#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"

namespace seastitch {

// Vehicle pose in the optimized map: the newest submap frame of the last solution, corrected by the
// position fixes that this solution does not have yet, and dead reckoning from there on. Its
// covariance is that of the frame plus that of dead reckoning since, and grows until the next fix
// or solution. Pure.
class NavCorrection {
 public:
  // navigation: must live longer.
  explicit NavCorrection(const Navigation* navigation) : navigation_(navigation) {}

  // Adds submaps that joined the graph, with their dead-reckoned poses, and edges that give the map
  // a position.
  void Add(const GraphUpdate& update);
  // Adds fixes that joined the graph together with this submap.
  void Given(const std::vector<MapFix>& fixes, SubmapId with);
  // Takes a solution that the map uses. If it changes the pose of the newest frame, that is a jump.
  void Take(const PoseGraph& solution);
  // Takes the fixes that wait for a submap. If one changes the pose, that is a jump.
  void TakeFixes();
  // Nothing before navigation has a state.
  std::optional<CorrectedNavState> Now() const;

 private:
  struct Frame {
    Time time;
    Pose2 dead_reckoned;
  };
  struct Surprises {
    int in_a_row = 0;
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
  };
  struct Anchor {
    Frame frame;
    Pose2 T_map_vehicle;         // corrected
    Eigen::Matrix3d covariance;  // x, y, yaw; map axes
    MountingErrors mounting;
    Surprises surprises{};
  };
  struct GivenFix {
    MapFix fix;
    SubmapId with;
  };
  void MoveByAllFixes();
  void MoveBy(const MapFix& fix);
  void Update(const Eigen::Matrix<double, 2, 3>& H,
              const Eigen::Vector2d& off,
              const Eigen::Matrix2d& R);
  bool IsOverruled(bool surprising, const Eigen::Vector2d& off, const Eigen::Matrix2d& R);
  void CarryAnchorTo(Time t, const NavState& nav);
  Pose2 Way(const Frame& from, const Frame& to) const;
  Pose2 Corrected(const Frame& nav) const;
  Eigen::Matrix3d CovarianceAt(Time t, const NavState& nav) const;
  Eigen::Matrix3d Covariance(const NavState& predicted) const;
  void CountJump(const std::optional<CorrectedNavState>& before);

  const Navigation* navigation_;
  std::map<SubmapId, Frame> frames_;    // from the solution's newest frame on
  std::optional<std::int64_t> placed_;  // graph version from which on the map's position is known
  std::vector<GivenFix> given_;         // given to the graph, not in the solution yet
  std::vector<MapFix> waiting_;         // fixes at the last TakeFixes()
  std::optional<Anchor> solved_;
  std::optional<Anchor> anchor_;  // solved_ (or NAV's start), corrected by these fixes
  std::int64_t graph_version_ = 0;
  std::int64_t jumps_ = 0;
  double last_jump_m_ = 0.0;
  double last_jump_yaw_rad_ = 0.0;
};

}  // namespace seastitch
