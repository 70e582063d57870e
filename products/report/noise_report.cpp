#include "products/report/noise_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

std::string Format(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// Off by more than a quarter, and by 2 sigma.
bool IsOff(const ComponentEstimate& e) {
  if (!(e.configured > 0.0 && e.value > 0.0)) return false;
  return std::abs(std::log(e.value / e.configured)) > std::max(std::log(1.25), 2.0 * e.log_sigma);
}

bool IsLarger(const ComponentEstimate& e) { return IsOff(e) && e.value > e.configured; }

// Of a variance, the sigma.
ComponentEstimate Root(const ComponentEstimate& e) {
  return {std::sqrt(e.configured), std::sqrt(e.value), 0.5 * e.log_sigma, e.end};
}

const char* BoundOf(const ComponentEstimate& e) {
  switch (e.end) {
    case RangeEnd::kNone: return nullptr;
    case RangeEnd::kLow: return "at most";
    case RangeEnd::kHigh: return "at least";
  }
  return nullptr;
}

// The words before the figure of a component.
std::string Bounded(const char* text, const ComponentEstimate& e) {
  const char* const bound = BoundOf(e);
  return text + (bound != nullptr ? std::string(bound) + " " : "");
}

NoiseRow Row(const char* name,
             const char* label,
             const char* unit,
             int digits,
             double scale,
             const ComponentEstimate& e) {
  const double value = scale * e.value;
  return {name, label, unit, digits, scale * e.configured, value, value * e.log_sigma, BoundOf(e)};
}

void AddOverlaps(const NoiseEstimate& noise, std::vector<std::string>* findings) {
  const ComponentEstimate soundings = Root(noise.sounding_variance_ratio);
  if (IsOff(soundings))
    findings->push_back(soundings.value > soundings.configured
                            ? Format("Soundings are %.1f x noisier than stated.",
                                     soundings.value / soundings.configured)
                            : Format("Soundings have %.1f times the noise that is stated.",
                                     soundings.value / soundings.configured));
  const ComponentEstimate& shared = noise.correlated_error_ratio;
  if (IsOff(shared))
    findings->push_back(Bounded("Neighbouring soundings share an error of ", shared) +
                        Format("%.3g %% of the altitude where %.3g %% is configured",
                               100.0 * shared.value,
                               100.0 * shared.configured) +
                        (IsLarger(shared) ? ": sound speed or roll." : "."));
  if (IsLarger(noise.position_walk))
    findings->push_back(
        Bounded("Inside a submap the position drifts by ", noise.position_walk) +
        Format("%.2g m over 25 m where %.2g m is expected: the Doppler log is noisier, or was not "
               "used.",
               5.0 * noise.position_walk.value,
               5.0 * noise.position_walk.configured));
  if (IsLarger(noise.heading_walk))
    findings->push_back(
        Bounded("Inside a submap the heading drifts by ", noise.heading_walk) +
        Format("%.2g deg over 25 m where %.2g deg is expected: gyro or heading is noisier.",
               Rad2Deg(5.0 * noise.heading_walk.value),
               Rad2Deg(5.0 * noise.heading_walk.configured)));
}

bool IsClear(const std::optional<TimeOffsetEstimate>& offset) {
  constexpr double kLeastS = 0.002;
  constexpr double kMostS = 1.0;  // beyond it sonar_time_offset_s takes none
  return offset && std::abs(offset->add_s) > std::max(kLeastS, kAdviceSigmas * offset->sigma_s) &&
         std::abs(offset->add_s) < kMostS;
}

}  // namespace

std::optional<TimeOffsetEstimate> ClearTiming(const SonarTimingEstimate& timing) {
  return IsClear(timing.roll) ? timing.roll : std::nullopt;
}

std::vector<std::string> TimingFindings(const SonarTimingEstimate& timing) {
  std::vector<std::string> findings;
  if (timing.roll_scale && timing.roll_scale->IsClear())
    findings.push_back(
        Format("Slopes across the track change with the roll as if roll were %.1f %% too ",
               std::abs(timing.roll_scale->add_percent)) +
        (timing.roll_scale->add_percent > 0.0 ? "small" : "large") +
        Format(
            " (1 sigma %.1f %%), or the sound speed at the sonar wrong by %.0f m/s: only "
            "overlapping lines tell which.",
            timing.roll_scale->sigma_percent,
            std::abs(timing.roll_scale->add_percent) / RollScaleEstimate::kPercentOfSteeringMps));
  const std::optional<TimeOffsetEstimate> offset = ClearTiming(timing);
  if (!offset) return findings;
  std::string text = "The sonar's stamps are " +
                     Format("%.1f ms too ", 1000.0 * std::abs(offset->add_s)) +
                     (offset->add_s > 0.0 ? "early" : "late") + " for the roll" +
                     Format(" (1 sigma %.1f ms): ", 1000.0 * offset->sigma_s);
  if (timing.placed_by_source)
    text += "correct them in the program that computed the soundings.";
  else
    text += Format("set sonar_time_offset_s to %.3f.", timing.configured_s + offset->add_s);
  findings.push_back(std::move(text));
  return findings;
}

std::vector<NoiseRow> NoiseRows(const SurveyNoise& noise) {
  const NoiseEstimate& n = noise.components;
  if (n.closures == 0) return {};
  return {Row("sounding_noise_ratio",
              "Noise of soundings divided by their scatter within a submap",
              "",
              2,
              1.0,
              Root(n.sounding_variance_ratio)),
          Row("shared_error_percent_of_altitude",
              "Height error that neighbouring soundings share, of the altitude",
              " %",
              4,
              100.0,
              n.correlated_error_ratio),
          Row("position_walk_m_per_sqrt_m",
              "Random walk of the position inside a submap",
              " m/&radic;m",
              5,
              1.0,
              n.position_walk),
          Row("heading_walk_deg_per_sqrt_m",
              "Random walk of the heading inside a submap",
              "&deg;/&radic;m",
              5,
              Rad2Deg(1.0),
              n.heading_walk)};
}

std::vector<std::string> NoiseFindings(const SurveyNoise& noise) {
  std::vector<std::string> findings;
  if (noise.components.closures > 0) AddOverlaps(noise.components, &findings);
  for (std::string& finding : TimingFindings(noise.timing)) findings.push_back(std::move(finding));
  return findings;
}

}  // namespace seastitch
