// The files of a map as other people's programs read them: GDAL, GMT, QGIS and Chromium.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// The map of config/bench/short.yaml, off Portsmouth in New Hampshire: 43.07 N, 70.71 W.
class MapReaders : public ::testing::Test {
 protected:
  static const fs::path& Map() {
    static const TemporaryDir dir;
    static const fs::path map = [] {
      const std::string log = (dir / "short.lcmlog").string();
      for (const std::string& arguments :
           {"bench --survey " + ConfigFile("bench/short.yaml") + " --log " + log,
            "replay --quiet " + log + " --out " + (dir / "map").string()}) {
        const auto run = RunCommand(Program("seastitch") + " " + arguments);
        EXPECT_EQ(run.exit_code, 0) << run.output;
      }
      return dir / "map";
    }();
    return map;
  }

  static nlohmann::json GdalInfo(const char* file) {
    const auto info = RunCommand("gdalinfo -json -mm " + (Map() / file).string());
    EXPECT_EQ(info.exit_code, 0) << info.output;
    return nlohmann::json::parse(info.output);
  }
};

TEST_F(MapReaders, GdalReadsElevationsInUtmWithTheWaterLevel) {
  const nlohmann::json info = GdalInfo("elevation.tif");
  ASSERT_EQ(info["bands"].size(), 1u);
  const nlohmann::json& band = info["bands"][0];
  EXPECT_EQ(band["unit"], "m");
  // The seabed of short.yaml: 20 m and some relief.
  EXPECT_NEAR(double(band["mean"]), -20.0, 1.0);
  EXPECT_GT(double(band["computedMin"]), -24.0);
  EXPECT_LT(double(band["computedMax"]), -16.0);
  EXPECT_THAT(std::string(info["coordinateSystem"]["wkt"]), HasSubstr("\"EPSG\",32619"));
  EXPECT_THAT(std::string(info["coordinateSystem"]["wkt"]), HasSubstr("\"EPSG\",5829"));
  // 43.07 N, 70.71 W in zone 19 lies within the map.
  const nlohmann::json& corners = info["cornerCoordinates"];
  EXPECT_LT(double(corners["lowerLeft"][0]), 360'774.0 + 5.0);
  EXPECT_GT(double(corners["upperRight"][0]), 360'774.0 - 5.0);
  EXPECT_LT(double(corners["lowerLeft"][1]), 4'770'010.0 + 30.0);
  EXPECT_GT(double(corners["upperRight"][1]), 4'770'010.0 - 30.0);
}

// The shallowest sounding of a cell is no deeper than the mean of the cell, but for rounding.
TEST_F(MapReaders, GdalComparesTheRastersOfOneGrid) {
  const nlohmann::json elevation = GdalInfo("elevation.tif");
  for (const char* const file : {"shoalest.tif",
                                 "spread.tif",
                                 "density.tif",
                                 "uncertainty.tif",
                                 "mismatch.tif",
                                 "elevation_as_navigated.tif",
                                 "mismatch_as_navigated.tif",
                                 "survey.bag"}) {
    const nlohmann::json info = GdalInfo(file);
    EXPECT_EQ(info["size"], elevation["size"]) << file;
    EXPECT_EQ(info["geoTransform"], elevation["geoTransform"]) << file;
  }
  EXPECT_GE(double(GdalInfo("shoalest.tif")["bands"][0]["mean"]),
            double(elevation["bands"][0]["mean"]) - 1e-4);
  EXPECT_EQ(GdalInfo("density.tif")["bands"][0]["type"], "UInt32");
  const nlohmann::json bag = GdalInfo("survey.bag");
  EXPECT_EQ(bag["bands"][0]["description"], "elevation");
  EXPECT_NEAR(
      double(bag["bands"][0]["computedMin"]), double(elevation["bands"][0]["computedMin"]), 1e-3);
  const nlohmann::json uncertainty = GdalInfo("uncertainty.tif");
  EXPECT_NEAR(
      double(bag["bands"][1]["computedMax"]), double(uncertainty["bands"][0]["computedMax"]), 1e-3);
}

TEST_F(MapReaders, OgrReadsTheLayers) {
  const auto info = RunCommand("ogrinfo -al -so " + (Map() / "survey.gpkg").string());
  ASSERT_EQ(info.exit_code, 0) << info.output;
  for (const char* const text : {"Layer name: track\n",
                                 "Layer name: track_as_navigated",
                                 "Layer name: footprints",
                                 "Layer name: edges",
                                 "Layer name: fixes",
                                 "submap: Integer64",
                                 "start: DateTime",
                                 "residual_m: Real",
                                 "UTM zone 19N"})
    EXPECT_THAT(info.output, HasSubstr(text));
}

TEST_F(MapReaders, GmtReadsElevations) {
  if (RunCommand("gmt --version").exit_code != 0) GTEST_SKIP() << "no GMT here";
  const auto info = RunCommand("gmt grdinfo -C " + (Map() / "elevation.tif").string());
  ASSERT_EQ(info.exit_code, 0) << info.output;
  std::istringstream in(info.output);
  std::string name;
  double west = 0, east = 0, south = 0, north = 0, lowest = 0, highest = 0;
  ASSERT_TRUE(in >> name >> west >> east >> south >> north >> lowest >> highest);
  const nlohmann::json band = GdalInfo("elevation.tif")["bands"][0];
  EXPECT_NEAR(lowest, double(band["computedMin"]), 1e-3);
  EXPECT_NEAR(highest, double(band["computedMax"]), 1e-3);
  EXPECT_NEAR(west, 360'760.0, 40.0);
  EXPECT_NEAR(south, 4'769'990.0, 40.0);
}

// Deep is blue and dark, shallow is sand and light, and relief is shaded.
TEST_F(MapReaders, QgisDrawsTheProjectAsItIsMeant) {
  const fs::path script = SourceDir() / "tests/survey/open_in_qgis.py";
  const TemporaryDir scratch;
  const auto run = RunCommand("XDG_RUNTIME_DIR=" + scratch.path().string() + " /usr/bin/python3 " +
                              script.string() + " " + Map().string() + " " +
                              (scratch / "map.png").string() + " 2>/dev/null");
  if (run.exit_code == 77) GTEST_SKIP() << "no QGIS here";
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json seen = nlohmann::json::parse(run.output);
  EXPECT_TRUE(seen["read"]);
  EXPECT_EQ(seen["crs"], "EPSG:32619");
  ASSERT_EQ(seen["layers"].size(), 8u);
  for (const nlohmann::json& layer : seen["layers"]) {
    EXPECT_TRUE(layer["valid"]) << layer;
    EXPECT_EQ(layer["crs"], "EPSG:32619") << layer;
    const std::string name = layer["name"];
    EXPECT_EQ(layer["visible"], name == "Track" || name == "Elevation" || name == "Relief");
  }
  EXPECT_GT(seen["pixels"], 2000);
  EXPECT_GT(seen["colours"], 300);
  const auto& deep = seen["deepest"];
  const auto& shallow = seen["shallowest"];
  EXPECT_GT(double(deep[2]), 1.3 * double(deep[0])) << deep;         // blue above red
  EXPECT_GT(double(shallow[0]), double(shallow[2])) << shallow;      // red above blue
  EXPECT_GT(double(shallow[1]), double(deep[1]) + 50.0) << shallow;  // lighter
}

// The map in the report says of a place what the map files say.
TEST_F(MapReaders, ChromiumShowsTheReportsMapOnADeskAndOnAPhone) {
  const auto north_east_text = [](const nlohmann::json& center) {
    std::ostringstream text;
    text.precision(12);
    text << double(center[1]) << " " << double(center[0]);
    return text.str();
  };
  const nlohmann::json center = GdalInfo("elevation.tif")["cornerCoordinates"]["center"];
  const TemporaryDir home;
  const auto run =
      RunCommand("HOME=" + home.path().string() + " /usr/bin/python3 " +
                 (SourceDir() / "tests/survey/report_in_browser.py").string() + " " +
                 (Map() / "report.html").string() + " " + north_east_text(center) + " 2>/dev/null");
  if (run.exit_code == 77) GTEST_SKIP() << "no Chromium here";
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json seen = nlohmann::json::parse(run.output);
  EXPECT_EQ(seen["title"], "short.lcmlog");
  EXPECT_TRUE(seen["drawn"]);
  EXPECT_TRUE(seen["errors"].empty()) << seen["errors"];
  EXPECT_LE(seen["too_wide_px"], 0);
  EXPECT_EQ(seen["layers"], nlohmann::json({"depth", "difference", "mismatch", "uncertainty"}));
  // "north N m, east E m, depth D m": of the cell at N, E.
  const std::string says = seen["says"];
  std::smatch found;
  ASSERT_TRUE(std::regex_search(
      says, found, std::regex("north ([0-9.]+) m, east ([0-9.]+) m .* depth ([0-9.]+) m")))
      << says;
  const auto value =
      RunCommand("gdallocationinfo -valonly -geoloc " + (Map() / "elevation.tif").string() + " " +
                 found[2].str() + " " + found[1].str());
  EXPECT_NEAR(std::stod(found[3].str()), -std::stod(value.output), 0.011) << says;
}

}  // namespace
}  // namespace seastitch
