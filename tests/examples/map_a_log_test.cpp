// The example that embeds a Mapper, run on a short simulated survey.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

TEST(MapALog, MapsASurvey) {
  const TemporaryDir dir;
  const std::string log = (dir.path() / "short.lcmlog").string();
  const CommandResult made = RunCommand(Program("seastitch") + " bench --survey " +
                                        ConfigFile("bench/short.yaml") + " --log " + log);
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const CommandResult mapped =
      RunCommand(Program("map_a_log") + " " + log + " " + ConfigFile("mapper_mems.yaml"));
  EXPECT_EQ(mapped.exit_code, 0) << mapped.output;
  EXPECT_EQ(mapped.output.rfind("version 1: ", 0), 0u) << mapped.output;
  EXPECT_NE(mapped.output.find(" loop closures accepted"), std::string::npos) << mapped.output;
  EXPECT_EQ(mapped.output.find("\n0 submaps"), std::string::npos) << mapped.output;
  EXPECT_EQ(mapped.output.find(" 0 loop closures"), std::string::npos) << mapped.output;
}

TEST(MapALog, SaysInOneLineWhatItCannotRead) {
  const TemporaryDir dir;
  const std::string log = (dir.path() / "none.lcmlog").string();
  for (const std::string& arguments : {std::string(), log + " " + ConfigFile("mapper_mems.yaml")}) {
    const CommandResult result = RunCommand(Program("map_a_log") + " " + arguments);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }
}

}  // namespace
}  // namespace seastitch
