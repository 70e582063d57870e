#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "products/report/advice.hpp"
#include "products/report/noise_report.hpp"
#include "products/survey.hpp"
#include "products/write_products.hpp"

namespace seastitch {

// CRC-32 of the configuration, for people to compare: eight hexadecimal digits.
std::string ConfigurationHash(std::uint32_t crc);

// Percentage of the whole; NaN where the whole is 0.
double Percent(double part, double whole);

// An estimated mounting error and its 1 sigma.
struct MountingRow {
  const char* name;  // in report.json
  const char* label;
  double value;
  double sigma;
  const char* unit;  // HTML
};

// Mounting errors of one dive that the graph estimated; empty where it accepted no closure with a
// submap of that dive.
std::vector<MountingRow> MountingRows(const Survey& survey, std::int32_t chain = 0);

// What the report says: made once, written as report.json and as report.html. It refers to the
// survey, the summary and the options, which outlive it.
struct Report {
  struct Dive {
    std::string name;    // empty where it is the only one
    DiveReport results;  // empty where they are not known
    std::vector<MountingRow> mounting;
    std::map<std::string, std::int64_t> navigation_counters;
    std::optional<TrackState> last;  // newest state of its track
  };

  const ProductSummary& summary;
  const ProductOptions& options;
  std::vector<Advice> advice{};
  std::vector<Dive> dives{};  // one at least
  std::vector<NoiseRow> noise{};
  std::string why_no_noise{};                     // empty: the components of the noise are known
  std::map<std::string, std::int64_t> refused{};  // input that is not in the map, by reason
  std::vector<LoopRow> loops{};
  std::optional<std::pair<Time, Time>> times{};  // of the first and the last state

  bool has_several_dives() const { return !summary.dives.empty(); }
};
Report ReportOf(const Survey& survey, const ProductSummary& summary, const ProductOptions& options);

// report.json. Times, memory and rates of the run are both flat (wall_s, ...) and under "run"; the
// keys that differ from run to run are listed under "not_reproducible".
std::string ReportJson(const Report& report);

// Text of report.html: one page, with a map in it (MapViewer::Data(); empty: without); its pictures
// are the PNG files beside it. The same in every run.
std::string ReportHtml(const Report& report, const std::string& map_data);

}  // namespace seastitch
