#include "products/geo/qgis_project.hpp"

#include <array>
#include <cstdio>
#include <sstream>

#include "products/geo/gdal_use.hpp"
#include "products/geo/geographic_converter.hpp"

namespace seastitch {
namespace {

std::string Number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

std::string SourceOf(const QgisLayer& layer) {
  return "./" + layer.file + (layer.table.empty() ? "" : "|layername=" + layer.table);
}

bool IsRaster(const QgisLayer& layer) {
  return layer.kind == QgisLayer::Kind::kHillshade || layer.kind == QgisLayer::Kind::kElevation;
}

// QGIS replaces identifiers that are shorter than a time and one character.
std::string IdOf(std::size_t index) {
  const std::string number = std::to_string(index + 1);
  return "layer_" + std::string(20 - number.size(), '0') + number;
}

// The horizontal system.
std::string ReferenceSystem(const MapProjection& projection) {
  return "<spatialrefsys><wkt>" + XmlText(WktOf(projection.horizontal())) + "</wkt><authid>" +
         XmlText(projection.horizontal()) + "</authid></spatialrefsys>";
}

// Deep blue to pale sand, as in depth.png.
std::string ColourRamp(const std::pair<double, double>& range_m) {
  constexpr std::array<const char*, 6> kColours{
      "#0b1f4b", "#1b4f8f", "#2f86b5", "#63b7b7", "#b5dcb0", "#f6efc4"};
  std::ostringstream xml;
  xml << "<rastershader><colorrampshader colorRampType=\"INTERPOLATED\" classificationMode=\"1\" "
         "clip=\"0\" minimumValue=\""
      << Number(range_m.first) << "\" maximumValue=\"" << Number(range_m.second) << "\">";
  for (std::size_t i = 0; i < kColours.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(kColours.size() - 1);
    const double value = range_m.first + share * (range_m.second - range_m.first);
    char label[40];
    std::snprintf(label, sizeof label, "%.2f m", value);
    xml << "<item value=\"" << Number(value) << "\" color=\"" << kColours[i]
        << "\" alpha=\"255\" label=\"" << label << "\"/>";
  }
  xml << "</colorrampshader></rastershader>";
  return xml.str();
}

constexpr char kSmooth[] =
    "<rasterresampler zoomedInResampler=\"bilinear\" zoomedOutResampler=\"bilinear\" "
    "maxOversampling=\"2\"/>";

std::string RasterRenderer(const QgisLayer& layer) {
  if (layer.kind == QgisLayer::Kind::kHillshade)
    return "<pipe><rasterrenderer type=\"hillshade\" band=\"1\" azimuth=\"315\" angle=\"45\" "
           "zfactor=\"2\" multidirection=\"0\" opacity=\"1\" alphaBand=\"-1\"/>"
           "<brightnesscontrast brightness=\"40\" contrast=\"0\"/>" +
           std::string(kSmooth) + "</pipe><blendMode>0</blendMode>";
  constexpr const char* kMultiply = "6";
  return "<pipe><rasterrenderer type=\"singlebandpseudocolor\" band=\"1\" opacity=\"1\" "
         "alphaBand=\"-1\" classificationMin=\"" +
         Number(layer.range_m.first) + "\" classificationMax=\"" + Number(layer.range_m.second) +
         "\">" + ColourRamp(layer.range_m) + "</rasterrenderer>" + kSmooth + "</pipe><blendMode>" +
         kMultiply + "</blendMode>";
}

std::string Property(const char* name, const std::string& value) {
  return std::string("<prop k=\"") + name + "\" v=\"" + XmlText(value) + "\"/>";
}

std::string VectorRenderer(const QgisLayer& layer) {
  std::string type = "line", symbol;
  switch (layer.kind) {
    case QgisLayer::Kind::kPoints:
      type = "marker";
      symbol = "<layer class=\"SimpleMarker\" enabled=\"1\">" + Property("name", "circle") +
               Property("color", layer.colour) + Property("size", "2") + "</layer>";
      break;
    case QgisLayer::Kind::kPolygons:
      type = "fill";
      symbol = "<layer class=\"SimpleFill\" enabled=\"1\">" + Property("style", "no") +
               Property("outline_color", layer.colour) + Property("outline_width", "0.2") +
               "</layer>";
      break;
    default:
      symbol = "<layer class=\"SimpleLine\" enabled=\"1\">" + Property("line_color", layer.colour) +
               Property("line_width", "0.3") + "</layer>";
  }
  return "<renderer-v2 type=\"singleSymbol\"><symbols><symbol name=\"0\" alpha=\"1\" type=\"" +
         type + "\">" + symbol + "</symbol></symbols></renderer-v2>";
}

std::string GeometryOf(const QgisLayer& layer) {
  switch (layer.kind) {
    case QgisLayer::Kind::kPoints: return "Point";
    case QgisLayer::Kind::kPolygons: return "Polygon";
    default: return "Line";
  }
}

std::string MapLayer(const QgisLayer& layer, const std::string& id, const std::string& srs) {
  const bool raster = IsRaster(layer);
  return std::string("<maplayer type=\"") +
         (raster ? "raster\"" : "vector\" geometry=\"" + GeometryOf(layer) + "\"") + "><id>" + id +
         "</id><datasource>" + XmlText(SourceOf(layer)) + "</datasource><layername>" +
         XmlText(layer.title) + "</layername><srs>" + srs + "</srs><provider>" +
         (raster ? "gdal" : "ogr") + "</provider>" +
         (raster ? RasterRenderer(layer) : VectorRenderer(layer)) + "</maplayer>\n";
}

}  // namespace

std::string QgisProject(const std::string& title,
                        const MapProjection& projection,
                        const Eigen::AlignedBox2d& north_east,
                        const std::vector<QgisLayer>& layers) {
  const std::string srs = ReferenceSystem(projection);
  std::ostringstream xml;
  xml << "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
      << "<qgis version=\"3.22.0\" projectname=\"" << XmlText(title) << "\">\n<title>"
      << XmlText(title) << "</title>\n<projectCrs>" << srs << "</projectCrs>\n<layer-tree-group>\n";
  for (std::size_t i = 0; i < layers.size(); ++i)
    xml << "<layer-tree-layer id=\"" << IdOf(i) << "\" name=\"" << XmlText(layers[i].title)
        << "\" checked=\"" << (layers[i].visible ? "Qt::Checked" : "Qt::Unchecked")
        << "\" source=\"" << XmlText(SourceOf(layers[i])) << "\" providerKey=\""
        << (IsRaster(layers[i]) ? "gdal" : "ogr") << "\" expanded=\"0\"/>\n";
  xml << "</layer-tree-group>\n<mapcanvas name=\"theMapCanvas\"><units>meters</units><extent><xmin>"
      << Number(north_east.min().y()) << "</xmin><ymin>" << Number(north_east.min().x())
      << "</ymin><xmax>" << Number(north_east.max().y()) << "</xmax><ymax>"
      << Number(north_east.max().x()) << "</ymax></extent><destinationsrs>" << srs
      << "</destinationsrs></mapcanvas>\n<layerorder>";
  for (std::size_t i = 0; i < layers.size(); ++i) xml << "<layer id=\"" << IdOf(i) << "\"/>";
  xml << "</layerorder>\n<properties><SpatialRefSys><ProjectionsEnabled type=\"int\">1"
      << "</ProjectionsEnabled></SpatialRefSys><Paths><Absolute "
         "type=\"bool\">false</Absolute></Paths>"
      << "</properties>\n<projectlayers>\n";
  for (std::size_t i = 0; i < layers.size(); ++i) xml << MapLayer(layers[i], IdOf(i), srs);
  xml << "</projectlayers>\n</qgis>\n";
  return xml.str();
}

}  // namespace seastitch
