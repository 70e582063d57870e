#include "products/geo/gdal_use.hpp"

#include <cpl_conv.h>
#include <gdal_frmts.h>
#include <ogrsf_frmts.h>

namespace seastitch {

QuietGdal::QuietGdal() {
  GDALRegister_GTiff();
  GDALRegister_COG();
  GDALRegister_MEM();
  GDALRegister_BAG();
  RegisterOGRGeoPackage();
  CPLPushErrorHandler(CPLQuietErrorHandler);
  CPLErrorReset();
}

void Require(bool good, const std::string& what) {
  if (!good) throw std::runtime_error(what + ": " + CPLGetLastErrorMsg());
}

OGRSpatialReference ReferenceSystem(const std::string& crs) {
  OGRSpatialReference srs;
  Require(
      srs.SetFromUserInput(
          crs.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) == OGRERR_NONE,
      "coordinate reference system");
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return srs;
}

std::string XmlText(const std::string& text) {
  char* escaped = CPLEscapeString(text.c_str(), -1, CPLES_XML);
  const std::string xml(escaped);
  CPLFree(escaped);
  return xml;
}

GDALDriver* GdalDriver(const char* name) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(name);
  Require(driver != nullptr, std::string("GDAL's driver ") + name);
  return driver;
}

std::string MemoryFile::Bytes() const {
  vsi_l_offset size = 0;
  const GByte* data = VSIGetMemFileBuffer(path_.c_str(), &size, FALSE);
  Require(data != nullptr && size > 0, path_);
  return std::string(reinterpret_cast<const char*>(data), static_cast<std::size_t>(size));
}

}  // namespace seastitch
