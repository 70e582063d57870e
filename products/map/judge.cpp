#include "products/map/judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "products/counted.hpp"

namespace seastitch {
namespace {

// Below this nothing moved: rounding of the solver.
constexpr double kMovedM = 1e-6;
constexpr double kMovedRad = 1e-8;

std::string Format(const char* format, double a, double b = 0.0) {
  char text[160];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

void CountLoops(const Survey& survey, ProductSummary* s) {
  std::vector<double> offsets;
  for (const LoopRow& row : LoopRows(survey)) {
    ++s->loop_verdicts[ToString(row.edge->verdict)];
    if (row.edge->verdict == LoopVerdict::kAccepted) {
      ++s->loops_accepted;
      if (row.weight < kAcceptedWeight) ++s->loops_refused;
      offsets.push_back(row.edge->z_offset_m);
    } else {
      ++s->loops_rejected;
    }
  }
  s->z_offset_mean_m = s->z_offset_sigma_m = s->z_offset_max_m =
      std::numeric_limits<double>::quiet_NaN();
  if (offsets.empty()) return;
  double sum = 0.0, squares = 0.0, largest = 0.0;
  for (const double z : offsets) {
    sum += z;
    largest = std::max(largest, std::abs(z));
  }
  const double n = static_cast<double>(offsets.size());
  s->z_offset_mean_m = sum / n;
  for (const double z : offsets) squares += (z - s->z_offset_mean_m) * (z - s->z_offset_mean_m);
  s->z_offset_sigma_m = std::sqrt(squares / n);
  s->z_offset_max_m = largest;
}

void CountSoundings(const Survey& survey, ProductSummary* s) {
  s->submaps = survey.Mapped();
  for (const SurveySubmap& submap : survey.submaps) {
    s->soundings_read += submap.soundings_read;
    s->soundings_used += submap.soundings_used;
    s->points += submap.points;
  }
}

void MeasureCorrection(const std::vector<Pose2>& from,
                       const std::vector<Pose2>& to,
                       ProductSummary* s) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    s->correction_end_m = (to[i].Translation() - from[i].Translation()).norm();
    s->correction_max_m = std::max(s->correction_max_m, s->correction_end_m);
    const double yaw_deg = Rad2Deg(std::abs(WrapAngle(to[i].yaw - from[i].yaw)));
    s->correction_max_yaw_deg = std::max(s->correction_max_yaw_deg, yaw_deg);
  }
}

std::string NothingMovedStatement(const ProductSummary& s, const Survey& survey) {
  if (s.loops_accepted > 0 && survey.solution.vertices.empty()) {
    return "Loop closures were found, but the graph was not solved: the map is as navigated.";
  }
  if (s.loops_accepted > 0 && s.loops_refused == s.loops_accepted) {
    return "Nothing could be corrected: of " + Counted(s.loops_accepted, "loop closure") +
           " the graph accepts none, since they contradict the navigation. The map is as "
           "navigated. Check the mounting in vehicle.yaml, and whether sonar_mounting_sigma_m "
           "covers its error.";
  }
  if (s.loops_accepted > 0) {
    return "The loop closures agree with the navigation: nothing had to be corrected.";
  }
  if (s.loops_rejected > 0) {
    return "Nothing could be corrected: " +
           Counted(s.loops_rejected, "pair of submaps was", "pairs of submaps were") +
           " registered, and none became a loop closure. The map is as navigated.";
  }
  return "Nothing could be corrected: no two passes of this survey overlap. The map is as "
         "navigated.";
}

// Names the loop closures and position fixes in the graph. How many of the fixes are inliers is not
// known here: at most all.
std::string Corrections(const ProductSummary& s, const Survey& survey) {
  const auto fixes = static_cast<std::uint64_t>(
      std::count_if(survey.edges.begin(), survey.edges.end(), [](const GraphEdge& edge) {
        return edge.kind == EdgeKind::kPositionFix;
      }));
  std::string of_loops = Counted(s.loops_accepted, "loop closure");
  if (s.loops_refused > 0)
    of_loops = std::to_string(s.loops_accepted - s.loops_refused) + " of " + of_loops;
  const std::string of_fixes = "up to " + Counted(fixes, "position fix", "position fixes");
  if (fixes == 0 && s.loops_accepted == 0) return "what navigation learnt later";
  if (fixes == 0) return of_loops;
  return s.loops_accepted == 0 ? of_fixes : of_loops + " and " + of_fixes;
}

std::string CorrectedStatement(const ProductSummary& s, const Survey& survey) {
  std::string text = "The map is corrected by " + Corrections(s, survey);
  if (s.before.point.cells == 0) return text + "; no cell is seen twice both before and after.";
  const ErrorFigures &before = s.before.surface, &after = s.solved.surface;
  if (before.cells == 0) return text + "; too few points are seen twice for more than that.";
  return text + Format(
                    ": where swaths overlap, 95 %% of the cells compared agree within %.3f m "
                    "before, %.3f m "
                    "after.",
                    before.p95_m,
                    after.p95_m);
}

// The rule of WriteProducts(). A small rise of the RMS alone comes from a few cells with an
// outlier, which no solution can correct. A large rise comes from a few displaced submaps. False
// without a cell to compare.
bool Worse(const ErrorFigures& solved, const ErrorFigures& before, double tolerance) {
  constexpr double kThrownOff = 1.5;
  if (solved.rms_m > kThrownOff * before.rms_m) return true;
  return solved.rms_m > (1.0 + tolerance) * before.rms_m &&
         solved.p95_m > (1.0 + tolerance) * before.p95_m;
}

std::string WorseStatement(const char* measure, double solved_m, double before_m) {
  return std::string("The correction was withheld: it would have made the map less consistent (") +
         measure +
         Format(" %.3f m in place of %.3f m). The map is as navigated.", solved_m, before_m);
}

}  // namespace

ProductSummary Summarise(const Survey& survey,
                         const std::vector<Pose2>& dead_reckoned,
                         const std::vector<Pose2>& solved) {
  ProductSummary summary;
  summary.dives = DivesInMap(survey);
  CountSoundings(survey, &summary);
  CountLoops(survey, &summary);
  MeasureCorrection(dead_reckoned, solved, &summary);
  return summary;
}

bool Moved(const ProductSummary& s) {
  return s.correction_max_m > kMovedM || Deg2Rad(s.correction_max_yaw_deg) > kMovedRad;
}

void Judge(const Survey& survey, double harm_tolerance, ProductSummary* s) {
  if (!Moved(*s)) {
    s->outcome = Outcome::kNothingToCorrect;
    s->statement = NothingMovedStatement(*s, survey);
    return;
  }
  const ConsistencyFigures &solved = s->solved, &before = s->before;
  if (Worse(solved.surface, before.surface, harm_tolerance)) {
    s->outcome = Outcome::kWithheld;
    s->statement = WorseStatement("surface error", solved.surface.rms_m, before.surface.rms_m);
    return;
  }
  if (Worse(solved.point, before.point, harm_tolerance)) {
    s->outcome = Outcome::kWithheld;
    s->statement = WorseStatement("consistency error", solved.point.rms_m, before.point.rms_m);
    return;
  }
  const double kept = static_cast<double>(s->solved_all.point.cells);
  if (kept < kOverlapKept * static_cast<double>(s->before_all.point.cells)) {
    s->outcome = Outcome::kWithheld;
    s->statement = Format(
        "The correction was withheld: it would have torn overlapping swaths apart (%.0f cells seen "
        "twice in place of %.0f). The map is as navigated.",
        kept,
        static_cast<double>(s->before_all.point.cells));
    return;
  }
  s->outcome = Outcome::kCorrected;
  s->statement = CorrectedStatement(*s, survey);
}

void WithholdScattered(double extent_m, ProductSummary* s) {
  s->outcome = Outcome::kWithheld;
  s->statement = Format(
      "The correction was withheld: it would have scattered the submaps over %.0f km. The map is "
      "dead reckoning.",
      extent_m / 1000.0);
}

}  // namespace seastitch
