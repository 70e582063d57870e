#pragma once

#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {

// Text of config/bench/short.yaml without the time at the surface and its fixes.
inline std::string ShortSurveyUnderWater() {
  const std::string text = TextOf(ConfigFile("bench/short.yaml"));
  return std::regex_replace(text, std::regex("\n *(surface_s|position_fixes):[^\n]*"), "");
}

}  // namespace seastitch
