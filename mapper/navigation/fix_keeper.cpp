#include "mapper/navigation/fix_keeper.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace seastitch {
namespace {

// Ratio of sigmas. A fix whose sigma is smaller by this is kept beside its neighbour; one whose
// sigma is larger by it adds nothing.
constexpr double kBetter = 0.7;
// Limit of fixes in a group: 10 s of a receiver at 10 Hz.
constexpr std::size_t kMostOfGroup = 100;

double SigmaOf(const Eigen::Matrix2d& covariance_m2) { return std::sqrt(covariance_m2.trace()); }

// Median; of an even number of values the mean of the two in the middle (Median() takes the upper
// one), so that neither of two fixes wins.
double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

FixKeeper::Group* FixKeeper::GroupOf(Time t, const FixEvent& fix) {
  for (Group& group : groups_)
    if (group.source == fix.source &&
        std::abs(ToSeconds(t - group.time)) < params_.fix_interval_s &&
        SigmaOf(fix.covariance_m2) >= kBetter * SigmaOf(group.covariance_m2))
      return &group;
  return nullptr;
}

void FixKeeper::Begin(Group group) {
  const auto later = [](const Group& a, const Group& b) { return a.time < b.time; };
  groups_.insert(std::upper_bound(groups_.begin(), groups_.end(), group, later), std::move(group));
  while (ToSeconds(groups_.back().time - groups_.front().time) > params_.window_s) {
    if (groups_.front().waits) tally_->Count("fix_never_taken");
    groups_.pop_front();
  }
}

bool FixKeeper::Passes(Time t, const FixEvent& fix) {
  if (GroupOf(t, fix) != nullptr) {
    tally_->Count("fix_thinned");
    return false;
  }
  Begin({t, fix.source, fix.covariance_m2, fix.north_east_m, {}, false});
  return true;
}

void FixKeeper::Keep(Time t, const FixEvent& fix, const Eigen::Vector2d& dead_reckoned_m) {
  Group* const group = GroupOf(t, fix);
  if (group == nullptr)
    return Begin({t, fix.source, fix.covariance_m2, dead_reckoned_m, {fix.north_east_m}, true});
  tally_->Count("fix_thinned");
  const bool alike = kBetter * SigmaOf(fix.covariance_m2) <= SigmaOf(group->covariance_m2);
  if (!alike || !group->waits || group->fixes_m.size() >= kMostOfGroup) return;
  group->fixes_m.emplace_back(fix.north_east_m - dead_reckoned_m + group->dead_reckoned_m);
}

MapFix FixKeeper::FixOf(const Group& group) {
  std::vector<double> north_m, east_m;
  for (const Eigen::Vector2d& fix : group.fixes_m) {
    north_m.push_back(fix.x());
    east_m.push_back(fix.y());
  }
  return {group.time, {MedianOf(north_m), MedianOf(east_m)}, group.covariance_m2};
}

std::vector<MapFix> FixKeeper::Waiting() const {
  std::vector<MapFix> waiting;
  for (const Group& group : groups_)
    if (group.waits) waiting.push_back(FixOf(group));
  return waiting;
}

std::vector<MapFix> FixKeeper::Take(Time until) {
  std::vector<MapFix> taken;
  for (Group& group : groups_) {
    if (!group.waits || group.time > until) continue;
    taken.push_back(FixOf(group));
    group.waits = false;
    group.fixes_m.clear();
  }
  return taken;
}

}  // namespace seastitch
