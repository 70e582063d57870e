#include "mapper/submap_frames.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "mapper/position_edges.hpp"

namespace seastitch {
namespace {

// Interval [s] of the frames that are remembered. The nearest is at most half of it, times the
// vehicle's speed, from the frame of the submap that closes.
constexpr double kLookUpEveryS = 2.0;
constexpr Eigen::Index kHeadingOfCovariance = 5;

// Covariance of x, y, yaw.
Eigen::Matrix3d LevelCovariance(const NavState& state) {
  constexpr Eigen::Index kAxes[3] = {0, 1, kHeadingOfCovariance};
  Eigen::Matrix3d covariance;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = 0; c < 3; ++c) covariance(r, c) = state.covariance(kAxes[r], kAxes[c]);
  }
  return covariance;
}

// At most pi, where nothing is known of an angle any more.
double HeadingSigma(const NavState& state) {
  return std::min(kPi, std::sqrt(state.covariance(kHeadingOfCovariance, kHeadingOfCovariance)));
}

}  // namespace

void SubmapFrames::Remember(Time frame_time, Time ping_time) {
  if (open_ && ToSeconds(ping_time - open_->looked_up) < kLookUpEveryS) return;
  const std::optional<NavState> state = navigation_->StateAt(frame_time);
  if (!state) return;
  open_ = OpenFrame{ping_time, *state, std::nullopt};
  if (previous_)
    open_->from_previous = navigation_->RelativeCovariance(previous_->state.time, state->time);
}

std::vector<GraphEdge> SubmapFrames::Place(Submap* submap,
                                           bool first,
                                           const std::vector<MapFix>& fixes) {
  std::optional<NavState> state = navigation_->StateAt(submap->frame_time);
  if (!state && open_) {
    state = open_->state;
    state->time = submap->frame_time;
    state->T_map_vehicle = submap->T_map_submap;
  }
  submap->covariance_from_previous = state ? CovarianceFromPrevious(*state) : std::nullopt;
  if (state && previous_) submap->T_previous_level = FromPrevious(*state);
  Forget();
  if (HasSoundings(submap->trigger))
    open_.reset();
  else if (open_)
    open_->from_previous.reset();  // from another one
  if (state) {
    submap->heading_sigma_rad = HeadingSigma(*state);
    previous_ = Frame{submap->id, *state, submap->end};
  }
  std::vector<GraphEdge> edges = EdgesOf(fixes);
  if (first && state && navigation_->place_is_known())
    edges.push_back(StartEdge(submap->id, *state, navigation_->starts_from_fix()));
  return edges;
}

std::optional<Pose2> SubmapFrames::FromPrevious(const NavState& state) const {
  const auto T_anchored_map = navigation_->Hindsight(previous_->state.time, state.time);
  if (!T_anchored_map) return std::nullopt;
  return Inverse(LevelPose(previous_->state.T_map_vehicle)) * *T_anchored_map *
         LevelPose(state.T_map_vehicle);
}

std::optional<Eigen::Matrix3d> SubmapFrames::CovarianceFromPrevious(const NavState& state) {
  if (!previous_) return std::nullopt;
  const auto is_usable = [](const std::optional<Eigen::Matrix3d>& covariance) {
    return covariance && Eigen::LLT<Eigen::Matrix3d>(*covariance).info() == Eigen::Success;
  };
  const auto known = navigation_->RelativeCovariance(previous_->state.time, state.time);
  if (is_usable(known)) return known;
  if (open_ && is_usable(open_->from_previous)) return open_->from_previous;
  // The previous frame is older than navigation's window. Taken as independent, which gives a
  // covariance that is not too small.
  ++independent_;
  return RelativeCovariance(LevelPose(previous_->state.T_map_vehicle),
                            LevelPose(state.T_map_vehicle),
                            LevelCovariance(previous_->state),
                            LevelCovariance(state),
                            Eigen::Matrix3d::Zero());
}

void SubmapFrames::Forget() {
  if (previous_) earlier_.push_back(*std::exchange(previous_, std::nullopt));
}

std::vector<Submap> SubmapFrames::FramesFor(const std::vector<MapFix>& fixes,
                                            std::optional<Time> next) const {
  const Duration far = FromSeconds(kFarS);
  std::vector<Submap> frames;
  std::optional<Time> last;
  if (previous_) last = std::max(previous_->end, previous_->state.time);
  for (const MapFix& fix : fixes) {
    if ((last && fix.time <= *last + far) || (next && fix.time >= *next - far)) continue;
    const std::optional<NavState> state = navigation_->StateAt(fix.time);
    if (!state) continue;
    Submap frame;
    frame.start = frame.end = frame.frame_time = fix.time;
    frame.T_map_submap = state->T_map_vehicle;
    frame.trigger = SubmapTrigger::kFixes;
    frame.predicted_information = Eigen::Matrix3d::Zero();
    frames.push_back(std::move(frame));
    last = fix.time;
  }
  return frames;
}

std::vector<GraphEdge> SubmapFrames::EdgesOf(const std::vector<MapFix>& fixes) {
  while (!earlier_.empty() && !navigation_->StateAt(earlier_.front().state.time))
    earlier_.pop_front();
  std::vector<GraphEdge> edges;
  for (const MapFix& fix : fixes) {
    const Frame* const nearest = NearestTo(fix.time);
    const auto at_fix = navigation_->StateAt(fix.time);
    const auto covariance =
        nearest ? navigation_->RelativeCovariance(nearest->state.time, fix.time) : std::nullopt;
    if (!at_fix || !covariance) {
      ++fixes_too_far_;
      continue;
    }
    edges.push_back(FixEdge(nearest->id, nearest->state, fix, *at_fix, *covariance));
    ++fixes_in_graph_;
  }
  return edges;
}

// The frame nearest in time; null without one.
const SubmapFrames::Frame* SubmapFrames::NearestTo(Time t) const {
  const auto apart_s = [t](const Frame& frame) {
    return std::abs(ToSeconds(frame.state.time - t));
  };
  const Frame* nearest = previous_ ? &*previous_ : nullptr;
  for (const Frame& frame : earlier_)
    if (nearest == nullptr || apart_s(frame) < apart_s(*nearest)) nearest = &frame;
  return nearest;
}

std::optional<Time> SubmapFrames::previous_time() const {
  if (!previous_) return std::nullopt;
  return previous_->state.time;
}

}  // namespace seastitch
