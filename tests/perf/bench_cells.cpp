// seastitch-bench-cells: the cells of a map against the true seabed, in units of their stated
// uncertainty. Simulates a survey for each seed, replays it, and reads the files of the map.

#include <gdal_priv.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/log.hpp"
#include "bench/survey_config.hpp"
#include "common/core/median.hpp"
#include "common/geo/map_frame.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "products/geo/geographic_converter.hpp"
#include "products/product_files.hpp"
#include "survey/replay/replay.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/bench_command.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct Raster {
  std::vector<float> values;  // rows from the north
  int rows = 0, cols = 0;
  double west_m = 0.0, north_m = 0.0, cell_m = 1.0;
  float no_data = 0.0f;

  float At(int row, int col) const {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) +
                  static_cast<std::size_t>(col)];
  }
  bool Has(int row, int col) const {
    return row >= 0 && row < rows && col >= 0 && col < cols && At(row, col) != no_data;
  }
};

Raster Read(const fs::path& file) {
  const std::unique_ptr<GDALDataset> dataset(
      static_cast<GDALDataset*>(GDALOpen(file.c_str(), GA_ReadOnly)));
  if (dataset == nullptr) throw std::runtime_error(file.string() + ": cannot be read");
  Raster raster;
  raster.rows = dataset->GetRasterYSize();
  raster.cols = dataset->GetRasterXSize();
  std::array<double, 6> transform{};
  dataset->GetGeoTransform(transform.data());
  raster.west_m = transform[0];
  raster.north_m = transform[3];
  raster.cell_m = transform[1];
  GDALRasterBand* const band = dataset->GetRasterBand(1);
  raster.no_data = static_cast<float>(band->GetNoDataValue());
  raster.values.resize(static_cast<std::size_t>(raster.rows) *
                       static_cast<std::size_t>(raster.cols));
  if (band->RasterIO(GF_Read,
                     0,
                     0,
                     raster.cols,
                     raster.rows,
                     raster.values.data(),
                     raster.cols,
                     raster.rows,
                     GDT_Float32,
                     0,
                     0,
                     nullptr) != CE_None)
    throw std::runtime_error(file.string() + ": cannot be read");
  return raster;
}

// Cells of a class of slope.
struct SlopeClass {
  const char* name;
  double below;  // rise over run
  std::vector<double> errors_m{}, sigmas_m{};
};

std::vector<SlopeClass> SlopeClasses() {
  return {{"below 2 deg", 0.035}, {"2 to 5 deg", 0.0875}, {"5 to 10 deg", 0.176}, {"above", 1e9}};
}

void Print(const SlopeClass& cells) {
  if (cells.errors_m.empty()) return;
  double squares = 0.0, within_1 = 0.0, within_2 = 0.0;
  for (std::size_t i = 0; i < cells.errors_m.size(); ++i) {
    const double error = std::abs(cells.errors_m[i]);
    squares += error * error;
    within_1 += error <= cells.sigmas_m[i] ? 1.0 : 0.0;
    within_2 += error <= 1.96 * cells.sigmas_m[i] ? 1.0 : 0.0;
  }
  const double n = static_cast<double>(cells.errors_m.size());
  std::printf(
      "  %-12s %7.0f cells, error RMS %.4f m, median sigma %.4f m: %5.1f %% within 1, "
      "%5.1f %% within 1.96 sigma\n",
      cells.name,
      n,
      std::sqrt(squares / n),
      Median(cells.sigmas_m),
      100.0 * within_1 / n,
      100.0 * within_2 / n);
}

// Mean depth of the true seabed over a cell.
double TrueDepth(const bench::Terrain& terrain,
                 const GeographicConverter& crs,
                 const MapFrame& map,
                 const Eigen::Vector2d& east_north_min,
                 double cell_m) {
  constexpr int kPoints = 5;  // a side
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j)
      points.push_back(east_north_min + cell_m / kPoints * Eigen::Vector2d(i + 0.5, j + 0.5));
  crs.Convert(&points);
  double sum = 0.0;
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d at = map.NorthEastOf(GeoPoint{p.x(), p.y()});
    sum += terrain.DepthAt(at.x(), at.y()).value_or(std::nan(""));
  }
  return sum / static_cast<double>(points.size());
}

void Compare(const fs::path& map_dir,
             const bench::Terrain& terrain,
             const Datum& datum,
             const std::string& crs,
             std::vector<SlopeClass>* classes) {
  const Raster elevation = Read(map_dir / product_files::kElevation);
  const Raster uncertainty = Read(map_dir / product_files::kUncertainty);
  const GeographicConverter converter(crs);
  const MapFrame map(datum);
  for (int row = 0; row < elevation.rows; ++row)
    for (int col = 0; col < elevation.cols; ++col) {
      if (!elevation.Has(row, col)) continue;
      const auto or_here = [&](int r, int c) {
        return static_cast<double>(elevation.Has(r, c) ? elevation.At(r, c)
                                                       : elevation.At(row, col));
      };
      const double slope = std::hypot(or_here(row, col + 1) - or_here(row, col - 1),
                                      or_here(row + 1, col) - or_here(row - 1, col)) /
                           (2.0 * elevation.cell_m);
      const Eigen::Vector2d corner(elevation.west_m + col * elevation.cell_m,
                                   elevation.north_m - (row + 1) * elevation.cell_m);
      const double depth_m = TrueDepth(terrain, converter, map, corner, elevation.cell_m);
      if (!std::isfinite(depth_m)) continue;
      for (SlopeClass& cells : *classes) {
        if (slope >= cells.below) continue;
        cells.errors_m.push_back(static_cast<double>(elevation.At(row, col)) + depth_m);
        cells.sigmas_m.push_back(static_cast<double>(uncertainty.At(row, col)));
        break;
      }
    }
}

void RunSeed(const std::string& survey, std::uint64_t seed, std::vector<SlopeClass>* all) {
  const TemporaryDir scratch;
  const fs::path log = scratch.path() / "survey.lcmlog";
  const bench::DriverConfigs drivers = bench::LoadDriverConfigs(ConfigDir());
  bench::SurveyConfig config = bench::LoadSurvey(survey);
  config.seed = seed;
  const VehicleGeometry vehicle = LoadVehicle((ConfigDir() / "vehicle.yaml").string());
  bench::SurveySimulator simulator(config, vehicle, drivers.signals());
  bench::WriteLog(&simulator, drivers, {}, log, [](double) { return true; });
  ReplayOptions replay;
  replay.inputs = {log};
  replay.mapper_config = WriteMapperConfigFor(config, ConfigDir(), scratch.path());
  replay.optimizer_config = ConfigDir() / "optimizer.yaml";
  replay.out = scratch.path() / "out";
  replay.quiet = true;
  const ProductSummary summary = RunReplay(replay);
  std::vector<SlopeClass> classes = SlopeClasses();
  Compare(replay.out, simulator.terrain(), DatumOf(vehicle), summary.horizontal_crs, &classes);
  std::printf("seed %llu: position error RMS %.2f m\n",
              static_cast<unsigned long long>(seed),
              summary.truth ? summary.truth->after.position_rms_m : 0.0);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    Print(classes[i]);
    (*all)[i].errors_m.insert(
        (*all)[i].errors_m.end(), classes[i].errors_m.begin(), classes[i].errors_m.end());
    (*all)[i].sigmas_m.insert(
        (*all)[i].sigmas_m.end(), classes[i].sigmas_m.begin(), classes[i].sigmas_m.end());
  }
  std::fflush(stdout);
}

int Main(int argc, char** argv) {
  std::string survey = (ConfigDir() / "bench" / "demo.yaml").string();
  std::uint64_t first = 7;
  int runs = 5;
  CLI::App app("cells of a map against the true seabed, in units of their stated uncertainty");
  app.add_option("--survey", survey)->capture_default_str();
  app.add_option("--seed", first, "first seed")->capture_default_str();
  app.add_option("--runs", runs)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::err);
  GDALAllRegister();
  std::vector<SlopeClass> all = SlopeClasses();
  for (int i = 0; i < runs; ++i) RunSeed(survey, first + static_cast<std::uint64_t>(i), &all);
  std::printf("all seeds\n");
  for (const SlopeClass& cells : all) Print(cells);
  return 0;
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  try {
    return seastitch::Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
