#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/vehicle/bus_checks.hpp"
#include "tools/vehicle/doctor.hpp"
#include "tools/vehicle/machine_checks.hpp"
#include "tools/vehicle/setup.hpp"

// A machine as `seastitch doctor` sees it: files under a root of their own.
namespace seastitch {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;
using Words = std::vector<std::string>;

// "LEVEL TEXT" of each.
inline std::vector<std::string> Lines(const Findings& findings) {
  std::vector<std::string> lines;
  for (const Finding& finding : findings) {
    constexpr const char* kLevels[] = {"ok ", "warning ", "error "};
    lines.push_back(kLevels[static_cast<int>(finding.level)] + finding.text);
    EXPECT_EQ(finding.remedy.empty(), finding.level == Finding::Level::kOk) << finding.text;
  }
  return lines;
}

}  // namespace seastitch
