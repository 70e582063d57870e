#include "products/report.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "products/noise_report.hpp"

namespace seastitch {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostLoopRows = 500;

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

double Percent(double part, double whole) {
  return whole > 0.0 ? 100.0 * part / whole : std::numeric_limits<double>::quiet_NaN();
}

void AddTruth(Json* report, const ProductSummary& s) {
  const TruthComparison& t = *s.truth;
  Json& r = *report;
  r["position_rms_m"] = BeforeAfter(t.before.position_rms_m, t.after.position_rms_m);
  r["position_max_m"] = BeforeAfter(t.before.position_max_m, t.after.position_max_m);
  r["yaw_rms_deg"] = BeforeAfter(t.before.yaw_rms_deg, t.after.yaw_rms_deg);
  r["truth"] = {{"states", t.before.states},
                {"yaw_mean_deg", BeforeAfter(t.before.yaw_mean_deg, t.after.yaw_mean_deg)},
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

void AddSaid(Json* report, const TruthComparison& said) {
  const auto pair = [](double nav, double corrected) {
    return Json{{"nav", Measured(nav)}, {"nav_corrected", Measured(corrected)}};
  };
  (*report)["truth"]["as_said"] = {
      {"states", said.before.states},
      {"position_rms_m", pair(said.before.position_rms_m, said.after.position_rms_m)},
      {"position_max_m", pair(said.before.position_max_m, said.after.position_max_m)},
      {"aligned_position_rms_m",
       pair(said.before_aligned.position_rms_m, said.after_aligned.position_rms_m)},
      {"yaw_rms_deg", pair(said.before.yaw_rms_deg, said.after.yaw_rms_deg)}};
}

void AddClosuresAgainstTruth(Json* report, const ClosureErrors& e) {
  (*report)["truth"]["loop_closures"] = {{"believed", e.closures},
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

// What the input had that is not in the map, by reason.
std::map<std::string, std::int64_t> Refused(const Survey& survey, const ProductOptions& options) {
  std::map<std::string, std::int64_t> refused = options.refused;
  for (const auto& [reason, count] : survey.counters)
    refused[reason] += static_cast<std::int64_t>(count);
  return refused;
}

struct MountingRow {
  const char* name;  // in report.json
  const char* label;
  double value;
  double sigma;
  const char* unit;
};

// What the closures say of the mounting, as far as it was looked for.
std::vector<MountingRow> MountingRows(const Survey& survey, const ProductSummary& s) {
  if (s.loops_refused == s.loops_accepted) return {};
  const MountingErrors& m = survey.solution.mounting;
  const Eigen::Vector3d sigma = m.covariance.diagonal().cwiseSqrt();
  std::vector<MountingRow> rows{
      {"sonar_forward_m", "Sonar stands forward by", m.sonar_m.x(), sigma.x(), " m"},
      {"sonar_starboard_m", "Sonar stands to starboard by", m.sonar_m.y(), sigma.y(), " m"},
      {"dvl_yaw_deg",
       "DVL is turned clockwise against the sonar, beyond what navigation learned, by",
       Rad2Deg(m.dvl_yaw_rad),
       Rad2Deg(sigma.z()),
       "&deg;"}};
  std::erase_if(rows, [](const MountingRow& row) { return row.sigma == 0.0; });
  return rows;
}

Json MountingJson(const Survey& survey, const ProductSummary& s) {
  Json json = Json::object();
  for (const MountingRow& row : MountingRows(survey, s))
    json[row.name] = {{"value", row.value}, {"sigma", row.sigma}};
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

Json NoiseJson(const ProductSummary& s, const SurveyNoise& noise) {
  Json json = {{"closures", noise.components.closures}};
  for (const NoiseRow& row : NoiseRows(noise))
    json[row.name] = {{"configured", row.configured}, {"value", row.value}, {"sigma", row.sigma}};
  json["sonar_time_offset"] = {{"configured_s", noise.timing.told_s},
                               {"by_roll", ToJson(noise.timing.roll)},
                               {"by_pitch", ToJson(noise.timing.pitch)}};
  json["findings"] = s.noise_findings;
  return json;
}

// What became of the samples of navigation, by name.
std::map<std::string, std::int64_t> NavigationCounters(const ProductOptions& options) {
  std::map<std::string, std::int64_t> counters;
  for (const auto& [name, count] : options.mapper_counters)
    if (name.starts_with("nav_")) counters[name] = count;
  return counters;
}

Json NavigationJson(const Survey& survey, const ProductOptions& options) {
  Json json{{"conditions_at_end", options.conditions}, {"counters", NavigationCounters(options)}};
  if (survey.track.empty()) return json;
  const Eigen::Vector3d& sigma = survey.track.back().sigma;
  json["stated_at_end"] = {{"sigma_north_m", sigma.x()},
                           {"sigma_east_m", sigma.y()},
                           {"sigma_heading_deg", Rad2Deg(sigma.z())}};
  return json;
}

// Text for HTML; everything that comes from outside passes here.
std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string Fixed(double value, int digits) {
  if (!std::isfinite(value)) return "&ndash;";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string Grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > 3;) {
    at -= 3;
    text.insert(at, "&#8239;");
  }
  return text;
}

class HtmlTable {
 public:
  explicit HtmlTable(const std::vector<std::string>& head) : html_("<table>\n<tr>") {
    for (const std::string& h : head) html_ += "<th>" + h + "</th>";
    html_ += "</tr>\n";
  }
  void Row(const std::vector<std::string>& cells) {
    html_ += "<tr>";
    for (const std::string& c : cells) html_ += "<td>" + c + "</td>";
    html_ += "</tr>\n";
  }
  std::string Finish() { return html_ + "</table>\n"; }

 private:
  std::string html_;
};

const char* BannerClass(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCorrected: return "good";
    case Outcome::kNothingToCorrect: return "plain";
    case Outcome::kWithheld: return "bad";
    case Outcome::kTrackAlone: return "plain";
  }
  return "plain";
}

std::string BeforeAfterTable(const ProductSummary& s) {
  HtmlTable table({"", "Dead reckoned", "Delivered map"});
  const ErrorFigures &b = s.before.point, &a = s.after().point;
  table.Row({"Consistency error, RMS", Fixed(b.rms_m, 3) + " m", Fixed(a.rms_m, 3) + " m"});
  table.Row({"&ensp;median", Fixed(b.median_m, 3) + " m", Fixed(a.median_m, 3) + " m"});
  table.Row({"&ensp;95 % of cells below", Fixed(b.p95_m, 3) + " m", Fixed(a.p95_m, 3) + " m"});
  table.Row({"Surface error, RMS",
             Fixed(s.before.surface.rms_m, 3) + " m",
             Fixed(s.after().surface.rms_m, 3) + " m"});
  table.Row({"&ensp;95 % of cells below",
             Fixed(s.before.surface.p95_m, 3) + " m",
             Fixed(s.after().surface.p95_m, 3) + " m"});
  table.Row({"Cells compared", Grouped(b.cells), Grouped(a.cells)});
  if (s.truth) {
    const TrackError &tb = s.truth->before, &ta = s.truth->after;
    table.Row({"Position error against truth, RMS",
               Fixed(tb.position_rms_m, 2) + " m",
               Fixed(ta.position_rms_m, 2) + " m"});
    table.Row(
        {"&ensp;largest", Fixed(tb.position_max_m, 2) + " m", Fixed(ta.position_max_m, 2) + " m"});
    table.Row({"&ensp;of the shape alone, RMS",
               Fixed(s.truth->before_aligned.position_rms_m, 2) + " m",
               Fixed(s.truth->after_aligned.position_rms_m, 2) + " m"});
    table.Row({"&ensp;at the end, of distance",
               Fixed(Percent(tb.position_end_m, s.distance_m), 3) + " %",
               Fixed(Percent(ta.position_end_m, s.distance_m), 3) + " %"});
    table.Row({"Heading error against truth, RMS",
               Fixed(tb.yaw_rms_deg, 3) + "&deg;",
               Fixed(ta.yaw_rms_deg, 3) + "&deg;"});
    table.Row({"&ensp;in the mean",
               Fixed(tb.yaw_mean_deg, 3) + "&deg;",
               Fixed(ta.yaw_mean_deg, 3) + "&deg;"});
  }
  if (s.said) {
    table.Row({"As said at the time: NAV, NAV_CORRECTED, RMS",
               Fixed(s.said->before.position_rms_m, 2) + " m",
               Fixed(s.said->after.position_rms_m, 2) + " m"});
    table.Row({"&ensp;largest",
               Fixed(s.said->before.position_max_m, 2) + " m",
               Fixed(s.said->after.position_max_m, 2) + " m"});
    table.Row({"&ensp;of the shape alone, RMS",
               Fixed(s.said->before_aligned.position_rms_m, 2) + " m",
               Fixed(s.said->after_aligned.position_rms_m, 2) + " m"});
  }
  return table.Finish();
}

std::string SurveyTable(const ProductSummary& s, const ProductOptions& options) {
  HtmlTable table({"Survey", ""});
  table.Row({"Track", Fixed(s.distance_m, 0) + " m in " + Fixed(s.duration_s / 60.0, 1) + " min"});
  table.Row({"Submaps", Grouped(s.submaps)});
  table.Row({"Soundings read, used", Grouped(s.soundings_read) + ", " + Grouped(s.soundings_used)});
  table.Row({"Points in the map", Grouped(s.points)});
  table.Row({"Cell", Fixed(s.cell_m, 2) + " m, " + Grouped(s.cells_mapped) + " with depth"});
  table.Row({"Cells seen by two or more submaps",
             Grouped(s.before_all.point.cells) + " dead reckoned, " +
                 Grouped(s.solved_all.point.cells) + " solved"});
  table.Row({"Loop closures",
             Grouped(s.loops_accepted) + " accepted, " + Grouped(s.loops_refused) +
                 " of them refused by the graph, " + Grouped(s.loops_rejected) + " rejected"});
  table.Row({"Their height offset",
             "mean " + Fixed(s.z_offset_mean_m, 3) + " m, scatter " + Fixed(s.z_offset_sigma_m, 3) +
                 " m, largest " + Fixed(s.z_offset_max_m, 3) + " m"});
  table.Row({"Largest correction of a submap",
             Fixed(s.correction_max_m, 2) + " m, " + Fixed(s.correction_max_yaw_deg, 3) + "&deg;"});
  if (!options.configuration.empty()) table.Row({"Configuration", Escaped(options.configuration)});
  if (options.datum) {
    table.Row({"Datum (WGS 84)",
               Fixed(options.datum->latitude_deg, 7) + "&deg;, " +
                   Fixed(options.datum->longitude_deg, 7) + "&deg;"});
  }
  for (const auto& [name, seed] : options.seeds) {
    table.Row({"Seed: " + Escaped(name), std::to_string(seed)});
  }
  return table.Finish();
}

std::string ClosuresAgainstTruth(const ClosureErrors& e) {
  return "<p>Against the truth, the squared errors of the " + Grouped(e.closures) +
         " closures believed, over what their covariances say, are " + Fixed(e.chi2, 1) + " of " +
         Grouped(e.degrees_of_freedom) + " degrees of freedom, the worst " +
         Fixed(e.worst_chi2, 1) + ": honest covariances make the first about as large as the " +
         "second; one closure in a thousand that is known in all three directions is above "
         "16.</p>\n";
}

std::string DivesList(const std::vector<DiveInMap>& dives) {
  const std::vector<std::string> sentences = SentencesOf(dives);
  if (sentences.empty()) return {};
  std::string html = "<h2>Dives</h2>\n<ul>\n";
  for (const std::string& sentence : sentences) html += "<li>" + Escaped(sentence) + "</li>\n";
  return html + "</ul>\n";
}

Json DivesJson(const std::vector<DiveInMap>& dives) {
  Json list = Json::array();
  for (const DiveInMap& dive : dives) {
    Json closures = Json::object();
    for (const auto& [other, count] : dive.closures) closures[dives[other].name] = count;
    list.push_back({{"name", dive.name},
                    {"submaps", dive.submaps},
                    {"closures_with", closures},
                    {"group", dive.group}});
  }
  return list;
}

std::string MountingTable(const Survey& survey, const ProductSummary& s) {
  const std::vector<MountingRow> rows = MountingRows(survey, s);
  if (rows.empty()) return {};
  HtmlTable table({"Against vehicle.yaml", "Found", "1 sigma"});
  for (const MountingRow& row : rows)
    table.Row({row.label, Fixed(row.value, 3) + row.unit, Fixed(row.sigma, 3) + row.unit});
  return "<h2>Mounting</h2>\n<p class=\"small\">Errors that all submaps share, so that no "
         "closure can be met by moving them: the graph finds them beside the submaps, and "
         "this map is without them. Where one is many sigma from zero, mend vehicle.yaml: add "
         "the first two to position_m of mbes, or, where a patch test says so, see to the "
         "sonar's latency (times speed) or pitch (times altitude), which shift it forward or "
         "back alike; take the angle from the yaw of mbes, or, where the DVL is known to be "
         "the one that is turned, add it to that of dvl. Then replay: near the limits of "
         "sonar_mounting_sigma_m less than the whole error is found, and what is several times as "
         "large is not found at all until that key is raised.</p>\n" +
         table.Finish();
}

std::string Milliseconds(double seconds) { return Fixed(1000.0 * seconds, 1) + " ms"; }

std::string NoiseTable(const ProductSummary& s, const SurveyNoise& noise) {
  HtmlTable table({"", "Configured", "Found", "1 sigma"});
  for (const NoiseRow& row : NoiseRows(noise))
    table.Row({row.label,
               Fixed(row.configured, row.digits) + row.unit,
               Fixed(row.value, row.digits) + row.unit,
               Fixed(row.sigma, row.digits) + row.unit});
  const auto add = [&](const char* label, const std::optional<TimeOffsetEstimate>& offset) {
    if (offset)
      table.Row({label,
                 Milliseconds(noise.timing.told_s),
                 Milliseconds(noise.timing.told_s + offset->add_s),
                 Milliseconds(offset->sigma_s)});
  };
  add("Time offset of the sonar's stamps, by roll", noise.timing.roll);
  add("&ensp;by pitch", noise.timing.pitch);
  std::string html = "<h2>Noise</h2>\n<p>";
  for (const std::string& finding : s.noise_findings) html += Escaped(finding) + " ";
  const bool is_examined = noise.components.closures > 0 || noise.timing.roll || noise.timing.pitch;
  if (s.noise_findings.empty())
    html += is_examined ? "Nothing is clearly off." : "Not examined: no closure was registered.";
  return html +
         "</p>\n<p class=\"small\">Where submaps overlap, what is left between them says how noisy "
         "the survey is; each closure's covariance is stated from these figures. The time offset "
         "is that by which changes of the roll rate (of the pitch rate, where the seabed slopes "
         "along) change the seabed from ping to ping.</p>\n" +
         table.Finish();
}

std::string LoopTable(const Survey& survey) {
  const std::vector<LoopRow> rows = LoopRows(survey);
  if (rows.empty()) return "<p>No pair of submaps was registered.</p>\n";
  HtmlTable table({"From",
                   "To",
                   "Verdict",
                   "Weight",
                   "x (m)",
                   "y (m)",
                   "yaw (&deg;)",
                   "Height offset (m)",
                   "Fit RMS (m)",
                   "Overlap (m&sup2;)"});
  for (std::size_t i = 0; i < std::min(rows.size(), kMostLoopRows); ++i) {
    const GraphEdge& e = *rows[i].edge;
    table.Row({std::to_string(e.from.value),
               std::to_string(e.to.value),
               ToString(e.verdict),
               Fixed(rows[i].weight, 2),
               Fixed(e.T_from_to.x, 2),
               Fixed(e.T_from_to.y, 2),
               Fixed(Rad2Deg(e.T_from_to.yaw), 2),
               Fixed(e.z_offset_m, 3),
               Fixed(e.rms_m, 3),
               Fixed(e.overlap_m2, 0)});
  }
  std::string html = table.Finish();
  if (rows.size() > kMostLoopRows) {
    html += "<p>" + Grouped(rows.size() - kMostLoopRows) +
            " more are in survey.gpkg, layer edges.</p>\n";
  }
  return html;
}

std::string NavigationSection(const Survey& survey, const ProductOptions& options) {
  if (survey.track.empty()) return {};
  std::string html = "<h2>Navigation</h2>\n";
  for (const std::string& condition : options.conditions)
    html += "<p>At the end: " + Escaped(condition) + "</p>\n";
  const Eigen::Vector3d& sigma = survey.track.back().sigma;
  HtmlTable table({"Dead reckoning", ""});
  table.Row({"Stated at the end, 1 sigma: north, east, heading",
             Fixed(sigma.x(), 2) + " m, " + Fixed(sigma.y(), 2) + " m, " +
                 Fixed(Rad2Deg(sigma.z()), 2) + "&deg;"});
  for (const auto& [name, count] : NavigationCounters(options))
    table.Row({Escaped(name), std::to_string(count)});
  return html + table.Finish();
}

std::string Figure(const char* file, const char* caption) {
  return std::string("<figure><a href=\"") + file + "\"><img src=\"" + file + "\" alt=\"" +
         caption + "\"></a><figcaption>" + caption + "</figcaption></figure>\n";
}

std::string MapSections(const Survey& survey,
                        const ProductSummary& s,
                        const ProductOptions& options) {
  std::string html = "<h2>Depth</h2>\n<div class=\"pair\">\n";
  html += Figure("depth_dead_reckoned.png", "Dead reckoned") + Figure("depth.png", "Delivered map");
  html += "</div>\n<h2>Consistency</h2>\n<div class=\"pair\">\n";
  html += Figure("consistency_dead_reckoned.png", "Dead reckoned") +
          Figure("consistency.png", "Delivered map");
  html +=
      "</div>\n<p class=\"small\">In every cell that two or more submaps see: the largest "
      "distance by which the points of one submap miss those of another (Roman and Singh, "
      "2006). The surface error measures from the points of one submap to the surface of the "
      "other instead, which keeps the distance between neighbouring points out of it; the pictures "
      "show that one. Before and "
      "after are compared over the cells seen twice both times. The same "
      "colours mean the same error on both pictures.";
  if (s.truth) {
    html +=
        " Errors against truth are horizontal, along the track as it was delivered; those of the "
        "shape alone are what is left after the rigid motion that lays the track best on the "
        "truth.";
  }
  html +=
      " SLAM makes a map agree with itself; it does not by itself make its absolute position "
      "more accurate.</p>\n";
  if (s.outcome == Outcome::kCorrected) html += MountingTable(survey, s);
  html += NoiseTable(s, options.noise);
  html += DivesList(s.dives);
  html += "<h2>Loop closures</h2>\n";
  if (s.closures_against_truth) html += ClosuresAgainstTruth(*s.closures_against_truth);
  html += LoopTable(survey);
  return html;
}

constexpr const char* kStyle = R"(
body{font:15px/1.5 "DejaVu Sans",system-ui,sans-serif;color:#21262d;max-width:1240px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:2em}
table{border-collapse:collapse;margin:1em 0}th,td{padding:.25em .9em;border-bottom:1px solid #dfe3e8;text-align:left}
th{background:#f3f5f7}td{font-variant-numeric:tabular-nums}
.banner{padding:.8em 1em;border-left:5px solid;background:#f3f5f7;margin:1em 0}
.good{border-color:#2f9e62}.plain{border-color:#7a8794}.bad{border-color:#c8453c}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(440px,1fr));gap:1em}
figure{margin:0}img{width:100%;border:1px solid #dfe3e8}figcaption{font-size:.9em;color:#57606a}
.small{font-size:.9em;color:#57606a}
)";

}  // namespace

std::string ReportJson(const Survey& survey,
                       const ProductSummary& s,
                       const ProductOptions& options) {
  Json r;
  r["title"] = options.title;
  r["outcome"] = ToString(s.outcome);
  r["statement"] = s.statement;
  r["partial"] = s.partial;
  r["configuration"] = options.configuration;
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
  r["mounting"] = MountingJson(survey, s);
  r["noise"] = NoiseJson(s, options.noise);
  if (!s.dives.empty()) r["dives"] = DivesJson(s.dives);
  r["soundings"] = {{"read", s.soundings_read}, {"used", s.soundings_used}};
  r["points"] = s.points;
  if (s.truth) AddTruth(&r, s);
  if (s.said) AddSaid(&r, *s.said);
  if (s.closures_against_truth) AddClosuresAgainstTruth(&r, *s.closures_against_truth);
  r["consistency"] = {
      {"cell_m", s.cell_m},
      {"measure", "Roman and Singh 2006; see products/consistency.hpp"},
      {"compared_cells", {{"dead_reckoned", ToJson(s.before)}, {"solved", ToJson(s.solved)}}},
      {"all_cells", {{"dead_reckoned", ToJson(s.before_all)}, {"solved", ToJson(s.solved_all)}}}};
  r["map"] = {{"cell_m", s.cell_m}, {"cells", s.cells_mapped}};
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
  r["refused"] = Refused(survey, options);
  r["navigation"] = NavigationJson(survey, options);
  r["mapper_counters"] = options.mapper_counters;
  if (options.run_figures) AddRun(&r, options.run_figures());
  return r.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string ReportHtml(const Survey& survey,
                       const ProductSummary& s,
                       const ProductOptions& options) {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>";
  html += Escaped(options.title) + "</title><style>" + kStyle + "</style></head><body>\n";
  html += "<h1>" + Escaped(options.title) + "</h1>\n";
  html += std::string("<div class=\"banner ") + BannerClass(s.outcome) + "\">" +
          Escaped(s.statement) + "</div>\n";
  html += BeforeAfterTable(s) + SurveyTable(s, options);
  if (s.outcome != Outcome::kTrackAlone) html += MapSections(survey, s, options);
  html += NavigationSection(survey, options);
  if (const auto refused = Refused(survey, options); !refused.empty()) {
    HtmlTable table({"Refused, late or doubled", "Count"});
    for (const auto& [reason, count] : refused)
      table.Row({Escaped(reason), Grouped(static_cast<std::uint64_t>(count))});
    html += "<h2>Refused input</h2>\n" + table.Finish();
  }
  if (!options.mapper_counters.empty()) {
    HtmlTable table({"Counted by the mapper", "Count"});
    for (const auto& [name, count] : options.mapper_counters)
      table.Row({Escaped(name), std::to_string(count)});
    html += "<h2>Mapper</h2>\n" + table.Finish();
  }
  if (s.outcome == Outcome::kTrackAlone)
    return html +
           "<p class=\"small\">Beside this page: track.csv, survey.gpkg, export/, report.json "
           "(with "
           "run time and memory).</p>\n</body></html>\n";
  html +=
      "<p class=\"small\">Beside this page: depth.tif, depth_dead_reckoned.tif (mean depth, "
      "spread, soundings), consistency.tif, consistency_dead_reckoned.tif, track.csv, "
      "poses.txt, graph.g2o, survey.gpkg, submaps/, report.json (with run time and memory)."
      "</p>\n</body></html>\n";
  return html;
}

}  // namespace seastitch
