#include "survey/replay/calibration_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "survey/plan/survey_files.hpp"

namespace seastitch {
namespace {

// The values that were applied, as YAML has them.
std::string Values(const std::vector<CalibrationEstimate>& rounds) {
  std::string values;
  for (const CalibrationName& of : kCalibrationNames) {
    const double value = rounds.back().used.*of.value;
    if (value == rounds.front().used.*of.value) continue;
    char text[80];
    std::snprintf(text, sizeof text, "%s: %.3f", of.name, value / of.per_unit + 0.0);
    values += (values.empty() ? "" : ", ") + std::string(text);
  }
  return values;
}

MapWarning WarningOf(const std::vector<CalibrationEstimate>& rounds) {
  const double before_m = rounds.front().before_m, after_m = rounds.back().before_m;
  char differences[120];
  std::snprintf(differences,
                sizeof differences,
                "heights in overlaps differ by %.3f m in place of %.3f m",
                after_m,
                before_m);
  return {WarningCode::kCalibrated,
          std::string("depths were corrected by a calibration from the survey's own overlaps: ") +
              differences + "; for the next survey write calibration: {" + Values(rounds) +
              "} into mapper.yaml, or map without it by --no-calibration",
          std::sqrt(std::max(0.0, before_m * before_m - after_m * after_m))};
}

}  // namespace

SelfCalibration* CalibrationRounds::Begin(std::int32_t chain, Dive* dive) {
  if (!is_wanted_ || !dive->mapper.calibrate) return nullptr;
  OfDive& of = dives_.try_emplace(chain, OfDive{dive, nullptr}).first->second;
  const VehicleGeometry& vehicle = dive->mapper.vehicle;
  SonarHeads heads;
  for (std::size_t head = 0; head <= vehicle.more_heads.size(); ++head)
    heads.push_back(vehicle.T_vehicle_mbes *
                    vehicle.Head(static_cast<std::uint8_t>(head)).T_mbes_rx);
  of.cells = std::make_unique<SelfCalibration>(
      out_ / (".cells" + std::to_string(chain)), std::move(heads), dive->mapper.calibration);
  return of.cells.get();
}

bool CalibrationRounds::EndRun(const Survey& survey, bool is_stopped) {
  ++runs_;
  bool again = false;
  for (auto& [chain, of] : dives_) {
    const std::unique_ptr<SelfCalibration> cells = std::move(of.cells);
    CalibrationEstimate estimate;
    if (cells && !is_stopped) estimate = cells->Estimate(survey);
    const bool was_changed = !of.rounds.empty() && of.rounds.back().HasClear();
    // A map with another calibration is told of, also where its own overlaps say nothing.
    if (estimate.pairs == 0 && !was_changed) continue;
    estimate.used = of.dive->mapper.calibration;
    if (estimate.pairs == 0) estimate.before_m = estimate.after_m = of.rounds.back().after_m;
    if (of.rounds.empty() || was_changed)
      of.rounds.push_back(std::move(estimate));
    else
      of.rounds.back() = std::move(estimate);
    again = again || of.rounds.back().HasClear();
  }
  const bool is_withheld = std::exchange(is_withheld_, false);
  if (!again || !can_repeat_ || is_withheld || runs_ == kMostRuns) return false;
  for (auto& [chain, of] : dives_) {
    if (!of.rounds.empty()) of.dive->mapper.calibration = of.rounds.back().Corrected();
    std::unique_ptr<SurveyFiles>& files = of.dive->input.survey_files;
    if (files) files = std::make_unique<SurveyFiles>(files->plan());
  }
  return true;
}

void CalibrationRounds::SayThatItMapsAgain() {
  std::fprintf(stderr,
               "overlaps show errors of the sonar's calibration: mapping again without them\n");
}

void CalibrationRounds::Warn(const Survey& survey, ReplayInput* replay_input) const {
  for (const auto& [chain, of] : dives_)
    if (of.rounds.size() > 1)
      seastitch::Warn(
          WarningOf(of.rounds), survey.dives.empty() ? "" : of.dive->name, replay_input);
}

void CalibrationRounds::Report(std::vector<DiveReport>* reports) const {
  for (const auto& [chain, of] : dives_) {
    const auto k = static_cast<std::size_t>(chain);
    if (k < reports->size()) (*reports)[k].calibration = of.rounds;
  }
}

}  // namespace seastitch
