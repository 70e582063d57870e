// What people type by mistake, and the line that they get.

#include <gmock/gmock.h>
#include <sysexits.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/command_line.hpp"

namespace seastitch {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Mistake {
  std::string name;
  std::string arguments;  // EMPTY: an empty folder
  std::string said;
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.arguments; }

class CommandLine : public ::testing::TestWithParam<Mistake> {};

TEST_P(CommandLine, SaysInOneLineWhatWasExpected) {
  const TemporaryDir empty;
  std::string arguments = GetParam().arguments;
  if (const std::size_t at = arguments.find("EMPTY"); at != std::string::npos)
    arguments.replace(at, 5, empty.path().string());
  const auto run = RunCommand(Program("seastitch") + " " + arguments);
  EXPECT_EQ(run.exit_code, EX_USAGE) << run.output;
  EXPECT_THAT(run.output, StartsWith("seastitch: "));
  EXPECT_THAT(run.output, HasSubstr(GetParam().said));
  EXPECT_EQ(std::count(run.output.begin(), run.output.end(), '\n'), 1) << run.output;
}

INSTANTIATE_TEST_SUITE_P(
    Mistakes,
    CommandLine,
    ::testing::Values(
        Mistake{"Command", "repaly a.lcmlog", "did you mean 'replay'?"},
        Mistake{"Option", "replay a.lcmlog --ouput map", "did you mean '--out'?"},
        Mistake{"Argument", "status now", "'now' is no argument of status"},
        Mistake{"NoSubcommand", "dive", "expected one of: new"},
        Mistake{"Subcommand", "dive list", "dive: expected one of: new"},
        Mistake{"HalfADatum", "replay a.lcmlog --out map --datum 43.07", "--datum 43.07,-70.71"},
        Mistake{"DatumOffTheEarth", "replay a --out map --datum -170.71,43.07", "--datum 43.07,"},
        Mistake{"Format", "replay a.lcmlog --out map --soundings laz", "expected las or xyz"},
        Mistake{"Cell", "replay a.lcmlog --out map --cell 0", "--cell: '0': expected a number ab"},
        Mistake{"Drift", "replay a --out map --drift-xy-m -5", "expected a number above 0"},
        Mistake{"Second", "bench --from -1", "expected a number that is at least 0"},
        Mistake{"FolderToImport", "import EMPTY --log x.lcmlog", "is a folder: name its files"},
        Mistake{"EmptyFolder", "info EMPTY", "a folder without a map, a dive or survey files"}),
    [](const auto& mistake) { return mistake.param.name; });

// A new computer without a network.
TEST(NoMulticastRoute, IsNamedOnceWithTheCommandThatMakesIt) {
  const std::string alone = "unshare --map-root-user --net ";
  if (RunCommand(alone + "true").exit_code != 0) GTEST_SKIP() << "needs a network namespace";
  const auto run = RunCommand(alone + Program("seastitch") + " status --once");
  EXPECT_EQ(run.exit_code, EXIT_FAILURE);
  EXPECT_THAT(run.output, StartsWith("seastitch: cannot open LCM bus udpm://"));
  EXPECT_THAT(run.output, HasSubstr("ip route add 224.0.0.0/4 dev lo"));
  EXPECT_EQ(std::count(run.output.begin(), run.output.end(), '\n'), 1) << run.output;
}

TEST(ParseDatum, TakesACommaASpaceOrTwoWords) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"43.07,-70.71"},
                                                {"43.07 -70.71"},
                                                {"43.07", "-70.71"},
                                                {"43.07,", "-70.71"}}) {
    const Datum datum = ParseDatum(words);
    EXPECT_EQ(datum.latitude_deg, 43.07);
    EXPECT_EQ(datum.longitude_deg, -70.71);
  }
}

}  // namespace
}  // namespace seastitch
