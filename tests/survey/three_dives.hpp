#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/survey/files/kmall_pieces.hpp"
#include "tests/survey/short_survey.hpp"

namespace seastitch::testing {

// Three lines of 60 m of a vehicle whose INS navigates, in a folder: l.lcmlog, whole.kmall, and
// that file cut into the folders dive1, dive2 and dive3.
inline void MakeThreeDives(const std::filesystem::path& dir) {
  std::ofstream(dir / "survey.yaml")
      << std::regex_replace(ShortSurveyUnderWater(), std::regex("mems"), "ins_tactical");
  const auto bench = RunCommand(
      Program("seastitch") + " bench --survey " + (dir / "survey.yaml").string() + " --log " +
      (dir / "l.lcmlog").string() + " --survey-file " + (dir / "whole.kmall").string());
  EXPECT_EQ(bench.exit_code, 0) << bench.output;
  CutKmall(dir / "whole.kmall", 3, dir, "dive");
}

}  // namespace seastitch::testing
