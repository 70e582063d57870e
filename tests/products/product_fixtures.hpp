#pragma once

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>

#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/runtime/files/durable_file.hpp"
#include "common/storage/submap_file.hpp"
#include "products/map/judge.hpp"
#include "products/report/noise_report.hpp"
#include "products/write_products.hpp"
#include "tests/products/synthetic_survey.hpp"
#include "tests/support/files.hpp"

// A survey of two lines and its products in a folder.
namespace seastitch {

using testing::Collect;
using testing::DriftingSurvey;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::LoopEdge;
using testing::MakeDriftingSurvey;
using ::testing::Not;
using testing::SolutionAt;
namespace fs = std::filesystem;

inline const std::vector<std::string> kFiles = {"elevation.tif",
                                                "elevation_as_navigated.tif",
                                                "mismatch.tif",
                                                "mismatch_as_navigated.tif",
                                                "depth.png",
                                                "depth_as_navigated.png",
                                                "mismatch.png",
                                                "mismatch_as_navigated.png",
                                                "track.csv",
                                                "spread.tif",
                                                "density.tif",
                                                "uncertainty.tif",
                                                "poses.txt",
                                                "graph.g2o",
                                                "survey.gpkg",
                                                "survey.bag",
                                                "survey.qgs",
                                                "report.json",
                                                "report.html"};

inline const DriftingSurvey& Drifting() {
  static const DriftingSurvey survey = MakeDriftingSurvey();
  return survey;
}

inline ProductOptions OptionsWithDatum() {
  ProductOptions options;
  options.datum = Datum{57.1, 11.2};
  options.title = "A <test> survey";
  options.seeds = {{"bench", 42}};
  return options;
}

inline nlohmann::json Json(const fs::path& path) { return nlohmann::json::parse(TextOf(path)); }

inline std::map<int, Eigen::Vector2d> PosesIn(const fs::path& path) {
  std::ifstream in(path);
  std::map<int, Eigen::Vector2d> poses;
  int id = 0;
  for (double x, y, skip; in >> id >> x >> y >> skip >> skip >> skip >> skip >> skip;) {
    poses[id] = {x, y};
  }
  return poses;
}

}  // namespace seastitch
