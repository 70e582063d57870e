#include "products/report/report.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cstdio>
#include <limits>
#include <set>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// Whether the graph did not refuse a closure with a submap of this dive.
bool HasClosures(const Survey& survey, std::int32_t chain) {
  std::set<SubmapId> submaps;
  for (const SurveySubmap& submap : survey.submaps)
    if (submap.chain == chain) submaps.insert(submap.id);
  const std::vector<LoopRow> rows = LoopRows(survey);
  return std::any_of(rows.begin(), rows.end(), [&submaps](const LoopRow& row) {
    const bool refused = row.weight < kAcceptedWeight;
    return row.edge->verdict == LoopVerdict::kAccepted && !refused &&
           (submaps.contains(row.edge->from) || submaps.contains(row.edge->to));
  });
}

std::map<std::string, std::int64_t> Refused(const Survey& survey, const ProductOptions& options) {
  std::map<std::string, std::int64_t> refused = options.refused;
  for (const auto& [reason, count] : survey.counters)
    refused[reason] += static_cast<std::int64_t>(count);
  return refused;
}

std::string WhyNoNoise(const ProductSummary& summary, const ProductOptions& options) {
  if (!options.noise_not_estimated.empty()) return options.noise_not_estimated;
  if (options.noise.components.closures > 0) return {};
  return summary.loops_accepted > 0 ? "no accepted closure has statistics of its overlap"
                                    : "no closure was accepted";
}

// Dives stand in the order in which they were given.
std::optional<std::pair<Time, Time>> TimesOf(const Survey& survey) {
  const auto earlier = [](const TrackState& a, const TrackState& b) { return a.time < b.time; };
  const auto [first, last] = std::minmax_element(survey.track.begin(), survey.track.end(), earlier);
  if (first == survey.track.end()) return std::nullopt;
  return std::pair(first->time, last->time);
}

Report::Dive DiveOf(const Survey& survey, const ProductOptions& options, std::size_t k) {
  Report::Dive dive;
  if (k < survey.dives.size()) dive.name = survey.dives[k];
  if (k < options.dives.size()) dive.results = options.dives[k];
  const auto chain = static_cast<std::int32_t>(k);
  dive.mounting = MountingRows(survey, chain);
  for (const auto& [name, count] : dive.results.counters)
    if (name.starts_with("nav_")) dive.navigation_counters[name] = count;
  const auto last = std::find_if(
      survey.track.rbegin(), survey.track.rend(), [&](const auto& s) { return s.chain == chain; });
  if (last != survey.track.rend()) dive.last = *last;
  return dive;
}

}  // namespace

std::string ConfigurationHash(std::uint32_t crc) {
  char text[16];
  std::snprintf(text, sizeof text, "%08x", crc);
  return text;
}

double Percent(double part, double whole) {
  return whole > 0.0 ? 100.0 * part / whole : std::numeric_limits<double>::quiet_NaN();
}

std::vector<MountingRow> MountingRows(const Survey& survey, std::int32_t chain) {
  if (!HasClosures(survey, chain)) return {};
  const MountingErrors m = survey.solution.MountingOf(chain);
  const Eigen::Vector3d sigma = m.covariance.diagonal().cwiseSqrt();
  std::vector<MountingRow> rows{
      {"sonar_forward_m", "Sonar is further forward by", m.sonar_m.x(), sigma.x(), " m"},
      {"sonar_starboard_m", "Sonar is further to starboard by", m.sonar_m.y(), sigma.y(), " m"},
      {"dvl_yaw_deg",
       "DVL is turned clockwise against the sonar, beyond what navigation estimated, by",
       Rad2Deg(m.dvl_yaw_rad),
       Rad2Deg(sigma.z()),
       "&deg;"}};
  std::erase_if(rows, [](const MountingRow& row) { return row.sigma == 0.0; });
  return rows;
}

Report ReportOf(const Survey& survey,
                const ProductSummary& summary,
                const ProductOptions& options) {
  Report report{summary, options};
  report.advice = AdviceOf(survey, summary, options);
  for (std::size_t k = 0; k < std::max<std::size_t>(1, summary.dives.size()); ++k)
    report.dives.push_back(DiveOf(survey, options, k));
  report.noise = NoiseRows(options.noise);
  report.why_no_noise = WhyNoNoise(summary, options);
  report.refused = Refused(survey, options);
  report.loops = LoopRows(survey);
  report.times = TimesOf(survey);
  return report;
}

}  // namespace seastitch
