#include "tests/perf/navigation_faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "tests/mapper/navigation/fault_cases.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"
#include "tests/mapper/navigation/fault_score.hpp"

namespace seastitch::test {
namespace {

// The goals: so many times the reference's error or so much, and never more than the next two.
// After a fault that ends, right again within kRecoveryS.
constexpr double kTimesReference = 1.5;
constexpr double kLeastM = 2.0;
constexpr double kLimitPart = 0.03;
constexpr double kLimitM = 12.0;
constexpr double kSeenSigma = 3.0;
constexpr double kRecoveryS = 60.0;

std::vector<Dive> DivesOf(const FaultOptions& options) {
  std::vector<Dive> dives;
  for (int seed = 1; seed <= options.simulated; ++seed)
    dives.push_back(SimulatedDive(static_cast<std::uint32_t>(seed)));
  for (const char* run : {"T4", "T6", "T11"}) {
    std::optional<Dive> dive = AkitDive(options.akit, run);
    if (dive)
      dives.push_back(std::move(*dive));
    else
      std::printf("%s is left out: %s has none\n", run, options.akit.c_str());
  }
  return dives;
}

bool IsWithin(const TrackScore& score, const TrackScore& reference) {
  const auto limit = [](double m) { return std::max(kTimesReference * m, kLeastM); };
  return score.rms_m <= limit(reference.rms_m) && score.largest_m <= limit(reference.largest_m);
}

bool Ends(const FaultCase& fault) { return fault.to_s >= 0.0 && std::isfinite(fault.to_s); }

bool MeetsGoal(const FaultCase& fault,
               const Dive& dive,
               const FilterScore& score,
               const TrackScore& reference) {
  if (score.largest_speed_mps > dive.params.max_speed_mps) return false;
  if (Ends(fault) && !(score.recovery_s && *score.recovery_s <= kRecoveryS)) return false;
  if (fault.unseen)
    return IsWithin(score, reference) && 2.0 * score.worst_nees <= kSeenSigma * kSeenSigma;
  const double most_m = std::max(kLimitPart * DistanceM(dive), kLimitM);
  return IsWithin(score, reference) && score.largest_m <= most_m;
}

void PrintCounters(const FilterScore& score) {
  std::printf("   ");
  for (const auto& [name, count] : score.counters)
    std::printf(" %s %lld,", name.c_str(), static_cast<long long>(count));
  for (const SuspectedOffset& offset : score.offsets)
    std::printf(" stamps of %s: %+.3f +- %.3f s",
                offset.sensor == NavSensor::kAttitude ? "attitude" : "DVL",
                offset.add_s,
                offset.sigma_s);
  std::printf("\n");
}

void PrintRow(const FaultCase& fault, const Dive& dive, bool counters, int* failed) {
  Dive faulty = dive;
  fault.apply(&faulty);
  const TrackScore baseline = ScoreBaseline(faulty);
  const FilterScore score = ScoreFilter(faulty, Ends(fault) ? fault.to_s : -1.0);
  TrackScore reference = baseline;
  if (fault.unseen) {
    Dive told = dive;
    fault.tell(&told);
    reference = ScoreFilter(told, -1.0);
  }
  const bool met = MeetsGoal(fault, dive, score, reference);
  if (!met) ++*failed;
  std::printf("%-30s %-6s %8.2f %8.2f %8.2f %8.2f %8.2f %8.2f %7.2f %7.2f %7.2f ",
              fault.name.c_str(),
              dive.name.c_str(),
              score.rms_m,
              score.largest_m,
              reference.rms_m,
              reference.largest_m,
              baseline.largest_m,
              score.sigma_m,
              score.nees,
              score.relative_nees,
              score.largest_speed_mps);
  if (!Ends(fault))
    std::printf("%7s", "");
  else if (score.recovery_s)
    std::printf("%7.0f", *score.recovery_s);
  else
    std::printf("%7s", "never");
  std::printf("  %s\n", met ? "" : "missed");
  if (counters) PrintCounters(score);
  std::fflush(stdout);
}

}  // namespace

void PrintFaults(const FaultOptions& options) {
  const std::vector<Dive> dives = DivesOf(options);
  std::printf(
      "Horizontal errors in m against the truth. Reference: the baseline (attitude of the device\n"
      "times velocity of the DVL); where nobody can see the fault, the same filter without the\n"
      "wrong samples. NEES by degree of freedom: of position, mean over the dive; of relative\n"
      "poses 30 s apart. Recovery: velocity, tilt and heading within 3 stated sigma.\n");
  std::printf("%-30s %-6s %8s %8s %8s %8s %8s %8s %7s %7s %7s %7s\n",
              "case",
              "dive",
              "RMS",
              "largest",
              "ref.RMS",
              "ref.lar.",
              "baseline",
              "sigma",
              "NEES",
              "rel.",
              "m/s",
              "recov.s");
  int rows = 0;
  int failed = 0;
  for (const FaultCase& fault : FaultCases()) {
    if (fault.name.find(options.only) == std::string::npos) continue;
    for (const Dive& dive : dives) {
      PrintRow(fault, dive, options.counters, &failed);
      ++rows;
    }
  }
  std::printf("%d of %d rows miss the goal\n", failed, rows);
}

}  // namespace seastitch::test
