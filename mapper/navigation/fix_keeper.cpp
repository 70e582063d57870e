#include "mapper/navigation/fix_keeper.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {
namespace {

// A fix that is better than its neighbour by more than this is worth having beside it.
constexpr double kBetter = 0.7;

template <class T>
void InsertByTime(T item, std::deque<T>* items) {
  const auto at = std::upper_bound(
      items->begin(), items->end(), item, [](const T& a, const T& b) { return a.time < b.time; });
  items->insert(at, std::move(item));
}

}  // namespace

bool FixKeeper::Passes(Time t, const FixEvent& fix) {
  const double sigma_m = std::sqrt(fix.covariance_m2.trace());
  for (const Passed& other : passed_) {
    if (other.source != fix.source || sigma_m < kBetter * other.sigma_m) continue;
    if (std::abs(ToSeconds(t - other.time)) < params_.fix_interval_s) {
      ++(*counters_)["fix_thinned"];
      return false;
    }
  }
  InsertByTime(Passed{t, fix.source, sigma_m}, &passed_);
  while (ToSeconds(passed_.back().time - passed_.front().time) > params_.window_s)
    passed_.pop_front();
  return true;
}

void FixKeeper::Keep(Time t, const FixEvent& fix) {
  InsertByTime(MapFix{t, fix.north_east_m, fix.covariance_m2}, &kept_);
  while (ToSeconds(kept_.back().time - kept_.front().time) > params_.window_s) {
    kept_.pop_front();
    ++(*counters_)["fix_never_taken"];
  }
}

std::vector<MapFix> FixKeeper::Take(Time until) {
  const auto end = std::find_if(
      kept_.begin(), kept_.end(), [until](const MapFix& fix) { return fix.time > until; });
  std::vector<MapFix> taken(kept_.begin(), end);
  kept_.erase(kept_.begin(), end);
  return taken;
}

}  // namespace seastitch
