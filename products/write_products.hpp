#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/survey_noise.hpp"
#include "common/core/vehicle.hpp"
#include "common/geo/datum.hpp"
#include "products/files/sounding_files.hpp"
#include "products/map/consistency.hpp"
#include "products/map/map_points.hpp"
#include "products/map/s44.hpp"
#include "products/report/dive_report.hpp"
#include "products/survey.hpp"
#include "products/track/dives.hpp"
#include "products/track/truth.hpp"
#include "products/warning.hpp"

namespace seastitch {

// Computing cost of the run, measured by the caller. Differs from run to run.
struct RunFigures {
  double wall_s = 0.0;
  double cpu_s = 0.0;
  double peak_rss_mb = 0.0;
  double realtime_factor = 0.0;  // duration of the survey divided by wall_s
};

struct ProductOptions {
  std::string title = "Survey";  // heading of pictures and report
  double cell_m = 0.0;           // cell size of every raster; 0: chosen from the points' density
  MapAxes axes = MapAxes::kNorthEastDown;
  std::optional<Datum> datum;  // map origin; absent for imported submaps, whose axes have no origin
  // Reference system of the map files, with a datum: MapProjection.
  std::string crs;
  int vertical_epsg = 0;
  // Limit of a raster, about 1.3 GB at the peak. With cell_m = 0 the cell is enlarged to stay below
  // it; a given cell_m that exceeds it is an error.
  std::size_t max_cells = 16'000'000;
  // Points kept in memory, 50 MB: a few survey lines, so that each submap is read from disk once.
  std::size_t cache_points = 4'000'000;
  // Do no harm: an error of the corrected map that is larger than dead reckoning's by less than
  // this fraction of it does not count as larger. Moving points between cells changes the errors of
  // a small survey by about as much.
  double harm_tolerance = 0.05;
  SurveyNoise noise;          // for report and uncertainty; of several dives without a timing
  double depth_bias_m = 0.0;  // of the vehicle's depth, 1 sigma
  // Why the noise was not estimated, for the report; empty: it was.
  std::string noise_not_estimated;
  std::vector<TruthState> truth;  // ground truth; empty: not known
  // Every sounding, for the shallowest of each cell and for export; null: single soundings are not
  // known.
  SoundingLog* soundings = nullptr;
  std::optional<SoundingFormat> sounding_format;  // of an export of soundings; absent: none
  std::map<std::string, std::uint64_t> seeds;     // of a simulated survey, for the report
  std::string configuration;                      // sentence that names its files, for the report
  std::uint32_t configuration_crc = 0;            // CRC-32 of its texts; 0: not known
  std::vector<VehicleGeometry> vehicles;          // as configured, one a dive; empty: not known
  // Messages that never reached the mapper, by reason: malformed, late, repeated. For the report.
  std::map<std::string, std::int64_t> refused;
  // The mapper's counters: samples that it rejected, gated or found late, and its own work. For the
  // report.
  std::map<std::string, std::int64_t> mapper_counters;
  // Conditions of HEALTH of the mapper of several dives at the end. For the report.
  std::vector<std::string> conditions;
  // One of each dive, in the order of Survey::dives; one of a single dive. Empty: nothing is known.
  std::vector<DiveReport> dives;
  std::vector<UnreadDive> unread;    // of several dives, for the report
  std::vector<MapWarning> warnings;  // of the inputs, for the report
  // Why the map covers a part of the input only, as a sentence; empty: it covers all.
  std::string partial;
  std::function<RunFigures()> run_figures;  // called last, so that it includes the products' cost
  std::function<void(const std::string&)> progress;  // receives one line per step

  // Empty where the options are usable, else what is wrong with them.
  std::string Validate() const;
};

// Which map was delivered.
enum class Outcome {
  kCorrected,         // map and poses of the graph's solution
  kNothingToCorrect,  // map and poses of dead reckoning: no edge moves them
  kWithheld,          // map and poses of dead reckoning: the graph's map is less consistent
  kTrackAlone,        // no map, only a track: the dive has no sounding
};
const char* ToString(Outcome outcome);

struct ProductSummary {
  Outcome outcome = Outcome::kNothingToCorrect;
  std::string statement;     // why, in one or two sentences
  bool partial = false;      // the map covers a part of the input only
  std::size_t warnings = 0;  // ProductOptions::warnings

  std::size_t submaps = 0;
  std::uint64_t soundings_read = 0;  // as in SurveySubmap
  std::uint64_t soundings_used = 0;
  std::uint64_t points = 0;
  std::uint64_t loops_accepted = 0;  // registrations that became loop closures
  std::uint64_t loops_refused = 0;   // of these, with an inlier weight below 0.5 in the graph
  std::uint64_t loops_rejected = 0;  // registrations that did not become loop closures
  std::map<std::string, std::uint64_t> loop_verdicts;  // registrations by verdict
  // Height difference of the accepted loop closures: mean, standard deviation, largest magnitude.
  // Positive: the seabed lies deeper in submap `to` than in `from`. Causes: tide, draft, sound
  // speed. NaN without a closure.
  double z_offset_mean_m = 0.0;
  double z_offset_sigma_m = 0.0;
  double z_offset_max_m = 0.0;

  double cell_m = 0.0;
  std::uint64_t cells_mapped = 0;
  std::string horizontal_crs;  // of the map files, such as "EPSG:32632"; empty: none
  std::string crs;             // the same with the vertical system
  std::pair<double, double> elevation_range_m;  // of the colours of both maps
  std::vector<std::string> files;               // that were written so far
  // Consistency of the dead-reckoned map (before) and of the graph's (solved), over comparable
  // cells: FiguresOfComparableCells().
  ConsistencyFigures before;
  ConsistencyFigures solved;
  // The same over every cell that two or more submaps see.
  ConsistencyFigures before_all;
  ConsistencyFigures solved_all;
  // Consistency of the delivered map: `before` where the correction is not used.
  const ConsistencyFigures& after() const {
    return outcome == Outcome::kCorrected ? solved : before;
  }

  S44Shares s44;  // of the delivered map

  double distance_m = 0.0;  // along the dead-reckoned track
  double duration_s = 0.0;
  // Horizontal correction of the submap frames by the graph, whether or not it was used: the
  // largest, and that of the last submap.
  double correction_max_m = 0.0;
  double correction_end_m = 0.0;
  double correction_max_yaw_deg = 0.0;
  std::optional<TruthComparison> truth;
  std::optional<TruthComparison> published;  // NAV and NAV_CORRECTED as published live
  std::optional<ClosureErrors> closures_against_truth;
  SurveyNoise noise;                        // as ProductOptions::noise
  std::vector<std::string> noise_findings;  // a sentence per clear difference from configuration
  std::vector<DiveInMap> dives;             // where there are several
};

// Writes every product into dir (created if need be): those of product_files.hpp, and
// submaps/submap_ID.pcd; survey.bag and survey.qgs with a datum, shoalest.tif with
// options.soundings; in export/ lines.csv and, with a datum,
// navigation.csv, navigation.sbet and navigation.na0 (MB-System), with the dives in order of time;
// where dives overlap in time, navigation_1.csv ... of each dive; with options.soundings the
// soundings file and files.csv. Each file appears whole or not at all. The same survey and options
// give the same bytes, except for the run figures in report.json.
//
// Do no harm: the map of dead reckoning is delivered, and `outcome` is kWithheld, where the solved
// map is worse. It is worse if for the surface error or the consistency error, over comparable
// cells,
// - both the RMS and the 95 % quantile are larger by more than harm_tolerance, or
// - the RMS is larger by more than half;
// or if fewer than a fifth of the cells that two submaps saw are still seen by two.
//
// Throws std::runtime_error with a message of one line where the survey has no submap or no point,
// a file cannot be read or written, or the options are unusable.
ProductSummary WriteProducts(const Survey& survey,
                             const ProductOptions& options,
                             const std::filesystem::path& dir);

// Products of a dive without soundings: track.csv, survey.gpkg with the track, the exports of
// navigation, report.json and report.html. Throws std::runtime_error with a message of one line
// where there is no track, a file cannot be written, or the options are unusable.
ProductSummary WriteTrackProducts(const Survey& survey,
                                  const ProductOptions& options,
                                  const std::filesystem::path& dir);

}  // namespace seastitch
