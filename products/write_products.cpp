#include "products/write_products.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/for_each_beside.hpp"
#include "common/runtime/stage.hpp"
#include "products/files/graph_files.hpp"
#include "products/files/navigation_files.hpp"
#include "products/files/placed_soundings.hpp"
#include "products/files/submap_files.hpp"
#include "products/geo/qgis_project.hpp"
#include "products/map/depth_map.hpp"
#include "products/map/judge.hpp"
#include "products/map/map_extent.hpp"
#include "products/product_files.hpp"
#include "products/report/noise_report.hpp"
#include "products/report/report.hpp"
#include "products/report/survey_drawing.hpp"
#include "products/report/survey_layers.hpp"
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

MapProjection ProjectionOf(const Survey& survey, const ProductOptions& options) {
  if (!options.datum) return MapProjection(options.axes);
  return {*options.datum, MiddleOf(survey), options.crs, options.vertical_epsg};
}

// ---- pictures

const char* MapName(Outcome outcome) {
  switch (outcome) {
    case Outcome::kCorrected: return "corrected";
    case Outcome::kNothingToCorrect: return "as navigated, nothing to correct";
    case Outcome::kWithheld: return "as navigated, correction withheld";
    case Outcome::kTrackAlone: break;
  }
  return "";
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
    text += Format(", swath mismatch RMS %.3f m", figures.surface.rms_m);
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
        projection_(ProjectionOf(survey, options)),
        dead_reckoned_(DeadReckonedPoses(survey)),
        delivered_(SolvedPoses(survey)),
        summary_(Summarise(survey, dead_reckoned_.T_map_level, delivered_.T_map_level)) {}

  ProductSummary Run() {
    ChooseMap();
    CorrectTheTrack();
    summary_.noise = options_.noise;
    const bool tells_timing = !HasWrongClock(options_.warnings);
    SurveyNoise noise = options_.noise;
    if (!tells_timing || (options_.dives.size() == 1 && options_.dives[0].IsSeenByOverlaps()))
      noise.timing = {};
    summary_.noise_findings = NoiseFindings(noise);
    const std::size_t told =
        tells_timing ? std::min(survey_.dives.size(), options_.dives.size()) : 0;
    for (std::size_t k = 0; k < told; ++k) {
      if (options_.dives[k].IsSeenByOverlaps()) continue;
      for (const std::string& finding : TimingFindings(options_.dives[k].sonar))
        summary_.noise_findings.push_back(survey_.dives[k] + ": " + finding);
    }
    WriteMap();
    WriteMismatch();
    WriteTrackAndLayers();
    Write(product_files::kPoses, PosesTxt(survey_, delivered_.T_map_level));
    Write(product_files::kGraph, GraphG2o(survey_, delivered_));
    if (projection_.has_crs()) WriteQgisProject();
    RewriteSubmaps(survey_, delivered_, dir_ / product_files::kSubmapFolder);
    WriteExports();
    WriteReport();
    return std::move(summary_);
  }

  ProductSummary RunTrackAlone() {
    summary_.outcome = Outcome::kTrackAlone;
    summary_.statement = "There is no map: nothing was sounded. The track is as navigated.";
    if (!options_.partial.empty()) summary_.statement = options_.partial + " " + summary_.statement;
    summary_.partial = !options_.partial.empty();
    CorrectTheTrack();
    WriteTrackAndLayers();
    WriteNavigation();
    WriteReport();
    return std::move(summary_);
  }

 private:
  void Write(const std::string& name, const std::string& bytes) {
    summary_.files.push_back(name);
    WriteAtomically(dir_ / name, bytes);
    Progress(options_, name);
  }
  // Encodes and writes a file beside what goes on. make: of what it holds itself, or of what does
  // not change any more.
  void WriteBeside(const std::string& name, std::function<std::string()> make) {
    summary_.files.push_back(name);
    files_.Add([this, name, make = std::move(make)] {
      WriteAtomically(dir_ / name, make());
      Progress(options_, name);
    });
  }
  void WriteBeside(const std::string& name, std::shared_ptr<const Raster> raster) {
    WriteBeside(name, [this, raster = std::move(raster)] {
      return GeoTiff(geometry_, *raster, projection_);
    });
  }

  void WriteTrackAndLayers() {
    WriteBeside(product_files::kTrack, [this] { return TrackCsv(track_, options_.datum); });
    const auto layers = std::make_shared<const std::vector<VectorLayer>>(
        SurveyLayers(survey_, delivered_, track_, projection_));
    WriteBeside(product_files::kGeoPackage,
                [this, layers] { return GeoPackage(*layers, projection_); });
    if (viewer_) map_data_ = viewer_->Json(LinesOf(*layers));
  }

  void WriteReport() {
    summary_.horizontal_crs = projection_.horizontal();
    summary_.crs = projection_.compound();
    const Report report = ReportOf(survey_, summary_, options_);
    Write(product_files::kReportPage, ReportHtml(report, map_data_));
    // Last, so that its run figures cover all of the above.
    files_.Finish();
    Write(product_files::kReport, ReportJson(report));
  }

  // Grids both maps alike, measures both, and keeps the poses of the one to deliver.
  void ChooseMap() {
    // In the map frame: no projection reaches a wild solution.
    const MapProjection flat(options_.axes);
    const Eigen::AlignedBox2d box = BoxOf(survey_, dead_reckoned_, flat);
    const Eigen::AlignedBox2d both = box.merged(BoxOf(survey_, delivered_, flat));
    const bool wild = IsWild(both, box);
    Eigen::AlignedBox2d extent = BoxOf(survey_, dead_reckoned_, projection_);
    if (!wild) extent.extend(BoxOf(survey_, delivered_, projection_));
    summary_.cell_m = ChooseCell(survey_, extent, options_.cell_m, options_.max_cells);
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
    if (summary_.outcome != Outcome::kCorrected) delivered_ = dead_reckoned_;
  }

  ConsistencyMap Measure(const SurveyPoses& poses, std::size_t cache_points, bool tells) {
    const std::size_t n = survey_.submaps.size();
    return ComputeConsistency(
        survey_.submaps, poses, projection_, geometry_, cache_points, [&](std::size_t i) {
          if (tells && i % 50 == 0)
            Progress(
                options_,
                "swath mismatch: submap " + std::to_string(i + 1) + " of " + std::to_string(n));
        });
  }

  // As navigated, and as solved beside it.
  void MeasureBoth(bool solved_too) {
    const std::size_t cache_points = options_.cache_points / (solved_too ? 2 : 1);
    std::optional<ConsistencyMap> measured, as_solved;
    ForEachBeside(solved_too ? 2 : 1, [&](std::size_t k) {
      if (k == 0)
        measured = Measure(dead_reckoned_, cache_points, true);
      else
        as_solved = Measure(delivered_, cache_points, false);
    });
    const ConsistencyMap& before = *measured;
    if (!solved_too) {
      summary_.before = summary_.solved = summary_.before_all = summary_.solved_all =
          Figures(before);
    } else {
      const ConsistencyMap& solved = *as_solved;
      summary_.before = FiguresOfComparableCells(before, solved);
      summary_.solved = FiguresOfComparableCells(solved, before);
      summary_.before_all = Figures(before);
      summary_.solved_all = Figures(solved);
      mismatch_solved_ = std::make_shared<const Raster>(Mismatch(solved));
    }
    mismatch_before_ = std::make_shared<const Raster>(Mismatch(before));
  }

  const std::shared_ptr<const Raster>& MismatchOfDelivered() const {
    return summary_.outcome == Outcome::kCorrected ? mismatch_solved_ : mismatch_before_;
  }

  void CorrectTheTrack() {
    if (summary_.outcome == Outcome::kCorrected)
      delivered_sigmas_ = SolvedSigmas(survey_);
    else
      delivered_sigmas_.resize(survey_.submaps.size());
    const TrackCorrection correction(survey_, delivered_, delivered_sigmas_);
    track_ = CorrectTrack(survey_, correction);
    summary_.distance_m = TrackLength(track_);
    summary_.duration_s = TrackDuration(track_);
    if (!options_.truth.empty()) {
      summary_.truth = CompareWithTruth(track_, options_.truth);
      summary_.published = ComparePublishedWithTruth(survey_.published, options_.truth);
      summary_.closures_against_truth = CompareClosuresWithTruth(survey_, options_.truth);
    }
  }

  void WriteNavigation() {
    MakeFolder(dir_ / product_files::kExportFolder);
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
    const auto track =
        std::make_shared<const std::vector<GeographicState>>(ToGeographic(states, *options_.datum));
    const std::string name = "export/navigation" + number;
    WriteBeside(name + ".csv", [track] { return NavigationCsv(*track); });
    WriteBeside(name + ".sbet", [track] { return SbetBytes(*track); });
    WriteBeside(name + ".na0", [track] { return Na0Text(*track); });
  }

  // What other people's programs take.
  void WriteExports() {
    WriteNavigation();
    Write("export/lines.csv",
          LinesCsv(survey_, dead_reckoned_, delivered_, delivered_sigmas_, options_.axes));
    if (options_.soundings == nullptr || !options_.sounding_format) return;
    files_.Finish();  // the raster of the shoalest reads them, too
    const bool las = *options_.sounding_format == SoundingFormat::kLas;
    const std::string name = las ? "export/soundings.las" : "export/soundings.xyz";
    WriteSoundings(survey_,
                   delivered_,
                   {*options_.sounding_format, projection_, options_.datum},
                   options_.soundings,
                   dir_ / name);
    Progress(options_, name);
    std::string files = "file,name\n";
    for (std::size_t i = 0; i < survey_.inputs.size(); ++i)
      files += std::to_string(i + 1) + ',' + CsvText(survey_.inputs[i].name) + '\n';
    Write("export/files.csv", files);
  }

  // Grids the points of all submaps at `poses`.
  DepthMap Grid(const SurveyPoses& poses) const {
    DepthMap map(geometry_);
    for (std::size_t i = 0; i < survey_.submaps.size(); ++i)
      map.Add(LoadMapPoints(survey_.submaps, poses, i, projection_),
              ErrorsOf(i),
              ToNorthEastDown(survey_.submaps[i].T_map_submap.translation(), options_.axes).z());
    return map;
  }

  // Of a submap in the delivered map.
  SubmapErrors ErrorsOf(std::size_t i) const {
    const SurveySubmap& s = survey_.submaps[i];
    const double ratio = options_.noise.components.correlated_error_ratio.value;
    if (const auto& solved = delivered_sigmas_[i]) return {solved->x(), solved->y(), ratio};
    const auto state = std::lower_bound(
        survey_.track.begin(), survey_.track.end(), s, [](const TrackState& a, const auto& b) {
          return std::pair(a.chain, a.time) < std::pair(b.chain, b.frame_time);
        });
    if (state == survey_.track.end()) return {0.0, 0.0, ratio};
    return {state->sigma.x(), state->sigma.y(), ratio};
  }

  void WriteMap() {
    viewer_.emplace(geometry_);
    // Beside the depth maps.
    if (options_.soundings != nullptr)
      shoalest_ = std::async(std::launch::async, [this] {
        return Shoalest(survey_, delivered_, projection_, geometry_, options_.soundings);
      });
    std::vector<float> before;
    {
      const auto raster = std::make_shared<const Raster>(Grid(dead_reckoned_).Elevation());
      WriteBeside(product_files::kElevationAsNavigated, raster);
      if (summary_.outcome == Outcome::kCorrected)
        viewer_->Add("elevation_before", raster->values, kNoData);
      before = raster->values;
    }
    std::vector<float> after = WriteDelivered();
    ColourRange range = RangeOf({&before, &after}, 0.005, 0.995, 0.1);
    summary_.elevation_range_m = range;
    range = {-range.second, -range.first};
    Picture picture = DepthPicture(geometry_, before, range);
    picture.title = options_.title + ": depth, as navigated";
    picture.subtitle = Subtitle(summary_, summary_.before);
    picture.lines = TrackLines(track_, false, projection_);
    Write(product_files::kDepthPictureAsNavigated, RenderPng(picture));
    picture = DepthPicture(geometry_, after, range);
    picture.title = options_.title + ": depth, " + MapName(summary_.outcome);
    picture.subtitle = Subtitle(summary_, summary_.after());
    picture.lines = LoopLines(survey_, delivered_, projection_);
    const bool corrected = summary_.outcome == Outcome::kCorrected;
    for (PictureLine& line : TrackLines(track_, corrected, projection_))
      picture.lines.push_back(std::move(line));
    Write(product_files::kDepthPicture, RenderPng(picture));
  }

  // Returns the elevations.
  std::vector<float> WriteDelivered() {
    const auto [elevation, uncertainty] = WriteOfDepthMap();
    if (options_.soundings != nullptr)
      WriteBeside(product_files::kShoalest,
                  [this] { return GeoTiff(geometry_, shoalest_.get(), projection_); });
    if (projection_.has_crs())
      WriteBeside(product_files::kBag, [this, elevation, uncertainty] {
        return Bag(
            geometry_, {*elevation, *uncertainty, options_.title, survey_.End()}, projection_);
      });
    return elevation->values;
  }

  // Returns elevation and uncertainty. The depth map is the largest part of a large raster.
  std::pair<std::shared_ptr<const Raster>, std::shared_ptr<const Raster>> WriteOfDepthMap() {
    const DepthMap map = Grid(delivered_);
    summary_.cells_mapped = map.CountSeen();
    WriteBeside(product_files::kSpread, std::make_shared<const Raster>(map.Spread()));
    seen_ = std::make_shared<const Raster>(map.Density());
    WriteBeside(product_files::kDensity, seen_);
    const auto elevation = std::make_shared<const Raster>(map.Elevation());
    WriteBeside(product_files::kElevation, elevation);
    const auto uncertainty = std::make_shared<const Raster>(map.Uncertainty(
        {options_.depth_bias_m, options_.noise.components.sounding_variance_ratio.value}));
    WriteBeside(product_files::kUncertainty, uncertainty);
    viewer_->Add("elevation", elevation->values, kNoData);
    viewer_->Add("uncertainty", uncertainty->values, kNoData);
    summary_.s44 = CompareWithS44(*elevation, *MismatchOfDelivered());
    return {elevation, uncertainty};
  }

  void WriteMismatch() {
    const std::vector<float>& before = mismatch_before_->values;
    const std::vector<float>& after = MismatchOfDelivered()->values;
    WriteBeside(product_files::kMismatchAsNavigated, mismatch_before_);
    WriteBeside(product_files::kMismatch, MismatchOfDelivered());
    if (summary_.outcome == Outcome::kCorrected) viewer_->Add("mismatch_before", before, kNoData);
    viewer_->Add("mismatch", after, kNoData);
    const double highest_m = std::max(0.01, RangeOf({&before, &after}, 0.0, 0.98, 0.0).second);
    Picture picture = MismatchPicture(geometry_, before, seen_->values, highest_m);
    picture.title = options_.title + ": swath mismatch, as navigated";
    picture.subtitle = Subtitle(summary_, summary_.before) + "; grey: seen by one submap";
    Write(product_files::kMismatchPictureAsNavigated, RenderPng(picture));
    picture = MismatchPicture(geometry_, after, seen_->values, highest_m);
    picture.title = options_.title + ": swath mismatch, " + MapName(summary_.outcome);
    picture.subtitle = Subtitle(summary_, summary_.after()) + "; grey: seen by one submap";
    Write(product_files::kMismatchPicture, RenderPng(picture));
  }

  void WriteQgisProject() {
    using Kind = QgisLayer::Kind;
    const auto of_survey = [](Kind kind, const char* table, const char* title, const char* colour) {
      return QgisLayer{kind, product_files::kGeoPackage, table, title, false, {}, colour};
    };
    std::vector<QgisLayer> layers{
        of_survey(Kind::kLines, kTrackLayer, "Track", "20,20,25,255"),
        of_survey(Kind::kLines, kTrackAsNavigatedLayer, "Track as navigated", "150,60,40,255"),
        of_survey(Kind::kLines, kEdgeLayer, "Loop closures", "220,30,90,160"),
        of_survey(Kind::kPoints, kFixLayer, "Position fixes", "40,140,60,255"),
        of_survey(Kind::kPolygons, kFootprintLayer, "Submaps", "90,90,100,255")};
    layers.front().visible = true;
    const auto map = [&](const char* file, const char* title, bool visible) {
      layers.push_back(
          {Kind::kElevation, file, "", title, visible, summary_.elevation_range_m, ""});
    };
    map(product_files::kElevation, "Elevation", true);
    map(product_files::kElevationAsNavigated, "Elevation as navigated", false);
    layers.push_back({Kind::kHillshade, product_files::kElevation, "", "Relief", true, {}, ""});
    const Eigen::Vector2d& min = geometry_.origin;
    const Eigen::Vector2d max =
        min + geometry_.cell_m * Eigen::Vector2d(geometry_.rows, geometry_.cols);
    Write(product_files::kQgisProject,
          QgisProject(options_.title, projection_, {min, max}, layers));
  }

  const Survey& survey_;
  const ProductOptions& options_;
  fs::path dir_;
  MapProjection projection_;
  SurveyPoses dead_reckoned_;
  SurveyPoses delivered_;  // the solved ones unless ChooseMap() withholds them
  // Of the submaps in the map's axes; absent where the map is as navigated.
  std::vector<std::optional<Eigen::Vector3d>> delivered_sigmas_;
  ProductSummary summary_;
  GridGeometry geometry_;
  std::shared_ptr<const Raster> mismatch_before_;
  std::shared_ptr<const Raster> mismatch_solved_;  // null where it was not measured
  std::shared_ptr<const Raster> seen_;             // Density() of the delivered map
  std::vector<CorrectedState> track_;
  std::optional<MapData> viewer_;
  std::string map_data_;  // of viewer_
  // Last: their threads use the others.
  std::future<Raster> shoalest_;
  static constexpr std::size_t kMostUnwritten = 4;  // files, some with a raster
  Stage<std::function<void()>> files_{[](const std::function<void()>& write) { write(); },
                                      kMostUnwritten};
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
  MakeFolder(dir / product_files::kSubmapFolder);
  return ProductWriter(survey, options, dir).Run();
}

}  // namespace seastitch
