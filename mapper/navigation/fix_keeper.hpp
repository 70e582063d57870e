#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/core/time.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Position fixes in groups: those of one source within fix_interval_s of the first have errors
// alike, so that all together say as much as one of them. A fix that is better than its neighbours
// by far is a group of its own.
class FixKeeper {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  FixKeeper(const NavigationParams& params, Counters* counters)
      : params_(params), counters_(counters) {}

  // For a filter that takes each at once. False, and counted as thinned: not the first of a group.
  bool Passes(Time t, const FixEvent& fix);
  // For the graph, at any age up to window_s and in any order. All but the first of a group are
  // counted as thinned: as long as the group waits, it stands where the median of its fixes is,
  // each carried to the first by dead reckoning; its covariance stays that of the first.
  void Keep(Time t, const FixEvent& fix, const Eigen::Vector2d& dead_reckoned_m);
  // In order of time.
  std::vector<MapFix> Waiting() const;
  // Those up to `until`, each once.
  std::vector<MapFix> Take(Time until);

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.groups_);
  }

 private:
  struct Group {
    Time time;  // of its first
    std::string source;
    Eigen::Matrix2d covariance_m2;
    Eigen::Vector2d dead_reckoned_m;
    std::vector<Eigen::Vector2d> fixes_m;  // at the time of the first
    bool waits;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.source, self.covariance_m2, self.dead_reckoned_m, self.fixes_m);
      archive(self.waits);
    }
  };
  static MapFix FixOf(const Group& group);
  Group* GroupOf(Time t, const FixEvent& fix);
  void Begin(Group group);

  const NavigationParams params_;
  Counters* counters_;
  std::deque<Group> groups_;  // in order of time
};

}  // namespace seastitch
