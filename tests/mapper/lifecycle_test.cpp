// A dive to which anything happens: what must hold whatever it is.

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "tests/mapper/random_dive.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

// Each property costs minutes: six cases, of up to eight happenings. RC_PARAMS asks for others.
const int kCases = setenv("RC_PARAMS", "seed=1 max_success=6 max_size=8", 0);

}  // namespace
}  // namespace seastitch

namespace rc {
template <>
struct Arbitrary<seastitch::Happening> {
  static Gen<seastitch::Happening> arbitrary() {
    using seastitch::Happening;
    return gen::build<Happening>(gen::set(&Happening::what, gen::inRange(0, seastitch::kWhats)),
                                 gen::set(&Happening::size, gen::resize(100, gen::inRange(0, 101))),
                                 gen::set(&Happening::sensor, gen::inRange(0, 4)),
                                 gen::set(&Happening::back),
                                 gen::set(&Happening::seed, gen::inRange(0, 1000)));
  }
};
template <>
struct Arbitrary<seastitch::Setting> {
  static Gen<seastitch::Setting> arbitrary() {
    using seastitch::Setting;
    return gen::build<Setting>(
        gen::set(&Setting::imu_every, gen::element(1, 1, 5, 12)),
        gen::set(&Setting::wrong_sensor, gen::inRange(-4, 4)),
        gen::set(&Setting::wrong_s, gen::element(-3600.0, -5.0, 5.0, 20.0, 86'400.0)),
        gen::set(&Setting::speed, gen::element(1.0, 1.0, 10.0, 50.0)),
        gen::set(&Setting::first_fix_off_m, gen::element(0.0, 20.0, 300.0)),
        gen::set(&Setting::seed, gen::inRange(0, 1000)));
  }
};
}  // namespace rc

namespace seastitch {
namespace {

RC_GTEST_PROP(Lifecycle,
              HoldsWhateverHappens,
              (const std::vector<Happening>& happenings, const Setting& setting)) {
  const Dive dive(happenings, setting);
  for (const std::string& what : dive.broken()) RC_LOG() << what << "\n";
  RC_ASSERT(dive.broken().empty());
  const Dive again(happenings, setting);
  RC_ASSERT(again.digest() == dive.digest());
  // The map is about as good as without what happened, or somebody said what did.
  const Dive undisturbed(happenings, setting, Dive::Kind::kUndisturbed);
  const bool is_right = dive.position_rms_m() <= 1.5 * undisturbed.position_rms_m() + 0.1;
  std::printf("%s: %.2f m, undisturbed %.2f m; %zu submaps of %zu\n",
              is_right                ? "right"
              : dive.is_named()       ? "named"
              : dive.is_passed_over() ? "gap"
                                      : "silent",
              dive.position_rms_m(),
              undisturbed.position_rms_m(),
              dive.submaps(),
              undisturbed.submaps());
  std::fflush(stdout);
  RC_ASSERT(is_right || dive.is_named() || dive.is_passed_over());
}

// --- each fault by itself ------------------------------------------------------------------------

// The sensors that a condition blames, by the names of their channels.
std::set<std::string> Blamed(const Condition& condition) {
  using namespace conditions;
  static const std::map<const ConditionKind*, const char*> kBy{{&kNoBottomLock, "DVL"},
                                                               {&kDvlRefused, "DVL"},
                                                               {&kDvlTurned, "DVL"},
                                                               {&kImuTooSlow, "IMU"},
                                                               {&kGyroDoubted, "IMU"},
                                                               {&kAccelerometerDoubted, "IMU"},
                                                               {&kAttitudeRefused, "IMU"},
                                                               {&kAttitudeFrozen, "IMU"},
                                                               {&kAttitudeSilent, "IMU"},
                                                               {&kHeadingStep, "IMU"},
                                                               {&kDepthRefused, "DEPTH"},
                                                               {&kFixesRefused, "POSITION_FIX"},
                                                               {&kFixClock, "POSITION_FIX"},
                                                               {&kPlaceFromOneFix, "POSITION_FIX"},
                                                               {&kPingsRefused, "MBES_PING"}};
  const auto by = kBy.find(condition.kind);
  if (by != kBy.end()) return {by->second};
  std::string text = condition.detail;
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return static_cast<char>(std::toupper(c));
  });
  std::set<std::string> named;
  for (const char* channel : {"IMU", "DVL", "DEPTH", "MBES_PING"})
    if (text.find(channel) != std::string::npos) named.insert(channel);
  if (text.find("FIX") != std::string::npos) named.insert("POSITION_FIX");
  return named;
}

constexpr char kBegin[] = "<!-- begin: made by tests/mapper/lifecycle_test -->\n";
constexpr char kEnd[] = "<!-- end: made by tests/mapper/lifecycle_test -->\n";

// Each fault, to every sensor and both ways: the dive survives it, and no other sensor is blamed.
// The page is written anew with SEASTITCH_WRITE_DOCS=1.
const std::set<std::string> kOfNoSensor{
    "computer's clock steps", "fixes", "foreign graph", "optimizer restarts", "restart"};

TEST(EachFault, IsSurvivedAndBlamedOnNoOtherSensor) {
  std::map<std::string, std::set<std::string>> table;
  for (int what = 0; what < kWhats; ++what) {
    for (const bool back : {false, true}) {
      std::vector<Happening> happenings;
      // A gap in everything also of ten days.
      const int longest = what == static_cast<int>(What::kAllSilent) ? 100 : 45;
      for (int sensor = 0; sensor < 4; ++sensor)
        happenings.push_back({what, sensor % 2 == 0 ? 45 : longest, sensor, back, sensor});
      const Dive dive(happenings);
      for (const std::string& broken : dive.broken())
        ADD_FAILURE() << kNames[static_cast<std::size_t>(what)] << ": " << broken;
      std::set<std::string> always;
      for (const Condition& condition : dive.seen().at("start"))
        always.insert(condition.kind->name);
      for (const auto& [fault, seen] : dive.seen()) {
        if (fault == "start") continue;
        std::set<std::string>& row = table[fault];
        const std::size_t colon = fault.find(": ");
        for (const Condition& condition : seen) {
          if (always.contains(condition.kind->name)) continue;
          row.insert(condition.kind->name);
          if (colon == std::string::npos && !kOfNoSensor.contains(fault)) continue;
          for (const std::string& sensor : Blamed(condition))
            EXPECT_EQ(sensor, colon == std::string::npos ? "" : fault.substr(colon + 2))
                << fault << ": " << condition.kind->name << ": " << condition.detail;
        }
      }
    }
  }
  std::string text = "| what happens | faults in HEALTH |\n|---|---|\n";
  for (const auto& [fault, names] : table) {
    text += "| " + fault + " | ";
    for (const std::string& name : names)
      text += (name == *names.begin() ? "`" : ", `") + name + "`";
    text += names.empty() ? "none |\n" : " |\n";
  }
  const std::filesystem::path page = SourceDir() / "docs/health.md";
  std::string all = ReadWholeFile(page).value();
  const std::size_t begin = all.find(kBegin), end = all.find(kEnd);
  ASSERT_TRUE(begin != std::string::npos && end != std::string::npos) << page;
  const std::size_t from = begin + sizeof kBegin - 1;
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr) {
    all.replace(from, end - from, text);
    std::ofstream(page) << all;
  } else {
    EXPECT_EQ(all.substr(from, end - from), text) << page;
  }
}

}  // namespace
}  // namespace seastitch
