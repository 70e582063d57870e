#pragma once

#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/paths.hpp"

namespace seastitch {

// Text of config/bench/short.yaml without the time at the surface and its fixes.
inline std::string ShortSurveyUnderWater() {
  std::ifstream in(ConfigFile("bench/short.yaml"));
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return std::regex_replace(text, std::regex("\n *(surface_s|position_fixes):[^\n]*"), "");
}

}  // namespace seastitch
