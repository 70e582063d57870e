#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/survey_noise.hpp"
#include "products/consistency.hpp"
#include "products/dives.hpp"
#include "products/geo_files.hpp"
#include "products/map_points.hpp"
#include "products/sounding_files.hpp"
#include "products/survey.hpp"
#include "products/truth.hpp"

namespace seastitch {

// Cost of the run, measured by the caller. Differs from run to run.
struct RunFigures {
  double wall_s = 0.0;
  double cpu_s = 0.0;
  double peak_rss_mb = 0.0;
  double realtime_factor = 0.0;  // duration of the survey over wall_s
};

struct ProductOptions {
  std::string title = "Survey";  // over pictures and report
  double cell_m = 0.0;           // of every raster; 0: from the density of the points
  MapAxes axes = MapAxes::kNorthEastDown;
  std::optional<Datum> datum;            // only with North-East-Down: imported submaps have none
  std::size_t max_cells = 16'000'000;    // about 0.7 GB at the peak; a default cell grows to fit
  std::size_t cache_points = 4'000'000;  // 100 MB: a few survey lines, so that each is read once
  // Two maps count as equally consistent where their errors differ by less than this fraction:
  // points that fall into other cells change the figures of a small survey by about as much.
  double harm_tolerance = 0.05;
  SurveyNoise noise;                 // for the report
  std::vector<TruthState> truth;     // empty: not known
  SoundingLog* soundings = nullptr;  // where every sounding is to be exported
  SoundingFormat sounding_format = SoundingFormat::kLas;
  std::map<std::string, std::uint64_t> seeds;  // for the report
  std::string configuration;                   // where it comes from, for the report
  // Input that is not in the map, by reason: refused, late, doubled. For the report.
  std::map<std::string, std::int64_t> refused;
  // The mapper's counters: refused, gated and late samples, and its own work. For the report.
  std::map<std::string, std::int64_t> mapper_counters;
  // Conditions of HEALTH at the end, such as a suspected time offset. For the report.
  std::vector<std::string> conditions;
  // Why the map covers a part of the input only, as a sentence; empty: it covers all.
  std::string partial;
  std::function<RunFigures()> run_figures;  // asked last, so that it covers the products too
  std::function<void(const std::string&)> progress;  // one line a step

  std::string Validate() const;
};

enum class Outcome {
  kCorrected,         // the map and poses are those of the graph
  kNothingToCorrect,  // they are dead reckoning, since nothing contradicts it
  kWithheld,          // they are dead reckoning, since the graph made the map worse
  kTrackAlone,        // there is no map: nothing was sounded
};
const char* ToString(Outcome outcome);

struct ProductSummary {
  Outcome outcome = Outcome::kNothingToCorrect;
  std::string statement;  // why, in one or two sentences
  bool partial = false;   // the map covers a part of the input only

  std::size_t submaps = 0;
  std::uint64_t soundings_read = 0;
  std::uint64_t soundings_used = 0;
  std::uint64_t points = 0;
  std::uint64_t loops_accepted = 0;  // by registration
  std::uint64_t loops_refused = 0;   // of these, by the graph
  std::uint64_t loops_rejected = 0;
  std::map<std::string, std::uint64_t> loop_verdicts;
  // z offset of the accepted loop closures: tide, draft or sound speed. NaN without one.
  double z_offset_mean_m = 0.0;
  double z_offset_sigma_m = 0.0;
  double z_offset_max_m = 0.0;

  double cell_m = 0.0;
  std::uint64_t cells_mapped = 0;
  // Over the cells that two or more submaps see both as dead reckoned and as solved.
  ConsistencyFigures before;
  ConsistencyFigures solved;
  // Over every cell that two or more submaps see.
  ConsistencyFigures before_all;
  ConsistencyFigures solved_all;
  // Of the map that was delivered; that of `before` where the correction is not used.
  const ConsistencyFigures& after() const {
    return outcome == Outcome::kCorrected ? solved : before;
  }

  double distance_m = 0.0;  // along the dead-reckoned track
  double duration_s = 0.0;
  // Correction of the submaps by the graph, whether or not it was used.
  double correction_max_m = 0.0;
  double correction_end_m = 0.0;
  double correction_max_yaw_deg = 0.0;
  std::optional<TruthComparison> truth;
  std::optional<TruthComparison> published;  // NAV and NAV_CORRECTED as published live
  std::optional<ClosureErrors> closures_against_truth;
  SurveyNoise noise;                        // as ProductOptions::noise
  std::vector<std::string> noise_findings;  // clear differences from the configuration, sentences
  std::vector<DiveInMap> dives;             // where there are several
};

// Writes every product into dir (created if need be): depth, depth_dead_reckoned, consistency,
// consistency_dead_reckoned as .tif and .png, track.csv, poses.txt, graph.g2o, survey.gpkg,
// submaps/submap_ID.pcd, report.json, report.html; in export/ lines.csv and, with a datum,
// navigation.csv, .sbet and .na0; with soundings these and files.csv. Each file appears whole or
// not at all. The same survey and options give the same bytes, except for the run figures in
// report.json.
//
// Do no harm: where the solved map is less consistent than dead reckoning (by either measure: its
// RMS and its 95 % quantile by more than harm_tolerance, or its RMS by half) over the cells that
// both see, as often, or no longer overlaps where dead reckoning does, everything is delivered as
// dead reckoned and `outcome` is kWithheld.
//
// Throws std::runtime_error with one line: no submap, no point, a file that cannot be read or
// written, unusable options.
ProductSummary WriteProducts(const Survey& survey,
                             const ProductOptions& options,
                             const std::filesystem::path& dir);

// Products of a dive without soundings: track.csv, survey.gpkg with the track, the exports of
// navigation, report.json and report.html. Throws std::runtime_error with one line: no track, a
// file that cannot be written, unusable options.
ProductSummary WriteTrackProducts(const Survey& survey,
                                  const ProductOptions& options,
                                  const std::filesystem::path& dir);

}  // namespace seastitch
