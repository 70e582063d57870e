// docs/tutorial.md shows what the programs print. To write that part anew:
//   SEASTITCH_WRITE_DOCS=1 build/tests/seastitch_command_test --gtest_filter='Tutorial.*'

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

constexpr char kFence[] = "```\n";

TEST(Tutorial, ShowsTheResultOfItsOwnCommands) {
  const TemporaryDir dir;
  const std::string there = "cd " + dir.path().string() + " && " + Program("seastitch") + " ";
  const auto made = RunCommand(there + "bench --log survey.lcmlog --survey-file survey.kmall");
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const auto mapped = RunCommand("(" + there + "replay survey.kmall --out map 2>/dev/null)");
  ASSERT_EQ(mapped.exit_code, 0) << mapped.output;

  const auto page = SourceDir() / "docs/tutorial.md";
  std::ostringstream read;
  read << std::ifstream(page).rdbuf();
  std::string text = read.str();
  for (const char* command : {"bench --log survey.lcmlog --survey-file survey.kmall\n",
                              "replay survey.kmall --out map\n"})
    EXPECT_NE(text.find(command), std::string::npos) << command;
  const std::size_t end = text.find("map and report in map\n");
  ASSERT_NE(end, std::string::npos);
  const std::size_t from = text.rfind(kFence, end) + sizeof kFence - 1;
  const std::size_t to = text.find(kFence, end);
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr) {
    text.replace(from, to - from, mapped.output);
    std::ofstream(page) << text;
    return;
  }
  EXPECT_EQ(text.substr(from, to - from), mapped.output);
}

}  // namespace
}  // namespace seastitch
