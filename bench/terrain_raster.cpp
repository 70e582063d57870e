#include "bench/terrain_raster.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace seastitch::bench {
namespace {

constexpr double kMaxCells = 2e8;

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

Dataset Open(const std::string& file) {
  GDALAllRegister();
  CPLPushErrorHandler(CPLQuietErrorHandler);
  Dataset dataset(GDALDataset::Open(
      file.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, nullptr, nullptr, nullptr));
  const std::string reason = CPLGetLastErrorMsg();
  CPLPopErrorHandler();
  if (!dataset) throw std::runtime_error(file + ": " + (reason.empty() ? "no raster" : reason));
  return dataset;
}

GridTerrain::Cells EmptyCells(GDALDataset* dataset, const std::string& file) {
  std::array<double, 6> transform{};
  if (dataset->GetGeoTransform(transform.data()) != CE_None)
    throw std::runtime_error(file + ": no geotransform: where its cells lie is not known");
  if (transform[2] != 0.0 || transform[4] != 0.0 || transform[5] >= 0.0 || transform[1] <= 0.0)
    throw std::runtime_error(file + ": rows must run from west to east, from north to south");
  double metres = 1.0;
  if (const OGRSpatialReference* crs = dataset->GetSpatialRef()) {
    if (crs->IsGeographic())
      throw std::runtime_error(file + ": geographic coordinates, expected a projection in metres");
    metres = crs->GetLinearUnits();
  }
  GridTerrain::Cells cells;
  cells.rows = dataset->GetRasterYSize();
  cells.cols = dataset->GetRasterXSize();
  cells.cell_north_m = -transform[5] * metres;
  cells.cell_east_m = transform[1] * metres;
  if (1.0 * cells.rows * cells.cols > kMaxCells)
    throw std::runtime_error(file + ": more than 200 million cells");
  return cells;
}

}  // namespace

std::unique_ptr<GridTerrain> LoadRaster(const RasterParams& params, const MapBox& survey) {
  const Dataset dataset = Open(params.file);
  if (dataset->GetRasterCount() < 1) throw std::runtime_error(params.file + ": no raster band");
  GridTerrain::Cells cells = EmptyCells(dataset.get(), params.file);
  GDALRasterBand* band = dataset->GetRasterBand(1);
  int has_nodata = 0;
  const auto nodata = static_cast<float>(band->GetNoDataValue(&has_nodata));

  const auto cols = static_cast<std::size_t>(cells.cols);
  cells.depth_m.resize(static_cast<std::size_t>(cells.rows) * cols);
  std::vector<float> line(cols);
  std::size_t known = 0;
  bool any_water = false;
  for (int row = 0; row < cells.rows; ++row) {
    if (band->RasterIO(
            GF_Read, 0, row, cells.cols, 1, line.data(), cells.cols, 1, GDT_Float32, 0, 0) !=
        CE_None)
      throw std::runtime_error(params.file + ": row " + std::to_string(row) + " is unreadable");
    float* out = &cells.depth_m[static_cast<std::size_t>(cells.rows - 1 - row) * cols];
    for (std::size_t col = 0; col < cols; ++col) {
      const float v = line[col];
      if (!std::isfinite(v) || (has_nodata != 0 && v == nodata)) {
        out[col] = std::numeric_limits<float>::quiet_NaN();
        continue;
      }
      out[col] = static_cast<float>((params.positive_down ? double{v} : -double{v}) +
                                    params.depth_offset_m);
      ++known;
      any_water = any_water || out[col] > 0.0f;
    }
  }
  if (known == 0) throw std::runtime_error(params.file + ": no cell has a value");
  if (!any_water)
    throw std::runtime_error(
        params.file +
        ": no cell lies below the water, where values are heights, negative below it; if they are "
        "depths, set positive_down: true of terrain.raster in the survey's file");
  return std::make_unique<GridTerrain>(std::move(cells), params.fill_m, survey);
}

}  // namespace seastitch::bench
