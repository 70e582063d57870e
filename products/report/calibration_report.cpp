#include "products/report/calibration_report.hpp"

#include <vector>

#include "common/core/calibration.hpp"
#include "viewer/html.hpp"

namespace seastitch {
namespace {

std::string WithUnit(double value, const CalibrationName& of) {
  return Fixed(value / of.per_unit + 0.0, 3) + " " + of.unit;
}

std::string Estimated(const CalibratedValue& value, const CalibrationName& of) {
  return Fixed(value.add / of.per_unit, 3) + " &plusmn; " + WithUnit(value.sigma, of);
}

std::string Table(const std::vector<CalibrationEstimate>& rounds) {
  HtmlTable table({"", "Configured", "Used in this map", "Overlaps of this map add"});
  for (const CalibrationName& of : kCalibrationNames)
    if (rounds.back().Of(of.key).sigma > 0.0)
      table.Row({of.name,
                 WithUnit(rounds.front().used.*of.value, of),
                 WithUnit(rounds.back().used.*of.value, of),
                 Estimated(rounds.back().Of(of.key), of)});
  return table.Finish();
}

// What changes during the survey.
std::string SlowErrors(const CalibrationEstimate& estimate) {
  std::string text;
  if (estimate.depth_m.IsClear())
    text += " Submaps lie up and down by " + Fixed(estimate.depth_m.rms, 3) + " m RMS (1 sigma " +
            Fixed(estimate.depth_m.sigma, 3) +
            " m), slowly over the survey, as by a tide or a draught that changes: "
            "give a table of it as <code>water_level</code> of mapper.yaml.";
  if (estimate.roll_rad.IsClear())
    text += " The roll of submaps wanders by " + Fixed(Rad2Deg(estimate.roll_rad.rms), 3) +
            " deg RMS (1 sigma " + Fixed(Rad2Deg(estimate.roll_rad.sigma), 3) + " deg).";
  return text;
}

std::string Sentences(const std::vector<CalibrationEstimate>& rounds) {
  const CalibrationEstimate& first = rounds.front();
  std::string text = "Estimated from " + std::to_string(first.cells) +
                     " cells that two submaps measured, in " + std::to_string(first.pairs) +
                     " pairs. ";
  if (rounds.size() == 1)
    return text +
           (first.HasClear() ? "What is clear was not applied: the correction of the track "
                               "was withheld, or the pings cannot be mapped again."
                             : "Nothing is applied: no value is clear, or one is larger "
                               "than any sonar has.") +
           SlowErrors(rounds.back());
  text += "The heights in overlaps differ by " + Fixed(rounds.back().before_m, 3) +
          " m RMS in place of " + Fixed(first.before_m, 3) + " m as configured.";
  if (first.Of(CalibrationKey::kSmile).is_clear)
    text +=
        " Without the smile the depth at nadir stays as it was. If the sound-speed profile is its "
        "cause, all depths are off by " +
        Fixed(100.0 * first.depth_part, 2) + " % of the altitude: overlaps do not tell.";
  return text + SlowErrors(rounds.back());
}

}  // namespace

std::string CalibrationHtml(const Report& report) {
  std::string html;
  for (const Report::Dive& dive : report.dives) {
    const std::vector<CalibrationEstimate>& rounds = dive.results.calibration;
    if (rounds.empty()) continue;
    if (!dive.name.empty()) html += "<h3>" + Escaped(dive.name) + "</h3>\n";
    html += "<p>" + Sentences(rounds) + "</p>\n" + Table(rounds);
  }
  return html;
}

}  // namespace seastitch
