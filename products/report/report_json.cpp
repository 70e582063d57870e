#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "products/product_files.hpp"
#include "products/report/report.hpp"

namespace seastitch {
namespace {

using Json = nlohmann::ordered_json;

Json Measured(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json BeforeAfter(double before, double after) {
  return {{"before", Measured(before)}, {"after", Measured(after)}};
}

Json ToJson(const ErrorFigures& f) {
  return {{"rms_m", Measured(f.rms_m)},
          {"median_m", Measured(f.median_m)},
          {"p95_m", Measured(f.p95_m)},
          {"cells", f.cells}};
}

Json ToJson(const ConsistencyFigures& f) {
  return {{"point_error", ToJson(f.point)}, {"surface_error", ToJson(f.surface)}};
}

void AddTruth(Json* report, const ProductSummary& s) {
  const TruthComparison& t = *s.truth;
  Json& r = *report;
  r["position_rms_m"] = BeforeAfter(t.before.position_rms_m, t.after.position_rms_m);
  r["position_max_m"] = BeforeAfter(t.before.position_max_m, t.after.position_max_m);
  r["yaw_rms_deg"] = BeforeAfter(t.before.yaw_rms_deg, t.after.yaw_rms_deg);
  r["truth"] = {
      {"states", t.before.states},
      {"yaw_mean_deg", BeforeAfter(t.before.yaw_mean_deg, t.after.yaw_mean_deg)},
      {"position_change_m", BeforeAfter(t.before.position_change_m, t.after.position_change_m)},
      {"aligned_position_rms_m",
       BeforeAfter(t.before_aligned.position_rms_m, t.after_aligned.position_rms_m)},
      {"aligned_yaw_rms_deg",
       BeforeAfter(t.before_aligned.yaw_rms_deg, t.after_aligned.yaw_rms_deg)},
      {"drift_percent_of_distance",
       {{"at_end",
         BeforeAfter(Percent(t.before.position_end_m, s.distance_m),
                     Percent(t.after.position_end_m, s.distance_m))},
        {"largest",
         BeforeAfter(Percent(t.before.position_max_m, s.distance_m),
                     Percent(t.after.position_max_m, s.distance_m))}}}};
}

void AddPublished(Json* report, const TruthComparison& published) {
  const auto pair = [](double nav, double corrected) {
    return Json{{"nav", Measured(nav)}, {"nav_corrected", Measured(corrected)}};
  };
  (*report)["truth"]["as_published"] = {
      {"states", published.before.states},
      {"position_rms_m", pair(published.before.position_rms_m, published.after.position_rms_m)},
      {"position_max_m", pair(published.before.position_max_m, published.after.position_max_m)},
      {"aligned_position_rms_m",
       pair(published.before_aligned.position_rms_m, published.after_aligned.position_rms_m)},
      {"yaw_rms_deg", pair(published.before.yaw_rms_deg, published.after.yaw_rms_deg)}};
}

void AddClosuresAgainstTruth(Json* report, const ClosureErrors& e) {
  (*report)["truth"]["loop_closures"] = {{"accepted", e.closures},
                                         {"degrees_of_freedom", e.degrees_of_freedom},
                                         {"chi2", e.chi2},
                                         {"worst_chi2", e.worst_chi2}};
}

void AddRun(Json* report, const RunFigures& run) {
  const Json figures = {{"wall_s", run.wall_s},
                        {"cpu_s", run.cpu_s},
                        {"peak_rss_mb", run.peak_rss_mb},
                        {"realtime_factor", run.realtime_factor}};
  report->update(figures);
  (*report)["run"] = figures;
  (*report)["not_reproducible"] = {"wall_s", "cpu_s", "peak_rss_mb", "realtime_factor", "run"};
}

Json MountingJson(const std::vector<MountingRow>& rows) {
  Json json = Json::object();
  for (const MountingRow& row : rows) json[row.name] = {{"value", row.value}, {"sigma", row.sigma}};
  return json;
}

Json ToJson(const std::optional<TimeOffsetEstimate>& offset) {
  if (!offset) return nullptr;
  return {{"add_s", offset->add_s},
          {"sigma_s", offset->sigma_s},
          {"pings", offset->pings},
          {"change_before", offset->change_before},
          {"change_after", offset->change_after}};
}

Json TimingJson(const SonarTimingEstimate& timing) {
  Json json{{"configured_s", timing.configured_s}, {"by_roll", ToJson(timing.roll)}};
  if (timing.roll_scale)
    json["roll_scale"] = {{"add_percent", timing.roll_scale->add_percent},
                          {"sigma_percent", timing.roll_scale->sigma_percent}};
  return json;
}

Json NoiseJson(const Report& report) {
  const ProductOptions& options = report.options;
  Json json;
  if (!options.noise_not_estimated.empty())
    json["not_estimated"] = options.noise_not_estimated;
  else
    json["closures"] = options.noise.components.closures;
  for (const NoiseRow& row : report.noise)
    json[row.name] = {{"configured", row.configured},
                      {"value", row.value},
                      {"sigma", row.sigma},
                      {"bound", row.bound != nullptr ? Json(row.bound) : Json(nullptr)}};
  if (!report.has_several_dives()) json["sonar_time_offset"] = TimingJson(options.noise.timing);
  json["findings"] = report.summary.noise_findings;
  return json;
}

Json ToJson(const StampOffsetEstimate& offset) {
  return {{"key", offset.key},
          {"configured_s", offset.configured_s},
          {"suggested_s", offset.configured_s + offset.add_s},
          {"sigma_s", offset.sigma_s},
          {"suspected_s", offset.suspected_s}};
}

Json ToJson(const NavigationDifference& difference) {
  return {{"source", difference.source},
          {"states", difference.states},
          {"duration_s", difference.duration_s},
          {"rms_m", difference.rms_m},
          {"max_m", difference.max_m},
          {"heading_mean_deg", difference.heading_mean_deg}};
}

Json NavigationJson(const Report::Dive& dive) {
  Json json{{"conditions_at_end", dive.results.conditions},
            {"counters", dive.navigation_counters},
            {"time_offsets", Json::array()}};
  for (const StampOffsetEstimate& offset : dive.results.stamp_offsets)
    json["time_offsets"].push_back(ToJson(offset));
  if (dive.results.other_navigation)
    json["other_navigation"] = ToJson(*dive.results.other_navigation);
  if (!dive.last) return json;
  json["stated_at_end"] = {{"sigma_north_m", dive.last->sigma.x()},
                           {"sigma_east_m", dive.last->sigma.y()},
                           {"sigma_heading_deg", Rad2Deg(dive.last->sigma.z())}};
  return json;
}

Json ValuesJson(const SonarCalibration& calibration) {
  Json json = Json::object();
  for (const CalibrationName& of : kCalibrationNames)
    json[of.name] = calibration.*of.value / of.per_unit;
  return json;
}

Json ToJson(const SlowError& error, double scale) {
  if (error.sigma == 0.0) return nullptr;
  return {{"rms", error.rms * scale}, {"sigma", error.sigma * scale}};
}

// The rounds: what was used, and what the overlaps add to it.
Json ToJson(const std::vector<CalibrationEstimate>& rounds) {
  Json list = Json::array();
  for (const CalibrationEstimate& e : rounds) {
    Json values = Json::object();
    for (const CalibrationName& of : kCalibrationNames) {
      const CalibratedValue& value = e.Of(of.key);
      if (value.sigma == 0.0) continue;
      values[of.name] = {{"add", value.add / of.per_unit},
                         {"sigma", value.sigma / of.per_unit},
                         {"is_clear", value.is_clear}};
    }
    list.push_back({{"used", ValuesJson(e.used)},
                    {"values", values},
                    {"pairs", e.pairs},
                    {"cells", e.cells},
                    {"overlaps_rms_m", {{"before", e.before_m}, {"after", e.after_m}}},
                    {"slow_depth_m", ToJson(e.depth_m, 1.0)},
                    {"slow_roll_deg", ToJson(e.roll_rad, Rad2Deg(1.0))}});
  }
  return list;
}

Json DivesJson(const Report& report) {
  Json list = Json::array();
  const std::vector<DiveInMap>& dives = report.summary.dives;
  for (std::size_t k = 0; k < dives.size(); ++k) {
    const DiveInMap& dive = dives[k];
    Json closures = Json::object();
    for (const auto& [other, count] : dive.closures) closures[dives[other].name] = count;
    Json json{{"name", dive.name},
              {"submaps", dive.submaps},
              {"closures_with", closures},
              {"group", dive.group},
              {"mounting", MountingJson(report.dives[k].mounting)}};
    if (k < report.options.dives.size()) {
      const DiveReport& results = report.dives[k].results;
      json["sonar_time_offset"] = TimingJson(results.sonar);
      json["navigation"] = NavigationJson(report.dives[k]);
      json["mapper_counters"] = results.counters;
      json["calibration"] = ToJson(results.calibration);
    }
    list.push_back(std::move(json));
  }
  return list;
}

Json UnreadJson(const std::vector<UnreadDive>& unread) {
  Json list = Json::array();
  for (const auto& [name, reason] : unread) list.push_back({{"name", name}, {"reason", reason}});
  return list;
}

}  // namespace

std::string ReportJson(const Report& report) {
  const ProductSummary& s = report.summary;
  const ProductOptions& options = report.options;
  const bool has_one_dive = !report.has_several_dives();
  Json r;
  r["products_version"] = product_files::kVersion;
  r["title"] = options.title;
  r["outcome"] = ToString(s.outcome);
  r["statement"] = s.statement;
  r["partial"] = s.partial;
  r["warnings"] = Json::array();
  for (const MapWarning& warning : options.warnings)
    r["warnings"].push_back({{"code", NameOf(warning.code)},
                             {"text", warning.text},
                             {"effect_m", warning.effect_m ? Json(*warning.effect_m) : Json()}});
  r["configuration"] = options.configuration;
  if (options.configuration_crc != 0)
    r["configuration_hash"] = ConfigurationHash(options.configuration_crc);
  if (!options.vehicles.empty() && !options.vehicles[0].name.empty())
    r["vehicle"] = options.vehicles[0].name;
  r["advice"] = Json::array();
  for (const Advice& advice : report.advice)
    r["advice"].push_back({{"file", advice.file},
                           {"key", advice.key},
                           {"now", advice.now},
                           {"suggested", advice.suggested},
                           {"reason", advice.reason}});
  r["consistency_rms_m"] = BeforeAfter(s.before.point.rms_m, s.after().point.rms_m);
  r["surface_rms_m"] = BeforeAfter(s.before.surface.rms_m, s.after().surface.rms_m);
  r["submaps"] = s.submaps;
  r["loop_closures"] = {{"accepted", s.loops_accepted},
                        {"refused_by_graph", s.loops_refused},
                        {"rejected", s.loops_rejected},
                        {"verdicts", s.loop_verdicts},
                        {"z_offset_m",
                         {{"mean", Measured(s.z_offset_mean_m)},
                          {"sigma", Measured(s.z_offset_sigma_m)},
                          {"largest", Measured(s.z_offset_max_m)}}}};
  // What each dive has stands in `dives` where there are several.
  if (has_one_dive) r["mounting"] = MountingJson(report.dives[0].mounting);
  r["noise"] = NoiseJson(report);
  if (has_one_dive && options.dives.size() == 1)
    r["calibration"] = ToJson(report.dives[0].results.calibration);
  if (!has_one_dive) r["dives"] = DivesJson(report);
  if (!has_one_dive || !options.unread.empty()) r["dives_not_read"] = UnreadJson(options.unread);
  r["soundings"] = {{"read", s.soundings_read}, {"used", s.soundings_used}};
  r["points"] = s.points;
  if (s.truth) AddTruth(&r, s);
  if (s.published) AddPublished(&r, *s.published);
  if (s.closures_against_truth) AddClosuresAgainstTruth(&r, *s.closures_against_truth);
  r["consistency"] = {
      {"cell_m", s.cell_m},
      {"measure", "Roman and Singh 2006; see products/map/consistency.hpp"},
      {"compared_cells", {{"dead_reckoned", ToJson(s.before)}, {"solved", ToJson(s.solved)}}},
      {"all_cells", {{"dead_reckoned", ToJson(s.before_all)}, {"solved", ToJson(s.solved_all)}}}};
  for (std::size_t k = 0; s.s44.cells > 0 && k < kS44Orders.size(); ++k)
    r["s44_percent"][kS44Orders[k].key] =
        Percent(static_cast<double>(s.s44.within[k]), static_cast<double>(s.s44.cells));
  r["map"] = {{"cell_m", s.cell_m}, {"cells", s.cells_mapped}, {"crs", s.crs}};
  r["track"] = {{"distance_m", s.distance_m}, {"duration_s", s.duration_s}};
  r["correction"] = {
      {"largest_m", s.correction_max_m},
      {"at_end_m", s.correction_end_m},
      {"largest_yaw_deg", s.correction_max_yaw_deg},
      {"at_end_percent_of_distance", Measured(Percent(s.correction_end_m, s.distance_m))}};
  if (options.datum) {
    r["datum"] = {{"latitude_deg", options.datum->latitude_deg},
                  {"longitude_deg", options.datum->longitude_deg}};
  }
  r["seeds"] = options.seeds;
  r["refused"] = report.refused;
  r["navigation"] = has_one_dive ? NavigationJson(report.dives[0])
                                 : Json{{"conditions_at_end", options.conditions}};
  r["mapper_counters"] = options.mapper_counters;
  if (options.run_figures) AddRun(&r, options.run_figures());
  return r.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace seastitch
