#include "products/files/geo_files.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <gdal.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// GDAL's messages become the reason of an exception instead of lines on stderr.
class QuietGdal {
 public:
  QuietGdal() {
    GDALRegister_GTiff();
    RegisterOGRGeoPackage();
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
  }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

void Require(bool good, const char* what) {
  if (!good) throw std::runtime_error(std::string(what) + ": " + CPLGetLastErrorMsg());
}

OGRSpatialReference Projection(const Datum& datum) {
  char text[160];
  std::snprintf(text,
                sizeof text,
                "+proj=aeqd +lat_0=%.12g +lon_0=%.12g +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs",
                datum.latitude_deg,
                datum.longitude_deg);
  OGRSpatialReference srs;
  Require(srs.importFromProj4(text) == OGRERR_NONE, "projection");
  srs.SetProjCS("Survey datum, azimuthal equidistant");
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return srs;
}

// A file that GDAL writes in memory, so that the disk sees only finished bytes.
class MemoryFile {
 public:
  explicit MemoryFile(std::string path) : path_(std::move(path)) {}
  ~MemoryFile() { VSIUnlink(path_.c_str()); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  const char* path() const { return path_.c_str(); }
  std::string Bytes() const {
    vsi_l_offset size = 0;
    const GByte* data = VSIGetMemFileBuffer(path_.c_str(), &size, FALSE);
    Require(data != nullptr && size > 0, path_.c_str());
    return std::string(reinterpret_cast<const char*>(data), static_cast<std::size_t>(size));
  }

 private:
  std::string path_;
};

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

// Grid rows run north, raster lines run south.
void WriteBand(GDALRasterBand* out, const RasterBand& band, const GridGeometry& g) {
  out->SetDescription(band.description.c_str());
  if (!band.unit.empty()) out->SetUnitType(band.unit.c_str());
  out->SetNoDataValue(static_cast<double>(kNoData));
  std::vector<float> line(static_cast<std::size_t>(g.cols));
  for (int row = 0; row < g.rows; ++row) {
    const float* values = band.values.data() + g.Index(g.rows - 1 - row, 0);
    line.assign(values, values + g.cols);
    Require(out->RasterIO(
                GF_Write, 0, row, g.cols, 1, line.data(), g.cols, 1, GDT_Float32, 0, 0, nullptr) ==
                CE_None,
            "GeoTIFF");
  }
}

std::unique_ptr<OGRGeometry> GeometryOf(const VectorFeature& feature, bool polygon) {
  auto line = polygon ? std::make_unique<OGRLinearRing>() : std::make_unique<OGRLineString>();
  for (const Eigen::Vector2d& p : feature.north_east) line->addPoint(p.y(), p.x());
  if (!polygon) return line;
  line->closeRings();
  auto area = std::make_unique<OGRPolygon>();
  area->addRing(static_cast<OGRLinearRing*>(line.get()));
  return area;
}

void WriteFeature(OGRLayer* out, const VectorFeature& feature, bool polygon) {
  struct Destroy {
    void operator()(OGRFeature* f) const { OGRFeature::DestroyFeature(f); }
  };
  const std::unique_ptr<OGRFeature, Destroy> row(OGRFeature::CreateFeature(out->GetLayerDefn()));
  for (const VectorField& field : feature.fields) {
    if (const auto* text = std::get_if<std::string>(&field.value)) {
      row->SetField(field.name.c_str(), text->c_str());
    } else if (const double number = std::get<double>(field.value); std::isfinite(number)) {
      row->SetField(field.name.c_str(), number);
    }
  }
  row->SetGeometry(GeometryOf(feature, polygon).get());
  Require(out->CreateFeature(row.get()) == OGRERR_NONE, "GeoPackage");
}

void WriteLayer(GDALDataset* dataset, const VectorLayer& layer, OGRSpatialReference* srs) {
  OGRLayer* out =
      dataset->CreateLayer(layer.name.c_str(), srs, layer.polygons ? wkbPolygon : wkbLineString);
  Require(out != nullptr, "GeoPackage");
  if (layer.features.empty()) return;
  for (const VectorField& field : layer.features.front().fields) {
    const bool is_text = std::holds_alternative<std::string>(field.value);
    OGRFieldDefn definition(field.name.c_str(), is_text ? OFTString : OFTReal);
    Require(out->CreateField(&definition) == OGRERR_NONE, "GeoPackage");
  }
  for (const VectorFeature& feature : layer.features) {
    WriteFeature(out, feature, layer.polygons);
  }
}

GDALDriver* Driver(const char* name) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(name);
  Require(driver != nullptr, name);
  return driver;
}

}  // namespace

std::string ProjectionWkt(const Datum& datum) {
  const QuietGdal quiet;
  char* text = nullptr;
  Require(Projection(datum).exportToWkt(&text) == OGRERR_NONE, "projection");
  const std::string wkt(text);
  CPLFree(text);
  return wkt;
}

std::string GeoTiff(const GridGeometry& g,
                    const std::vector<RasterBand>& bands,
                    const std::optional<Datum>& datum) {
  const QuietGdal quiet;
  const MemoryFile file("/vsimem/seastitch_raster.tif");
  CPLStringList options;
  options.SetNameValue("TILED", "YES");
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("PREDICTOR", "3");
  options.SetNameValue("INTERLEAVE", "BAND");
  Dataset dataset(Driver("GTiff")->Create(
      file.path(), g.cols, g.rows, static_cast<int>(bands.size()), GDT_Float32, options.List()));
  Require(dataset != nullptr, "GeoTIFF");
  double transform[6] = {
      g.origin.y(), g.cell_m, 0.0, g.origin.x() + g.rows * g.cell_m, 0.0, -g.cell_m};
  Require(dataset->SetGeoTransform(transform) == CE_None, "GeoTIFF");
  if (datum) {
    const OGRSpatialReference srs = Projection(*datum);
    Require(dataset->SetSpatialRef(&srs) == CE_None, "GeoTIFF");
  }
  for (std::size_t i = 0; i < bands.size(); ++i) {
    WriteBand(dataset->GetRasterBand(static_cast<int>(i) + 1), bands[i], g);
  }
  dataset.reset();
  return file.Bytes();
}

std::string GeoPackage(const std::vector<VectorLayer>& layers, const std::optional<Datum>& datum) {
  const QuietGdal quiet;
  // GeoPackage tables hold the date of their last change: pinned, so that the bytes repeat.
  const CPLConfigOptionSetter date("OGR_CURRENT_DATE", "1970-01-01T00:00:00.000Z", false);
  const MemoryFile file("/vsimem/seastitch_survey.gpkg");
  Dataset dataset(Driver("GPKG")->Create(file.path(), 0, 0, 0, GDT_Unknown, nullptr));
  Require(dataset != nullptr, "GeoPackage");
  std::optional<OGRSpatialReference> srs;
  if (datum) srs = Projection(*datum);
  for (const VectorLayer& layer : layers) WriteLayer(dataset.get(), layer, srs ? &*srs : nullptr);
  dataset.reset();
  return file.Bytes();
}

struct GeographicConverter::Transformation {
  struct Destroy {
    void operator()(OGRCoordinateTransformation* t) const {
      OGRCoordinateTransformation::DestroyCT(t);
    }
  };
  std::unique_ptr<OGRCoordinateTransformation, Destroy> to_wgs84;
};

GeographicConverter::GeographicConverter(const std::string& crs)
    : transformation_(std::make_unique<Transformation>()) {
  const QuietGdal quiet;
  OGRSpatialReference from;
  Require(
      from.SetFromUserInput(
          crs.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) == OGRERR_NONE,
      "coordinate reference system");
  name_ = from.GetName() != nullptr ? from.GetName() : "without a name";
  OGRAxisOrientation axis = OAO_Other;
  if (from.GetAxis("VERT_CS", 0, &axis) != nullptr) z_is_down_ = axis == OAO_Down;
  if (from.GetAttrNode("VERT_CS") != nullptr)
    z_unit_m_ = from.GetTargetLinearUnits("VERT_CS");
  else if (from.IsProjected() != 0)
    z_unit_m_ = from.GetLinearUnits();
  if (from.IsCompound() != 0) from.StripVertical();
  from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference to;
  Require(to.importFromProj4("+proj=longlat +datum=WGS84 +no_defs") == OGRERR_NONE, "WGS 84");
  to.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  transformation_->to_wgs84.reset(OGRCreateCoordinateTransformation(&from, &to));
  Require(transformation_->to_wgs84 != nullptr, "coordinate reference system");
}
GeographicConverter::~GeographicConverter() = default;

void GeographicConverter::Convert(std::vector<Eigen::Vector2d>* points) const {
  const QuietGdal quiet;
  std::vector<double> x, y;
  for (const Eigen::Vector2d& p : *points) {
    x.push_back(p.x());
    y.push_back(p.y());
  }
  std::vector<int> good(points->size(), FALSE);
  transformation_->to_wgs84->Transform(
      static_cast<int>(points->size()), x.data(), y.data(), nullptr, good.data());
  for (std::size_t i = 0; i < points->size(); ++i)
    (*points)[i] = good[i] != FALSE ? Eigen::Vector2d(Deg2Rad(y[i]), Deg2Rad(x[i]))
                                    : Eigen::Vector2d::Constant(std::nan(""));
}

}  // namespace seastitch
