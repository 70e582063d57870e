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

// Position fixes in groups. Fixes of one source within fix_interval_s of the first have similar
// errors, so that a group counts as one fix. A fix that is much better than its neighbours begins a
// group of its own.
class FixKeeper {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  FixKeeper(const NavigationParams& params, NavTally* tally) : params_(params), tally_(tally) {}

  // For a filter that uses each fix at once. False for all but the first of a group, which are
  // counted as thinned.
  bool Passes(Time t, const FixEvent& fix);
  // For the graph; fixes of any age up to window_s and in any order. All but the first of a group
  // are counted as thinned. While the group waits, its position is the median of its fixes, each
  // carried to the time of the first by dead reckoning. Its covariance remains that of the first.
  void Keep(Time t, const FixEvent& fix, const Eigen::Vector2d& dead_reckoned_m);
  // The fixes that wait, in order of time.
  std::vector<MapFix> Waiting() const;
  // Takes the fixes up to `until`; each is returned once.
  std::vector<MapFix> Take(Time until);

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.groups_);
  }

 private:
  struct Group {
    Time time;  // of its first fix
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
  NavTally* tally_;
  std::deque<Group> groups_;  // in order of time
};

}  // namespace seastitch
