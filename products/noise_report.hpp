#pragma once

#include <string>
#include <vector>

#include "common/core/survey_noise.hpp"

// What the survey says of its own noise, in rows and sentences for the report.
namespace seastitch {

struct NoiseRow {
  const char* name;  // in report.json
  const char* label;
  const char* unit;  // HTML
  int digits;
  double configured;
  double value;
  double sigma;
};

// One row a variance component, as 1 sigma. Nothing where no closure bears on them.
std::vector<NoiseRow> NoiseRows(const SurveyNoise& noise);

// What is clearly not as configured, a sentence each; empty: everything is.
std::vector<std::string> NoiseFindings(const SurveyNoise& noise);

}  // namespace seastitch
