#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "common/core/graph.hpp"
#include "common/core/ids.hpp"
#include "common/core/submap.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// Fit of overlapping submaps, by dead reckoning and by a solution.
struct Judgement {
  bool harmful = false;
  bool torn = false;             // harmful, since too little overlap is left
  int tiles = 0;                 // number compared, of 8 x 8 cells
  double dead_reckoned_m = 0.0;  // RMS of the differences of height
  double solved_m = 0.0;
  std::size_t cells_dead_reckoned = 0;  // number in overlaps
  std::size_t cells_solved = 0;
};

// Judge of solutions ("do no harm"): compares a solution with dead reckoning where two submaps
// overlap in both, by heights alone and regardless of the verdict of the pair. The mean height
// difference of each pair is removed, since tide and sound speed do not depend on the solution.
// Keeps the newest kMaxSubmaps submaps and their registered pairs on grids of at most kMaxCells, so
// that memory (36 B per cell) and work are bounded. Pure.
//
// Let d be the mean over a tile of the squared height difference by the solution, minus that by
// dead reckoning. A solution is harmful
//   where sum(d) > kSigmas sqrt(sum(d^2)) and the sum of squares is larger by kTolerance, or
//   where less than kOverlapKept of the overlap by dead reckoning is left.
// Noise alone makes d nearly symmetric about zero. If it were independent from tile to tile, the
// first threshold would be exceeded with a probability below exp(-kSigmas^2 / 2), 3 in 10,000, for
// any distribution of the noise. A tile that overlaps several targets has the same noise in each,
// so that this is a guide and not a bound. Fewer than kSigmas^2 tiles are not judged.
class SolutionJudge {
 public:
  static constexpr std::size_t kMaxSubmaps = 128;
  static constexpr int kMaxCells = 1024;
  static constexpr double kSigmas = 4.0;
  static constexpr double kTolerance = 1.04;  // 2 % of RMS

  // Coarse surface of a submap's cloud, which is stored in place of the cloud.
  static RegistrationSubmap Surface(const Submap& submap);

  // Ids must increase.
  void AddSubmap(const Submap& submap, RegistrationSubmap surface);
  // Adds a pair of submaps that may overlap. A pair with a submap that is not kept is ignored.
  void AddPair(SubmapId target, SubmapId source);

  Judgement Judge(const PoseGraph& graph) const;

 private:
  struct View {
    Pose2 T_map_level;  // dead-reckoned
    RegistrationSubmap surface;
  };

  std::map<SubmapId, View> views_;
  std::set<std::pair<SubmapId, SubmapId>> pairs_;  // source, target: of views_
};

}  // namespace seastitch
