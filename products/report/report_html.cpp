#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/core/time.hpp"
#include "common/runtime/process/process.hpp"
#include "products/product_files.hpp"
#include "products/report/calibration_report.hpp"
#include "products/report/counter_words.hpp"
#include "products/report/report.hpp"
#include "products/report/report_page.hpp"
#include "viewer/html.hpp"
#include "viewer/page_parts.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMostLoopRows = 500;

const char* BannerClass(const ProductSummary& summary) {
  if (summary.partial) return "part";
  switch (summary.outcome) {
    case Outcome::kCorrected: return "good";
    case Outcome::kNothingToCorrect: return "plain";
    case Outcome::kWithheld: return "bad";
    case Outcome::kTrackAlone: return "plain";
  }
  return "plain";
}

std::string BeforeAfterTable(const ProductSummary& s) {
  HtmlTable table({"", "As navigated", "Delivered map"});
  table.Row({"Swath mismatch, RMS",
             Fixed(s.before.surface.rms_m, 3) + " m",
             Fixed(s.after().surface.rms_m, 3) + " m"});
  table.Row({"&ensp;95 % of cells below",
             Fixed(s.before.surface.p95_m, 3) + " m",
             Fixed(s.after().surface.p95_m, 3) + " m"});
  const ErrorFigures &b = s.before.point, &a = s.after().point;
  table.Row({"Consistency error, RMS", Fixed(b.rms_m, 3) + " m", Fixed(a.rms_m, 3) + " m"});
  table.Row({"&ensp;median", Fixed(b.median_m, 3) + " m", Fixed(a.median_m, 3) + " m"});
  table.Row({"&ensp;95 % of cells below", Fixed(b.p95_m, 3) + " m", Fixed(a.p95_m, 3) + " m"});
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
  if (s.published) {
    table.Row({"As published live: NAV, NAV_CORRECTED, RMS",
               Fixed(s.published->before.position_rms_m, 2) + " m",
               Fixed(s.published->after.position_rms_m, 2) + " m"});
    table.Row({"&ensp;largest",
               Fixed(s.published->before.position_max_m, 2) + " m",
               Fixed(s.published->after.position_max_m, 2) + " m"});
    table.Row({"&ensp;of the shape alone, RMS",
               Fixed(s.published->before_aligned.position_rms_m, 2) + " m",
               Fixed(s.published->after_aligned.position_rms_m, 2) + " m"});
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
             Grouped(s.before_all.point.cells) + " as navigated, " +
                 Grouped(s.solved_all.point.cells) + " solved"});
  table.Row({"Loop closures",
             Grouped(s.loops_accepted) + " accepted, " + Grouped(s.loops_refused) +
                 " of them refused by the graph, " + Grouped(s.loops_rejected) + " rejected"});
  if (s.loops_accepted > 0)
    table.Row({"Their height offset",
               "mean " + Fixed(s.z_offset_mean_m, 3) + " m, scatter " +
                   Fixed(s.z_offset_sigma_m, 3) + " m, largest " + Fixed(s.z_offset_max_m, 3) +
                   " m"});
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

// Empty where no swaths overlap.
std::string S44Table(const S44Shares& shares) {
  if (shares.cells == 0) return {};
  HtmlTable table({"S-44 edition 6.1.0", "Largest TVU (95 %)", "Cells within"});
  for (std::size_t k = 0; k < kS44Orders.size(); ++k) {
    const S44Order& order = kS44Orders[k];
    table.Row(
        {order.name,
         "&radic;(" + Fixed(order.a_m, 2) + "&sup2; + (" + Fixed(order.b, 4) + " depth)&sup2;) m",
         Fixed(Percent(static_cast<double>(shares.within[k]), static_cast<double>(shares.cells)),
               2) +
             " %"});
  }
  return table.Finish();
}

std::string WarningsList(const std::vector<MapWarning>& warnings) {
  std::string html;
  for (const MapWarning& warning : warnings) html += "<li>" + Escaped(warning.text) + "</li>\n";
  return html;
}

std::string DivesList(const std::vector<DiveInMap>& dives, const std::vector<UnreadDive>& unread) {
  std::string html;
  for (const std::string& sentence : SentencesOf(dives))
    html += "<li>" + Escaped(sentence) + "</li>\n";
  for (const auto& [name, reason] : unread)
    html += "<li>" + Escaped(name + " was not read, or not to its end: " + reason) + "</li>\n";
  return html;
}

std::string MountingTable(const Report& report) {
  if (report.summary.outcome != Outcome::kCorrected) return {};
  std::string html;
  for (const Report::Dive& dive : report.dives) {
    if (dive.mounting.empty()) continue;
    std::string title = "Against vehicle.yaml";
    if (!dive.name.empty()) title = Escaped(dive.name) + ", against its vehicle.yaml";
    HtmlTable table({title, "Estimate", "1 sigma"});
    for (const MountingRow& row : dive.mounting)
      table.Row({row.label, Fixed(row.value, 3) + row.unit, Fixed(row.sigma, 3) + row.unit});
    html += table.Finish();
  }
  return html;
}

std::string Milliseconds(double seconds) { return Fixed(1000.0 * seconds, 1) + " ms"; }

void AddTiming(const std::string& dive, const SonarTimingEstimate& timing, HtmlTable* table) {
  const auto add = [&](const char* label, const std::optional<TimeOffsetEstimate>& offset) {
    if (offset)
      table->Row({Escaped(dive) + label,
                  Milliseconds(timing.configured_s),
                  Milliseconds(timing.configured_s + offset->add_s),
                  Milliseconds(offset->sigma_s)});
  };
  add("Time offset of the sonar's stamps, by roll", timing.roll);
}

// Empty if nothing was estimated.
std::string NoiseTable(const Report& report) {
  HtmlTable table({"", "Configured", "Estimate", "1 sigma"});
  for (const NoiseRow& row : report.noise)
    table.Row({row.label,
               Fixed(row.configured, row.digits) + row.unit,
               (row.bound != nullptr ? std::string(row.bound) + " " : "") +
                   Fixed(row.value, row.digits) + row.unit,
               Fixed(row.sigma, row.digits) + row.unit});
  AddTiming("", report.options.noise.timing, &table);
  if (report.has_several_dives())
    for (const Report::Dive& dive : report.dives)
      AddTiming(dive.name + ": ", dive.results.sonar, &table);
  return table.has_rows() ? table.Finish() : "";
}

std::string FindingsText(const Report& report) {
  std::string html;
  for (const std::string& finding : report.summary.noise_findings) html += Escaped(finding) + " ";
  if (!report.why_no_noise.empty())
    return html + "The noise was not estimated: " + report.why_no_noise + ".";
  return html.empty() ? "Nothing differs clearly from the configuration." : html;
}

std::string LoopTable(const std::vector<LoopRow>& rows) {
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

void AddOffsets(const DiveReport& dive, HtmlTable* table) {
  for (const StampOffsetEstimate& offset : dive.stamp_offsets)
    table->Row({offset.key + ": configured, suggested, 1 sigma",
                Milliseconds(offset.configured_s) + ", " +
                    Milliseconds(offset.configured_s + offset.add_s) + ", " +
                    Milliseconds(offset.sigma_s) + " (corrected for " +
                    Fixed(offset.suspected_s, 0) + " s)"});
}

void AddOther(const NavigationDifference& difference, HtmlTable* table) {
  table->Row({"navigation_source: " + difference.source +
                  ", difference from this track: horizontal RMS, largest; mean heading",
              Fixed(difference.rms_m, 2) + " m, " + Fixed(difference.max_m, 2) + " m, " +
                  Fixed(difference.heading_mean_deg, 2) + "&deg; (over " +
                  Fixed(difference.duration_s, 0) + " s)"});
}

std::string NavigationOf(const Report::Dive& dive) {
  if (!dive.last) return {};
  const Eigen::Vector3d& sigma = dive.last->sigma;
  const std::string head = dive.name.empty() ? "" : Escaped(dive.name) + ": ";
  std::string html;
  for (const std::string& condition : dive.results.conditions)
    html += "<p>" + head + "At the end: " + Escaped(condition) + "</p>\n";
  HtmlTable table({head + "Navigation", ""});
  table.Row({"Stated at the end, 1 sigma: north, east, heading",
             Fixed(sigma.x(), 2) + " m, " + Fixed(sigma.y(), 2) + " m, " +
                 Fixed(Rad2Deg(sigma.z()), 2) + "&deg;"});
  AddOffsets(dive.results, &table);
  if (dive.results.other_navigation) AddOther(*dive.results.other_navigation, &table);
  for (const auto& [counter, count] : dive.navigation_counters)
    table.Row({Escaped(CounterInWords(counter)), Grouped(static_cast<std::uint64_t>(count))});
  return html + table.Finish();
}

std::string NavigationSection(const Report& report) {
  std::string html;
  if (report.has_several_dives())
    for (const std::string& condition : report.options.conditions)
      html += "<p>At the end: " + Escaped(condition) + "</p>\n";
  for (const Report::Dive& dive : report.dives) html += NavigationOf(dive);
  return html;
}

std::string CounterTable(const char* title, const std::map<std::string, std::int64_t>& counters) {
  if (counters.empty()) return {};
  HtmlTable table({title, "Count"});
  for (const auto& [name, count] : counters)
    table.Row({Escaped(CounterInWords(name)), Grouped(static_cast<std::uint64_t>(count))});
  return table.Finish();
}

// kind: good, plain, part or bad.
std::string Tile(const std::string& figure,
                 const std::string& meaning,
                 const std::string& kind = "plain") {
  return "<div class=\"tile " + kind + "\"><b>" + figure + "</b>" + meaning + "</div>\n";
}

std::string VerdictTile(const ProductSummary& s, std::size_t warnings) {
  if (warnings > 0)
    return Tile(Grouped(warnings) + (warnings == 1 ? " warning" : " warnings"),
                "of what changed depths or lost data",
                "bad");
  if (s.partial) return Tile("partial", "the map covers a part of the input", "part");
  switch (s.outcome) {
    case Outcome::kCorrected: return Tile("corrected", "map and track by the graph", "good");
    case Outcome::kWithheld: return Tile("withheld", "the correction: map as navigated", "bad");
    case Outcome::kNothingToCorrect:
    case Outcome::kTrackAlone: break;
  }
  return Tile("as navigated", "there was nothing to correct");
}

// The four at which one looks first.
std::string Tiles(const ProductSummary& s, std::size_t warnings) {
  std::string html;
  if (s.before.surface.cells > 0)
    html += Tile(Fixed(100.0 * s.before.surface.rms_m, 1) + " &rarr; " +
                     Fixed(100.0 * s.after().surface.rms_m, 1) + " cm",
                 "swath mismatch, RMS: as navigated, delivered map");
  else
    html += Tile("&ndash;", "swath mismatch: no swaths overlap");
  const std::uint64_t loops = s.loops_accepted + s.loops_rejected;
  html += Tile(Grouped(s.loops_accepted) + " of " + Grouped(loops),
               "pairs of submaps became loop closures");
  const double read = static_cast<double>(s.soundings_read);
  html += Tile(Fixed(Percent(static_cast<double>(s.soundings_used), read), 1) + " %",
               "of " + Grouped(s.soundings_read) + " soundings used");
  return html + VerdictTile(s, warnings);
}

// Where and when, and by which program.
std::string HeadOf(const Report& report) {
  const ProductSummary& s = report.summary;
  const ProductOptions& options = report.options;
  std::string text;
  const auto add = [&](const std::string& part) {
    text += (text.empty() ? "" : " &middot; ") + part;
  };
  if (!options.vehicles.empty() && !options.vehicles[0].name.empty())
    add(Escaped(options.vehicles[0].name));
  if (options.datum)
    add("map origin " + Fixed(options.datum->latitude_deg, 5) + "&deg;, " +
        Fixed(options.datum->longitude_deg, 5) + "&deg;");
  if (report.times)
    add(UtcText(report.times->first, "%Y-%m-%d %H:%M") + " to " +
        UtcText(report.times->second, "%Y-%m-%d %H:%M UTC"));
  if (s.cells_mapped > 0) {
    const double area_m2 = static_cast<double>(s.cells_mapped) * s.cell_m * s.cell_m;
    add(area_m2 < 1e5 ? Grouped(static_cast<std::uint64_t>(area_m2)) + " m&sup2;"
                      : Fixed(1e-6 * area_m2, 2) + " km&sup2;");
    if (options.axes == MapAxes::kNorthEastDown)
      add("depths " + Fixed(-s.elevation_range_m.second, 1) + " to " +
          Fixed(-s.elevation_range_m.first, 1) + " m");
    add("cell " + Fixed(s.cell_m, 2) + " m");
  }
  if (!s.crs.empty()) add(Escaped(s.crs));
  add(std::string("Seastitch ") + ProgramVersion());
  if (options.configuration_crc != 0)
    add("configuration " + ConfigurationHash(options.configuration_crc));
  return text;
}

// What the survey says of its own configuration. Empty: nothing.
std::string AdviceTable(const std::vector<Advice>& advice) {
  HtmlTable table({"Key", "Now", "Suggested", "", "Why"});
  for (const Advice& a : advice)
    table.Row({"<code>" + Escaped(a.key) + "</code><br>" + Escaped(a.file),
               Escaped(a.now),
               Escaped(a.suggested),
               "<button data-copy=\"" +
                   Escaped(a.key.substr(a.key.rfind('.') + 1) + ": " + a.suggested) +
                   "\">copy</button>",
               Escaped(a.reason)});
  return table.has_rows() ? table.Finish() : std::string();
}

std::string VerdictTable(const ProductSummary& s) {
  HtmlTable table({"Registrations", "Pairs of submaps"});
  for (const auto& [verdict, pairs] : s.loop_verdicts)
    table.Row({Escaped(verdict), Grouped(pairs)});
  return table.has_rows() ? table.Finish() : std::string();
}

// What lies beside the page.
std::string FilesText(const ProductSummary& s, const ProductOptions& options, bool has_map) {
  std::string text;
  for (const std::string& name : s.files)
    if (name.find('/') == std::string::npos) text += Escaped(name) + ", ";
  if (has_map) text += std::string(product_files::kSubmapFolder) + "/, ";
  text += std::string(product_files::kExportFolder) + "/, " + product_files::kReport + ".";
  if (!s.crs.empty()) text += " Coordinates: " + Escaped(s.crs) + ".";
  if (has_map && options.soundings == nullptr)
    text += std::string(" There is no ") + product_files::kShoalest +
            ", because the input holds no single soundings.";
  return text;
}

void AddClosureErrors(const ClosureErrors& e, std::map<std::string, std::string>* values) {
  (*values)["has_closure_errors"] = "yes";
  (*values)["closures"] = Grouped(e.closures);
  (*values)["chi2"] = Fixed(e.chi2, 1);
  (*values)["degrees_of_freedom"] = Grouped(e.degrees_of_freedom);
  (*values)["worst_chi2"] = Fixed(e.worst_chi2, 1);
}

}  // namespace

std::string ReportHtml(const Report& report, const std::string& map_data) {
  const ProductSummary& s = report.summary;
  const ProductOptions& options = report.options;
  const bool has_map = s.outcome != Outcome::kTrackAlone;
  std::map<std::string, std::string> values{
      {"title", Escaped(options.title)},
      {"banner", BannerClass(s)},
      {"statement", Escaped(s.statement)},
      {"warnings", WarningsList(options.warnings)},
      {"head", HeadOf(report)},
      {"tiles", Tiles(s, options.warnings.size())},
      {"figures_open", has_map ? "" : " open"},
      {"corrected", s.outcome == Outcome::kCorrected ? "yes" : ""},
      {"has_overlap", s.before_all.surface.cells + s.solved_all.surface.cells > 0 ? "yes" : ""},
      {"before_after", BeforeAfterTable(s)},
      {"survey", SurveyTable(s, options)},
      {"s44", S44Table(s.s44)},
      {"has_map", has_map ? "yes" : ""},
      {"has_viewer", map_data.empty() ? "" : "yes"},
      {"map_data", map_data},
      {"viewer", ViewerSection()},
      {"viewer_script", ViewerScript().text},
      {"style", PageStyle().text},
      {"policy", ContentPolicy({ViewerScript()}, PageStyle(), "img-src 'self' file: data:")},
      {"has_truth", s.truth ? "yes" : ""},
      {"mounting", MountingTable(report)},
      {"noise_findings", FindingsText(report)},
      {"noise", NoiseTable(report)},
      {"calibration", CalibrationHtml(report)},
      {"dives", DivesList(s.dives, options.unread)},
      {"advice", AdviceTable(report.advice)},
      {"verdicts", VerdictTable(s)},
      {"loops", LoopTable(report.loops)},
      {"navigation", NavigationSection(report)},
      {"refused", CounterTable("Refused, late or doubled", report.refused)},
      {"mapper", CounterTable("Counted by the mapper", options.mapper_counters)},
      {"depth_before", product_files::kDepthPictureAsNavigated},
      {"depth", product_files::kDepthPicture},
      {"mismatch_before", product_files::kMismatchPictureAsNavigated},
      {"mismatch", product_files::kMismatchPicture},
      {"files", FilesText(s, options, has_map)}};
  if (s.closures_against_truth) AddClosureErrors(*s.closures_against_truth, &values);
  return FillTemplate(kReportPage, values);
}

}  // namespace seastitch
