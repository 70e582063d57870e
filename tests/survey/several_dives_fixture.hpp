#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <variant>

#include "mapper/mapper_config.hpp"
#include "products/product_files.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/survey_stream.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/kmall_pieces.hpp"
#include "tests/survey/short_survey.hpp"
#include "tests/survey/three_dives.hpp"
#include "tools/survey_writer.hpp"

// Two small dives that overlap, and their replay as one map.
namespace seastitch {

// The survey begins at the datum and without a fix.
inline MapperConfig InsAtDatum(const std::filesystem::path& file) {
  MapperConfig config = LoadMapperConfig(file.string());
  config.navigation.start_at_first_fix = false;
  return config;
}

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Three lines of 60 m as the .kmall of a vehicle whose INS navigates.
class SeveralDives : public ::testing::Test {
 protected:
  static const fs::path& Folder() {
    static const TemporaryDir dir;
    static const bool made = [] {
      testing::MakeThreeDives(dir.path());
      return true;
    }();
    EXPECT_TRUE(made);
    return dir.path();
  }

  CommandResult Replay(const std::string& inputs, const std::string& more = "") {
    return RunCommand("cd " + Folder().string() + " && " + Program("seastitch") +
                      " replay --quiet " + inputs + " --out " + (out_.path() / "map").string() +
                      " --truth " + (Folder() / "l.lcmlog.truth.csv").string() + " " + more);
  }
  nlohmann::json Report() const {
    return nlohmann::json::parse(TextOf(out_.path() / "map/report.json"));
  }

  double DepthOfFirstSubmap() const {
    std::istringstream poses(TextOf(out_.path() / "map/poses.txt"));
    double id = 0.0, x = 0.0, y = 0.0, z = 0.0;
    poses >> id >> x >> y >> z;
    return z;
  }

  TemporaryDir out_;
};

}  // namespace seastitch
