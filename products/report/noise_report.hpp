#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/survey_noise.hpp"

// The survey's estimated noise as rows and sentences for the report.
namespace seastitch {

struct NoiseRow {
  const char* name;  // in report.json
  const char* label;
  const char* unit;  // HTML
  int digits;
  double configured;
  double value;
  double sigma;
  const char* bound;  // "at least", "at most"; null: `value` is no bound
};

// One row per variance component, as 1 sigma. Empty without a closure.
std::vector<NoiseRow> NoiseRows(const SurveyNoise& noise);

// The estimate of the sonar's time offset that differs clearly from the configuration, by roll if
// it can be had; absent: none does.
std::optional<TimeOffsetEstimate> ClearTiming(const SonarTimingEstimate& timing);

// A sentence each where time offset or scale of roll differ clearly from the configuration.
std::vector<std::string> TimingFindings(const SonarTimingEstimate& timing);

// One sentence per clear difference between estimate and configuration.
std::vector<std::string> NoiseFindings(const SurveyNoise& noise);

}  // namespace seastitch
