#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "mapper/navigation/navigation.hpp"

namespace seastitch {

// Poses and covariances of submap frames by navigation: of the closed submaps in navigation's
// history, and of the open one. That of the open submap is computed every two seconds while pings
// come, because the history is bounded: after a long silence of the sensors a submap may close when
// its frame is no longer in that history. Position fixes that are far from any
// submap, at the surface before and after a survey, get frames of their own. Pure.
class SubmapFrames {
 public:
  // navigation: must live longer.
  explicit SubmapFrames(const Navigation* navigation) : navigation_(navigation) {}

  // Computes the open submap's frame, as if it were closed at this ping.
  void Remember(Time frame_time, Time ping_time);

  // Call it for a submap that closes: sets covariance_from_previous and heading_sigma_rad if they
  // are known. Returns the start edge, if it is the first submap of the graph, and the edges of
  // `fixes`, each on the frame that is nearest in time.
  std::vector<GraphEdge> Place(Submap* submap, bool first, const std::vector<MapFix>& fixes);
  // Submaps without soundings (SubmapTrigger::kFixes), for fixes more than kFarS after the submap
  // closed last and, if given, before `next`, the begin of the one that closes now: the first of
  // these fixes, and each that is more than kFarS after the one before. They have no id yet. fixes:
  // in order of time.
  std::vector<Submap> FramesFor(const std::vector<MapFix>& fixes, std::optional<Time> next) const;
  static constexpr double kFarS = 20.0;
  // Edges of fixes that came after the submap closed last.
  std::vector<GraphEdge> EdgesOf(const std::vector<MapFix>& fixes);

  // Call it if the submap closed last is unknown to navigation: the next submap then has no known
  // pose relative to it.
  void Forget();

  // Time of the frame of the submap closed last.
  std::optional<Time> previous_time() const;

  // number of covariances without history, see below
  std::int64_t independent() const { return independent_; }
  std::int64_t fixes_in_graph() const { return fixes_in_graph_; }
  std::int64_t fixes_too_far() const { return fixes_too_far_; }  // too far from every frame

  // For a restart. Not saved: earlier_, whose poses navigation forgets, too; open_, of the submap
  // that is lost with it; and the counters of one process: independent_, fixes_in_graph_,
  // fixes_too_far_.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.previous_);
  }

 private:
  struct Frame {
    SubmapId id;
    NavState state;
    Time end{};  // of the submap

    // Not saved: end, which is that of the frame after a restart.
    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.id, self.state);
    }
  };
  struct OpenFrame {
    Time looked_up;  // time of the ping at which it was computed
    NavState state;
    std::optional<Eigen::Matrix3d> from_previous;
  };

  std::optional<Pose2> FromPrevious(const NavState& state) const;
  std::optional<Eigen::Matrix3d> CovarianceFromPrevious(const NavState& state);
  const Frame* NearestTo(Time t) const;

  const Navigation* navigation_;
  std::deque<Frame> earlier_;      // before previous_, in order; in navigation's history
  std::optional<Frame> previous_;  // of the submap closed last
  std::optional<OpenFrame> open_;
  std::int64_t independent_ = 0;
  std::int64_t fixes_in_graph_ = 0;
  std::int64_t fixes_too_far_ = 0;
};

}  // namespace seastitch
