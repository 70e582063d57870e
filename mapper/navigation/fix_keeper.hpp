#pragma once

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

// Position fixes that the filter does not take, at any age up to window_s and in any order, thinned
// by source: fixes of one source that follow each other closely have errors alike.
class FixKeeper {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  FixKeeper(const NavigationParams& params, Counters* counters)
      : params_(params), counters_(counters) {}

  // False, and counted: thinned out, for one of the same source within fix_interval_s is as good.
  bool Passes(Time t, const FixEvent& fix);
  void Keep(Time t, const FixEvent& fix);
  const std::deque<MapFix>& kept() const { return kept_; }
  // Those up to `until`, in order of time; each is given once.
  std::vector<MapFix> Take(Time until);

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.passed_, self.kept_);
  }

 private:
  struct Passed {
    Time time;
    std::string source;
    double sigma_m;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.source, self.sigma_m);
    }
  };
  const NavigationParams params_;
  Counters* counters_;
  std::deque<Passed> passed_;  // in order of time
  std::deque<MapFix> kept_;    // in order of time
};

}  // namespace seastitch
