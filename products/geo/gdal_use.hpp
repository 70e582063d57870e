#pragma once

#include <cpl_error.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal_priv.h>

#include <memory>
#include <stdexcept>
#include <string>

// What the files of this folder share of GDAL. No header outside of it includes this one.
namespace seastitch {

// Registers the drivers in use. While it lives, GDAL's messages become the reason of an exception
// instead of lines on stderr.
class QuietGdal {
 public:
  QuietGdal();
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

// Throws std::runtime_error "WHAT: GDAL's last message" where `good` is false.
void Require(bool good, const std::string& what);

// A reference system from WKT, "EPSG:32632" or a PROJ string, with east (longitude) first. Reads no
// file and no address. Throws std::runtime_error with GDAL's reason.
OGRSpatialReference ReferenceSystem(const std::string& crs);

// Text for an element or an attribute of XML.
std::string XmlText(const std::string& text);

// The driver of that name.
GDALDriver* GdalDriver(const char* name);

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

// A file that GDAL writes in memory, so that the disk sees only finished bytes.
class MemoryFile {
 public:
  explicit MemoryFile(std::string path) : path_(std::move(path)) {}
  ~MemoryFile() { VSIUnlink(path_.c_str()); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  const char* path() const { return path_.c_str(); }
  std::string Bytes() const;

 private:
  std::string path_;
};

}  // namespace seastitch
