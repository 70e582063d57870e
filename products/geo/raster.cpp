#include "products/geo/raster.hpp"

#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "products/geo/gdal_use.hpp"
#include "products/geo/geographic_converter.hpp"

namespace seastitch {
namespace {

// A dataset in memory with the place of the grid.
Dataset Empty(const GridGeometry& g, int bands, GDALDataType type) {
  Dataset dataset(GdalDriver("MEM")->Create("", g.cols, g.rows, bands, type, nullptr));
  Require(dataset != nullptr, "raster");
  double transform[6] = {
      g.origin.y(), g.cell_m, 0.0, g.origin.x() + g.rows * g.cell_m, 0.0, -g.cell_m};
  Require(dataset->SetGeoTransform(transform) == CE_None, "raster");
  return dataset;
}

// Writes the values with another value in place of kNoData. Raster lines run south.
void WriteBand(GDALRasterBand* out, const Raster& raster, const GridGeometry& g, float no_data) {
  out->SetDescription(raster.description.c_str());
  if (!raster.unit.empty()) out->SetUnitType(raster.unit.c_str());
  out->SetNoDataValue(static_cast<double>(no_data));
  std::vector<float> line(static_cast<std::size_t>(g.cols));
  for (int row = 0; row < g.rows; ++row) {
    const float* values = raster.values.data() + g.Index(g.rows - 1 - row, 0);
    std::replace_copy(values, values + g.cols, line.begin(), kNoData, no_data);
    Require(out->RasterIO(
                GF_Write, 0, row, g.cols, 1, line.data(), g.cols, 1, GDT_Float32, 0, 0, nullptr) ==
                CE_None,
            "raster");
  }
}

// Programs that draw the raster need not read it first.
void AddStatistics(GDALRasterBand* band) {
  double unused = 0.0;
  // Fails for a band without any value, which then has none.
  band->ComputeStatistics(FALSE, &unused, &unused, &unused, &unused, nullptr, nullptr);
}

// HDF5 stores in the header of each object when it was made: message 0x0012 of 8 bytes, version 1,
// then seconds. Zeros in their place, so that the same map gives the same bytes.
void ForgetTimes(std::string* hdf5) {
  constexpr std::array<char, 12> kHead{0x12, 0, 8, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  constexpr std::ptrdiff_t kTimeBytes = 4;
  auto at = hdf5->begin();
  while ((at = std::search(at, hdf5->end(), kHead.begin(), kHead.end())) != hdf5->end()) {
    at += kHead.size();
    std::fill_n(at, std::min(kTimeBytes, hdf5->end() - at), '\0');
  }
}

}  // namespace

std::string GeoTiff(const GridGeometry& g, const Raster& raster, const MapProjection& projection) {
  const QuietGdal quiet;
  const bool counts = raster.type == RasterType::kCount;
  const Dataset content = Empty(g, 1, counts ? GDT_UInt32 : GDT_Float32);
  if (projection.has_crs()) {
    const OGRSpatialReference srs =
        ReferenceSystem(raster.is_vertical ? projection.compound() : projection.horizontal());
    Require(content->SetSpatialRef(&srs) == CE_None, "GeoTIFF");
  }
  WriteBand(content->GetRasterBand(1), raster, g, counts ? 0.0f : kNoData);
  AddStatistics(content->GetRasterBand(1));
  CPLStringList options;
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("PREDICTOR", "YES");
  options.SetNameValue("BLOCKSIZE", "256");
  options.SetNameValue("OVERVIEW_RESAMPLING", counts ? "NEAREST" : "AVERAGE");
  const MemoryFile file("/vsimem/seastitch_raster.tif");
  Dataset copy(GdalDriver("COG")->CreateCopy(
      file.path(), content.get(), TRUE, options.List(), nullptr, nullptr));
  Require(copy != nullptr, "GeoTIFF");
  copy.reset();
  return file.Bytes();
}

std::string Bag(const GridGeometry& g, const BagContent& content, const MapProjection& projection) {
  constexpr float kBagNoData = 1e6f;
  const QuietGdal quiet;
  const Dataset both = Empty(g, 2, GDT_Float32);
  const OGRSpatialReference horizontal = ReferenceSystem(projection.horizontal());
  Require(both->SetSpatialRef(&horizontal) == CE_None, "BAG");
  WriteBand(both->GetRasterBand(1), content.elevation, g, kBagNoData);
  WriteBand(both->GetRasterBand(2), content.uncertainty, g, kBagNoData);
  CPLStringList options;
  if (!projection.vertical().empty())
    options.SetNameValue("VAR_VERT_WKT", WktOf(projection.vertical()).c_str());
  const std::string day = UtcText(content.end, "%Y-%m-%d");
  options.SetNameValue("VAR_DATE", day.c_str());
  options.SetNameValue("VAR_DATETIME", UtcText(content.end, "%Y-%m-%dT%H:%M:%S").c_str());
  options.SetNameValue("VAR_VERTICAL_UNCERT_CODE", "productUncert");
  options.SetNameValue("VAR_ABSTRACT", content.title.c_str());  // GDAL escapes it
  options.SetNameValue("VAR_PROCESS_STEP_DESCRIPTION", "Gridded by Seastitch");
  options.SetNameValue(
      "VAR_XML_IDENTIFICATION_CITATION",
      ("<gmd:CI_Citation><gmd:title><gco:CharacterString>" + XmlText(content.title) +
       "</gco:CharacterString></gmd:title><gmd:date><gmd:CI_Date><gmd:date><gco:Date>" + day +
       "</gco:Date></gmd:date><gmd:dateType><gmd:CI_DateTypeCode "
       "codeList=\"http://www.isotc211.org/2005/resources/Codelist/"
       "gmxCodelists.xml#CI_DateTypeCode\" codeListValue=\"creation\">creation"
       "</gmd:CI_DateTypeCode></gmd:dateType></gmd:CI_Date></gmd:date></gmd:CI_Citation>")
          .c_str());
  const MemoryFile file("/vsimem/seastitch_survey.bag");
  Dataset copy(GdalDriver("BAG")->CreateCopy(
      file.path(), both.get(), TRUE, options.List(), nullptr, nullptr));
  Require(copy != nullptr, "BAG");
  copy.reset();
  std::string bytes = file.Bytes();
  ForgetTimes(&bytes);
  return bytes;
}

}  // namespace seastitch
