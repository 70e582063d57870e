// docs/tutorial.md shows what the programs print, and README.md states the demo's figures. To write
// that part of the tutorial anew:
//   SEASTITCH_WRITE_DOCS=1 build/tests/seastitch_command_test --gtest_filter='Pages.*'

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

constexpr char kFence[] = "```\n";

// The demo survey, as a log and as a file of a sonar.
class Pages : public ::testing::Test {
 protected:
  static const std::filesystem::path& Folder() {
    static const TemporaryDir dir;
    static const auto made =
        RunCommand("cd " + dir.path().string() + " && " + Program("seastitch") +
                   " bench --log survey.lcmlog --survey-file survey.kmall");
    EXPECT_EQ(made.exit_code, 0) << made.output;
    return dir.path();
  }
  // What is printed, without the progress.
  static std::string Replay(const std::string& arguments) {
    const auto mapped = RunCommand("(cd " + Folder().string() + " && " + Program("seastitch") +
                                   " replay " + arguments + " 2>/dev/null)");
    EXPECT_EQ(mapped.exit_code, 0) << mapped.output;
    return mapped.output;
  }
};

TEST_F(Pages, ReadmeStatesTheFiguresOfTheDemo) {
  Replay("survey.lcmlog --out demo");
  const auto report = nlohmann::json::parse(TextOf(Folder() / "demo/report.json"));
  const auto figure = [&](const char* key, const char* when, double factor, const char* format) {
    char text[40];
    std::snprintf(text, sizeof text, format, factor * double(report[key][when]));
    return std::string(text);
  };
  std::string page = TextOf(SourceDir() / "README.md");
  std::replace(page.begin(), page.end(), '\n', ' ');
  for (const std::string& stated :
       {"position error falls from " + figure("position_rms_m", "before", 1.0, "%.2f m to ") +
            figure("position_rms_m", "after", 1.0, "%.2f m"),
        "swaths from " + figure("surface_rms_m", "before", 100.0, "%.1f cm to ") +
            figure("surface_rms_m", "after", 100.0, "%.1f cm")})
    EXPECT_NE(page.find(stated), std::string::npos) << stated;
}

TEST_F(Pages, TutorialShowsTheResultOfItsOwnCommands) {
  const std::string printed = Replay("survey.kmall --out map");
  const auto page = SourceDir() / "docs/tutorial.md";
  std::string text = TextOf(page);
  for (const char* command : {"bench --log survey.lcmlog --survey-file survey.kmall\n",
                              "replay survey.kmall --out map\n"})
    EXPECT_NE(text.find(command), std::string::npos) << command;
  const std::size_t end = text.find("map and report in map\n");
  ASSERT_NE(end, std::string::npos);
  const std::size_t from = text.rfind(kFence, end) + sizeof kFence - 1;
  const std::size_t to = text.find(kFence, end);
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr) {
    text.replace(from, to - from, printed);
    std::ofstream(page) << text;
    return;
  }
  EXPECT_EQ(text.substr(from, to - from), printed);
}

}  // namespace
}  // namespace seastitch
