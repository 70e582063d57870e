#include "products/write_products.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/core/median.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/storage/submap_file.hpp"
#include "products/files/graph_files.hpp"
#include "products/files/navigation_files.hpp"
#include "products/map/depth_map.hpp"
#include "products/map/judge.hpp"
#include "products/report/noise_report.hpp"
#include "products/report/picture.hpp"
#include "products/report/report.hpp"
#include "products/report/survey_drawing.hpp"
#include "products/track/survey_lines.hpp"
#include "products/track/track.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::string Format(const char* format, double a, double b = 0.0) {
  char text[160];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

void Progress(const ProductOptions& options, const std::string& line) {
  if (options.progress) options.progress(line);
}

// ---- where the map lies

Eigen::AlignedBox2d BoxOf(const Survey& survey, const SurveyPoses& poses, MapAxes axes) {
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    box.extend(NorthEastBox(survey.submaps, poses, i, axes));
  }
  return box;
}

// A solution that scatters the submaps so far cannot be right, and would make a grid of nothing.
bool IsWild(const Eigen::AlignedBox2d& with_solved, const Eigen::AlignedBox2d& dead_reckoned) {
  constexpr double kGrowth = 3.0, kSlackM = 1000.0;
  return with_solved.diagonal().norm() > kGrowth * dead_reckoned.diagonal().norm() + kSlackM;
}

double CellCount(const Eigen::AlignedBox2d& box, double cell_m) {
  return (box.sizes().x() / cell_m + 2.0) * (box.sizes().y() / cell_m + 2.0);
}

double ChooseCell(const Survey& survey,
                  const Eigen::AlignedBox2d& box,
                  const ProductOptions& options) {
  const double most = static_cast<double>(options.max_cells);
  if (options.cell_m > 0.0) {
    if (CellCount(box, options.cell_m) > most) {
      throw std::runtime_error(Format("cell_m = %g: the map would have %.3g cells",
                                      options.cell_m,
                                      CellCount(box, options.cell_m)) +
                               ", at most " + std::to_string(options.max_cells) + " are allowed");
    }
    return options.cell_m;
  }
  double cell_m = DefaultCell(survey.submaps);
  while (CellCount(box, cell_m) > most) cell_m = RoundUpOneTwoFive(1.01 * cell_m);
  return cell_m;
}

// ---- rasters

struct DepthRaster {
  std::vector<RasterBand> bands;  // mean, spread, soundings
  std::uint64_t cells = 0;        // with depth
  std::vector<float>& mean() { return bands[0].values; }
};

DepthRaster ToRaster(const DepthMap& map) {
  DepthRaster raster;
  raster.bands = {{"mean depth, positive down", "m", {}},
                  {"standard deviation of depth within the cell", "m", {}},
                  {"soundings", "", {}}};
  for (RasterBand& band : raster.bands) band.values.reserve(map.cells().cells().size());
  for (const DepthCell& cell : map.cells().cells()) {
    const bool seen = cell.soundings > 0.0;
    const auto add = [&](std::size_t band, double value) {
      raster.bands[band].values.push_back(seen ? static_cast<float>(value) : kNoData);
    };
    add(0, cell.mean_m);
    add(1, cell.Spread());
    add(2, cell.soundings);
    raster.cells += seen ? 1 : 0;
  }
  return raster;
}

DepthRaster ComputeDepth(const Survey& survey,
                         const SurveyPoses& poses,
                         MapAxes axes,
                         const GridGeometry& geometry) {
  DepthMap map(geometry);
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    map.Add(LoadMapPoints(survey.submaps, poses, i, axes));
  }
  return ToRaster(map);
}

std::vector<float> ErrorValues(const Grid<float>& error_m) {
  std::vector<float> values = error_m.cells();
  std::replace(values.begin(), values.end(), kNoValue, kNoData);
  return values;
}

std::vector<RasterBand> ToBands(const ConsistencyMap& map) {
  RasterBand seen{"submaps that see the cell", "", {}};
  for (const std::uint16_t n : map.submaps.cells()) {
    seen.values.push_back(n == 0 ? kNoData : static_cast<float>(n));
  }
  return {{"consistency error (Roman and Singh 2006)", "m", ErrorValues(map.point_error_m)},
          {"surface error between submaps", "m", ErrorValues(map.surface_error_m)},
          std::move(seen)};
}

// ---- pictures

// The values below which the shares lo and hi of all cells lie.
std::pair<double, double> Quantiles(const std::vector<const std::vector<float>*>& rasters,
                                    double lo,
                                    double hi) {
  std::vector<float> values;
  for (const std::vector<float>* raster : rasters) {
    std::copy_if(raster->begin(), raster->end(), std::back_inserter(values), [](float v) {
      return v != kNoData;
    });
  }
  if (values.empty()) return {0.0, 1.0};
  const auto index = [&](double share) {
    return static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)));
  };
  return OrderStatistics(index(lo), index(hi), &values);
}

void WidenFlatRange(std::pair<double, double>* range, double least) {
  if (range->second - range->first >= least) return;
  const double middle = 0.5 * (range->first + range->second);
  *range = {middle - 0.5 * least, middle + 0.5 * least};
}

Picture DepthPicture(const GridGeometry& geometry,
                     const std::vector<float>& values,
                     const std::pair<double, double>& range) {
  Picture picture;
  picture.geometry = geometry;
  picture.values = values;
  picture.lowest = range.first;
  picture.highest = range.second;
  picture.value_label = "Depth (m)";
  picture.deeper_is_down = true;
  picture.hill_shade = true;
  picture.colours = &DepthColours();
  return picture;
}

// Of the surface error: the point error's ground level would hide what there is to see.
Picture ConsistencyPicture(const GridGeometry& geometry,
                           const std::vector<RasterBand>& bands,
                           double highest) {
  Picture picture;
  picture.geometry = geometry;
  picture.values = bands[1].values;
  picture.underlay = bands[2].values;
  picture.highest = highest;
  picture.value_label = "Surface error (m)";
  picture.colours = &ConsistencyColours();
  return picture;
}

const char* MapName(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCorrected: return "corrected";
    case Outcome::kNothingToCorrect: return "dead reckoned, nothing to correct";
    case Outcome::kWithheld: return "dead reckoned, correction withheld";
    case Outcome::kTrackAlone: break;
  }
  return "";
}

// ---- submap files

// submap_ID.pcd
bool IsSubmapFile(std::string_view name) {
  constexpr std::string_view kHead = "submap_";
  constexpr std::string_view kTail = ".pcd";
  if (!name.starts_with(kHead) || !name.ends_with(kTail)) return false;
  const char* const end = name.data() + name.size() - kTail.size();
  std::int32_t id = 0;
  const auto [rest, error] = std::from_chars(name.data() + kHead.size(), end, id);
  return error == std::errc() && rest == end;
}

void RewriteSubmaps(const Survey& survey, const SurveyPoses& poses, const fs::path& dir) {
  std::set<std::string> ours;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const SurveySubmap& s = survey.submaps[i];
    if (s.points == 0) continue;
    const std::string name = "submap_" + std::to_string(s.id.value) + ".pcd";
    ours.insert(name);
    WriteSubmapPcd(
        dir / name, LoadCloud(s, poses.MountingOf(i)), SubmapPose(s, poses.T_map_level[i]));
  }
  // Submaps of an earlier, longer run in the same folder would be read as part of this one.
  for (const fs::directory_entry& entry : fs::directory_iterator(dir)) {
    const std::string name = entry.path().filename().string();
    if (IsSubmapFile(name) && !ours.contains(name)) fs::remove(entry.path());
  }
}

void MakeFolder(const fs::path& dir) {
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) throw std::runtime_error(dir.string() + ": " + error.message());
}

// ---- everything together

std::string Subtitle(const ProductSummary& s, const ConsistencyFigures& figures) {
  std::string text = std::to_string(s.submaps) + (s.submaps == 1 ? " submap" : " submaps");
  if (s.distance_m > 0.0) text += Format(", track %.2f km", s.distance_m / 1000.0);
  text += Format(", cell %g m", s.cell_m);
  if (figures.point.cells > 0) {
    text += Format(
        ", consistency RMS %.3f m, surface RMS %.3f m", figures.point.rms_m, figures.surface.rms_m);
  }
  return text;
}

std::vector<CorrectedState> Joined(const std::vector<std::vector<CorrectedState>>& dives) {
  std::vector<CorrectedState> all;
  for (const std::vector<CorrectedState>& dive : dives)
    all.insert(all.end(), dive.begin(), dive.end());
  return all;
}

void ExpectValid(const ProductOptions& options) {
  if (const std::string wrong = options.Validate(); !wrong.empty())
    throw std::runtime_error("products: " + wrong);
}

// Writes the files of one survey, step by step.
class ProductWriter {
 public:
  ProductWriter(const Survey& survey, const ProductOptions& options, fs::path dir)
      : survey_(survey),
        options_(options),
        dir_(std::move(dir)),
        dead_reckoned_(DeadReckonedPoses(survey)),
        delivered_(SolvedPoses(survey)),
        summary_(Summarise(survey, dead_reckoned_.T_map_level, delivered_.T_map_level)) {}

  ProductSummary Run() {
    ChooseMap();
    CorrectTheTrack();
    summary_.noise = options_.noise;
    summary_.noise_findings = NoiseFindings(options_.noise);
    for (std::size_t k = 0; k < survey_.dives.size() && k < options_.dives.size(); ++k)
      for (const std::string& finding : TimingFindings(options_.dives[k].sonar))
        summary_.noise_findings.push_back(survey_.dives[k] + ": " + finding);
    WriteDepth();
    WriteConsistency();
    Write("track.csv", TrackCsv(track_, options_.datum));
    Write("poses.txt", PosesTxt(survey_, delivered_.T_map_level));
    Write("graph.g2o", GraphG2o(survey_, delivered_));
    Write("survey.gpkg",
          GeoPackage(SurveyLayers(survey_, delivered_.T_map_level, track_, options_.axes),
                     options_.datum));
    RewriteSubmaps(survey_, delivered_, dir_ / "submaps");
    WriteExports();
    Write("report.html", ReportHtml(survey_, summary_, options_));
    // Last, so that its run figures cover all of the above.
    Write("report.json", ReportJson(survey_, summary_, options_));
    return std::move(summary_);
  }

  ProductSummary RunTrackAlone() {
    summary_.outcome = Outcome::kTrackAlone;
    summary_.statement = "There is no map: nothing was sounded. The track is as dead reckoned.";
    if (!options_.partial.empty()) summary_.statement = options_.partial + " " + summary_.statement;
    summary_.partial = !options_.partial.empty();
    CorrectTheTrack();
    Write("track.csv", TrackCsv(track_, options_.datum));
    Write("survey.gpkg",
          GeoPackage(SurveyLayers(survey_, delivered_.T_map_level, track_, options_.axes),
                     options_.datum));
    WriteNavigation();
    Write("report.html", ReportHtml(survey_, summary_, options_));
    Write("report.json", ReportJson(survey_, summary_, options_));
    return std::move(summary_);
  }

 private:
  void Write(const std::string& name, const std::string& bytes) {
    WriteAtomically(dir_ / name, bytes);
    Progress(options_, name);
  }

  // Grids both maps alike, measures both, and keeps the poses of the one to deliver.
  void ChooseMap() {
    const Eigen::AlignedBox2d box = BoxOf(survey_, dead_reckoned_, options_.axes);
    const Eigen::AlignedBox2d both = box.merged(BoxOf(survey_, delivered_, options_.axes));
    const bool wild = IsWild(both, box);
    const Eigen::AlignedBox2d& extent = wild ? box : both;
    summary_.cell_m = ChooseCell(survey_, extent, options_);
    geometry_ =
        GridGeometry::Covering(extent.min(), extent.max(), summary_.cell_m, options_.max_cells);
    MeasureBoth(Moved(summary_) && !wild);
    if (wild) {
      WithholdScattered(both.diagonal().norm(), &summary_);
    } else {
      Judge(survey_, options_.harm_tolerance, &summary_);
    }
    summary_.partial = !options_.partial.empty();
    if (summary_.partial) summary_.statement = options_.partial + " " + summary_.statement;
    if (summary_.outcome != Outcome::kCorrected) {
      delivered_ = dead_reckoned_;
      after_ = before_;
    }
  }

  ConsistencyMap Measure(const SurveyPoses& poses, const char* which) {
    const std::size_t n = survey_.submaps.size();
    return ComputeConsistency(survey_.submaps,
                              poses,
                              options_.axes,
                              geometry_,
                              options_.cache_points,
                              [&](std::size_t i) {
                                if (i % 50 == 0) {
                                  Progress(options_,
                                           std::string("consistency ") + which + ": submap " +
                                               std::to_string(i + 1) + " of " + std::to_string(n));
                                }
                              });
  }

  void MeasureBoth(bool solved_too) {
    before_ = Measure(dead_reckoned_, "dead reckoned");
    after_ = solved_too ? Measure(delivered_, "solved") : before_;
    summary_.before = FiguresOfComparableCells(before_, after_);
    summary_.solved = FiguresOfComparableCells(after_, before_);
    summary_.before_all = Figures(before_);
    summary_.solved_all = Figures(after_);
  }

  void CorrectTheTrack() {
    const TrackCorrection correction(survey_, delivered_, DeliveredSigmas());
    track_ = CorrectTrack(survey_, correction);
    summary_.distance_m = TrackLength(track_);
    summary_.duration_s = TrackDuration(track_);
    if (!options_.truth.empty()) {
      summary_.truth = CompareWithTruth(track_, options_.truth);
      summary_.published = ComparePublishedWithTruth(survey_.published, options_.truth);
      summary_.closures_against_truth = CompareClosuresWithTruth(survey_, options_.truth);
    }
  }

  std::vector<std::optional<Eigen::Vector3d>> DeliveredSigmas() const {
    if (summary_.outcome == Outcome::kCorrected) return SolvedSigmas(survey_);
    return std::vector<std::optional<Eigen::Vector3d>>(survey_.submaps.size());
  }

  void WriteNavigation() {
    MakeFolder(dir_ / "export");
    if (!options_.datum) return;
    const std::vector<std::vector<CorrectedState>> dives = TracksOfDives(track_);
    // Other programs skip a state whose time does not rise.
    const bool overlap = std::adjacent_find(dives.begin(), dives.end(), [](auto& a, auto& b) {
                           return b.front().time <= a.back().time;
                         }) != dives.end();
    if (overlap)
      for (const std::vector<CorrectedState>& dive : dives)
        WriteNavigation(dive, "_" + std::to_string(dive.front().chain + 1));
    else
      WriteNavigation(Joined(dives), "");
  }

  void WriteNavigation(const std::vector<CorrectedState>& states, const std::string& number) {
    const std::vector<GeographicState> track = ToGeographic(states, *options_.datum);
    const std::string name = "export/navigation" + number;
    Write(name + ".csv", NavigationCsv(track));
    Write(name + ".sbet", SbetBytes(track));
    Write(name + ".na0", Na0Text(track));
  }

  // What other people's programs take.
  void WriteExports() {
    WriteNavigation();
    Write("export/lines.csv",
          LinesCsv(survey_, dead_reckoned_, delivered_, DeliveredSigmas(), options_.axes));
    if (options_.soundings == nullptr) return;
    const bool las = options_.sounding_format == SoundingFormat::kLas;
    const std::string name = las ? "export/soundings.las" : "export/soundings.xyz";
    WriteSoundings(survey_,
                   delivered_,
                   options_.axes,
                   options_.datum,
                   options_.sounding_format,
                   options_.soundings,
                   dir_ / name);
    Progress(options_, name);
    std::string files = "file,name\n";
    for (std::size_t i = 0; i < survey_.inputs.size(); ++i)
      files += std::to_string(i + 1) + ',' + CsvText(survey_.inputs[i].name) + '\n';
    Write("export/files.csv", files);
  }

  void WriteDepth() {
    std::vector<float> before;
    {
      DepthRaster raster = Depth(dead_reckoned_);
      Write("depth_dead_reckoned.tif", GeoTiff(geometry_, raster.bands, options_.datum));
      before = std::move(raster.mean());
    }
    DepthRaster after = Depth(delivered_);
    Write("depth.tif", GeoTiff(geometry_, after.bands, options_.datum));
    summary_.cells_mapped = after.cells;
    auto range = Quantiles({&before, &after.mean()}, 0.005, 0.995);
    WidenFlatRange(&range, 0.1);
    Picture picture = DepthPicture(geometry_, before, range);
    picture.title = options_.title + ": depth, dead reckoned";
    picture.subtitle = Subtitle(summary_, summary_.before);
    picture.lines = TrackLines(track_, false, options_.axes);
    Write("depth_dead_reckoned.png", RenderPng(picture));
    picture = DepthPicture(geometry_, after.mean(), range);
    picture.title = options_.title + ": depth, " + MapName(summary_.outcome);
    picture.subtitle = Subtitle(summary_, summary_.after());
    picture.lines = LoopLines(survey_, delivered_.T_map_level, options_.axes);
    const bool corrected = summary_.outcome == Outcome::kCorrected;
    for (PictureLine& line : TrackLines(track_, corrected, options_.axes))
      picture.lines.push_back(std::move(line));
    Write("depth.png", RenderPng(picture));
  }

  DepthRaster Depth(const SurveyPoses& poses) const {
    return ComputeDepth(survey_, poses, options_.axes, geometry_);
  }

  void WriteConsistency() {
    const std::vector<RasterBand> before = ToBands(before_);
    const std::vector<RasterBand> after = ToBands(after_);
    Write("consistency_dead_reckoned.tif", GeoTiff(geometry_, before, options_.datum));
    Write("consistency.tif", GeoTiff(geometry_, after, options_.datum));
    std::pair<double, double> range = Quantiles({&before[1].values, &after[1].values}, 0.0, 0.98);
    range.first = 0.0;
    WidenFlatRange(&range, 0.01);
    range.first = 0.0;
    Picture picture = ConsistencyPicture(geometry_, before, range.second);
    picture.title = options_.title + ": consistency, dead reckoned";
    picture.subtitle = Subtitle(summary_, summary_.before) + "; grey: seen by one submap";
    Write("consistency_dead_reckoned.png", RenderPng(picture));
    picture = ConsistencyPicture(geometry_, after, range.second);
    picture.title = options_.title + ": consistency, " + MapName(summary_.outcome);
    picture.subtitle = Subtitle(summary_, summary_.after()) + "; grey: seen by one submap";
    Write("consistency.png", RenderPng(picture));
  }

  const Survey& survey_;
  const ProductOptions& options_;
  fs::path dir_;
  SurveyPoses dead_reckoned_;
  SurveyPoses delivered_;  // the solved ones unless ChooseMap() withholds them
  ProductSummary summary_;
  GridGeometry geometry_;
  ConsistencyMap before_;
  ConsistencyMap after_;
  std::vector<CorrectedState> track_;
};

}  // namespace

ProductSummary WriteTrackProducts(const Survey& survey,
                                  const ProductOptions& options,
                                  const fs::path& dir) {
  ExpectValid(options);
  if (survey.track.empty()) throw std::runtime_error("no track: there is nothing to write");
  MakeFolder(dir);
  return ProductWriter(survey, options, dir).RunTrackAlone();
}

ProductSummary WriteProducts(const Survey& survey,
                             const ProductOptions& options,
                             const fs::path& dir) {
  ExpectValid(options);
  const bool any_point = std::any_of(survey.submaps.begin(),
                                     survey.submaps.end(),
                                     [](const SurveySubmap& s) { return s.points > 0; });
  if (survey.submaps.empty()) throw std::runtime_error("no submap: there is nothing to map");
  if (!any_point) throw std::runtime_error("no submap has a point: there is nothing to map");
  MakeFolder(dir);
  MakeFolder(dir / "submaps");
  return ProductWriter(survey, options, dir).Run();
}

}  // namespace seastitch
