#include "survey/line/line_track.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

constexpr double kSpacingS = 0.1;
// Course over so long to either side: over less, noise of positions would turn it.
constexpr double kCourseS = 2.0;
// A swath of a vehicle that crabs is so far from the line across its track: sine of 20 degrees.
constexpr double kAbeam = 0.34;

template <class Item>
bool IsDue(const std::vector<Item>& items, Time t) {
  return items.empty() || std::abs(ToSeconds(t - items.back().time)) >= kSpacingS;
}

template <class Item>
void SortByTime(std::vector<Item>* items) {
  std::stable_sort(
      items->begin(), items->end(), [](const Item& a, const Item& b) { return a.time < b.time; });
  const auto same = [](const Item& a, const Item& b) { return a.time == b.time; };
  items->erase(std::unique(items->begin(), items->end(), same), items->end());
}

}  // namespace

LineTrack::LineTrack(const GeoPosition& origin)
    : map_({Rad2Deg(origin.latitude_rad), Rad2Deg(origin.longitude_rad)}) {}

Eigen::Vector2d LineTrack::ToMap(const GeoPoint& point) const { return map_.NorthEastOf(point); }

void LineTrack::AddPosition(Time t, const GeoPosition& position) {
  if (IsDue(positions_, t)) positions_.push_back({t, ToMap(position)});
}
void LineTrack::AddHeading(Time t, double heading_rad) {
  if (IsDue(headings_, t)) headings_.push_back({t, heading_rad});
}
void LineTrack::AddDepth(Time t, double depth_m) {
  if (IsDue(depths_, t)) depths_.push_back({t, depth_m});
}

void LineTrack::Finish() {
  SortByTime(&positions_);
  SortByTime(&headings_);
  SortByTime(&depths_);
}

double LineTrack::heading_interval_s() const {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < headings_.size(); ++i)
    intervals_s.push_back(ToSeconds(headings_[i].time - headings_[i - 1].time));
  return intervals_s.empty() ? 0.0 : Median(intervals_s);
}

std::optional<Eigen::Vector2d> LineTrack::PositionAt(Time t) const {
  const auto around = AroundOf(positions_, t, kMaxGapS);
  if (!around) return std::nullopt;
  const Eigen::Vector2d& from = around->before.p_m;
  return from + around->share * (around->after.p_m - from);
}

double LineTrack::CourseAt(Time t) const {
  const auto begin = FirstFrom(positions_, t - FromSeconds(kCourseS));
  const auto end = FirstFrom(positions_, t + FromSeconds(kCourseS));
  const Eigen::Vector2d moved =
      (end == positions_.end() ? positions_.back() : *end).p_m - begin->p_m;
  return std::atan2(moved.y(), moved.x());
}

std::optional<LineTrack::State> LineTrack::At(Time t) const {
  const std::optional<Eigen::Vector2d> p = PositionAt(t);
  if (!p) return std::nullopt;
  State state{*p, 0.0, 0.0};
  if (const auto heading = AroundOf(headings_, t, kMaxGapS))
    state.heading_rad = heading->before.value +
                        heading->share * WrapAngle(heading->after.value - heading->before.value);
  else
    state.heading_rad = CourseAt(t);
  if (const auto depth = AroundOf(depths_, t, kMaxGapS))
    state.depth_m = depth->before.value + depth->share * (depth->after.value - depth->before.value);
  return state;
}

std::optional<Time> LineTrack::TimeNearest(const Eigen::Vector2d& p,
                                           const TrackPart& part,
                                           std::ptrdiff_t stride) const {
  const auto first = FirstFrom(positions_, part.begin);
  const auto last = FirstFrom(positions_, part.end + Duration(1));
  const auto distance2 = [&p](const Position& position) {
    return (position.p_m - p).squaredNorm();
  };
  if (last - first < 2) return std::nullopt;
  auto nearest = first;
  double least_m2 = distance2(*first);
  const auto search = [&](auto from, auto to, std::ptrdiff_t step) {
    for (; from < to; from += std::min(step, to - from))
      if (const double d_m2 = distance2(*from); d_m2 < least_m2) least_m2 = d_m2, nearest = from;
  };
  search(first, last, stride);
  const auto best = nearest;
  search(best - std::min(stride, best - first), best + std::min(stride, last - best), 1);
  const auto joined = [](auto from) {
    return ToSeconds((from + 1)->time - from->time) <= kMaxGapS;
  };
  const bool has_next = nearest + 1 != last && joined(nearest);
  const bool has_previous = nearest != first && joined(nearest - 1);
  const Eigen::Vector2d off = p - nearest->p_m;
  bool abeam = has_next && has_previous;  // outside of a bend, if abreast of neither piece
  for (const auto& [has, from] :
       {std::pair(has_next, nearest), std::pair(has_previous, nearest - (has_previous ? 1 : 0))}) {
    if (!has) continue;
    const Eigen::Vector2d step = (from + 1)->p_m - from->p_m;
    const double share = (p - from->p_m).dot(step) / std::max(step.squaredNorm(), 1e-6);
    if (share >= 0.0 && share <= 1.0)
      return from->time + FromSeconds(share * ToSeconds((from + 1)->time - from->time));
    abeam = abeam || std::abs(off.dot(step)) <= kAbeam * off.norm() * step.norm();
  }
  return abeam ? std::optional(nearest->time) : std::nullopt;
}

}  // namespace seastitch
