#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/calibration.hpp"
#include "products/report/dive_report.hpp"
#include "products/survey.hpp"
#include "survey/replay/replay_feed.hpp"
#include "survey/replay/replay_input.hpp"
#include "survey/session/self_calibration.hpp"

namespace seastitch {

// The runs of a replay over its inputs, for self-calibration: as configured, and at most twice with
// what the overlaps then show. Each dive is calibrated by its own overlaps.
class CalibrationRounds {
 public:
  // is_wanted: false maps once and estimates nothing. can_repeat: false maps once.
  CalibrationRounds(std::filesystem::path out, bool is_wanted, bool can_repeat)
      : out_(std::move(out)), is_wanted_(is_wanted), can_repeat_(can_repeat) {}

  // Begins a dive of a run. Null: it is not to be calibrated. The object is valid until EndRun().
  SelfCalibration* Begin(std::int32_t chain, Dive* dive);
  // The soundings of that dive came placed: they cannot be placed otherwise.
  void Drop(std::int32_t chain) { dives_.erase(chain); }
  // The graph's solution was withheld in this run: what overlaps by it is not to be trusted.
  void Withhold() { is_withheld_ = true; }
  // Ends a run, and removes its files. True: the dives have another calibration, and their inputs
  // can be read again. Never where the run was stopped early or its solution withheld.
  bool EndRun(const Survey& survey, bool is_stopped);
  // One line to people before the next run, and the warnings after the last one.
  static void SayThatItMapsAgain();
  void Warn(const Survey& survey, ReplayInput* replay_input) const;
  // Adds what each dive's overlaps said to its report.
  void Report(std::vector<DiveReport>* reports) const;

 private:
  static constexpr std::size_t kMostRuns = 3;

  struct OfDive {
    Dive* dive;
    std::unique_ptr<SelfCalibration> cells;     // of this run
    std::vector<CalibrationEstimate> rounds{};  // the last is of the last run; others were applied
  };

  const std::filesystem::path out_;
  const bool is_wanted_;
  const bool can_repeat_;
  std::size_t runs_ = 0;
  bool is_withheld_ = false;
  std::map<std::int32_t, OfDive> dives_;  // by chain
};

}  // namespace seastitch
