#include "common/runtime/process/process.hpp"
#include "common/runtime/config/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sysexits.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace seastitch {
namespace {

struct Outcome {
  int code = 0;
  std::string out;
  std::string err;
};

Outcome Start(std::vector<std::string> args, const std::function<int(const ProcessArgs&)>& body) {
  args.insert(args.begin(), "seastitch-x");
  std::vector<char*> argv;
  for (std::string& arg : args) argv.push_back(arg.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.code =
      RunProcess(static_cast<int>(argv.size()), argv.data(), "seastitch-x", "Does x.", body);
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

int MustNotRun(const ProcessArgs&) {
  ADD_FAILURE() << "the body ran";
  return EXIT_SUCCESS;
}

TEST(RunProcess, HandsOverTheArguments) {
  const Outcome outcome =
      Start({"--config", "c.yaml", "--lcm-url", "memq://"}, [](const ProcessArgs& args) {
        EXPECT_EQ(args.config, "c.yaml");
        EXPECT_EQ(args.lcm_url, "memq://");
        EXPECT_FALSE(args.check_config);
        return 3;
      });
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out + outcome.err, "");
}

TEST(RunProcess, SaysThatAConfigurationCanBeUsed) {
  const Outcome outcome = Start(
      {"--config", "c.yaml", "--check-config"},
      [](const ProcessArgs& args) { return args.check_config ? EXIT_SUCCESS : EXIT_FAILURE; });
  EXPECT_EQ(outcome.code, EXIT_SUCCESS);
  EXPECT_EQ(outcome.out, "seastitch-x: c.yaml can be used\n");
}

TEST(RunProcess, TurnsAnExceptionIntoOneLine) {
  const Outcome outcome = Start({"--config", "c.yaml"}, [](const ProcessArgs&) -> int {
    throw std::runtime_error("c.yaml: a: unknown key\nof two lines");
  });
  EXPECT_EQ(outcome.code, EXIT_FAILURE);
  EXPECT_EQ(outcome.err, "seastitch-x: c.yaml: a: unknown key of two lines\n");
}

TEST(RunProcess, TellsAConfigurationErrorFromOthersByItsExitStatus) {
  const Outcome outcome = Start({"--config", "c.yaml"}, [](const ProcessArgs&) -> int {
    throw ConfigError("c.yaml: a: unknown key");
  });
  EXPECT_EQ(outcome.code, EX_CONFIG);
  EXPECT_EQ(outcome.err, "seastitch-x: c.yaml: a: unknown key\n");
}

TEST(RunProcess, RefusesAWrongCommandLineWithOneLine) {
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{}, {"--config"}, {"--config", "c", "--colour"}}) {
    const Outcome outcome = Start(args, MustNotRun);
    EXPECT_EQ(outcome.code, EX_USAGE);
    EXPECT_THAT(outcome.err, testing::StartsWith("seastitch-x: "));
    EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1);
  }
}

TEST(RunProcess, TellsVersionAndHelp) {
  const Outcome version = Start({"--version"}, MustNotRun);
  EXPECT_EQ(version.code, EXIT_SUCCESS);
  EXPECT_THAT(version.out, testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+\n"));
  const Outcome help = Start({"--help"}, MustNotRun);
  EXPECT_EQ(help.code, EXIT_SUCCESS);
  EXPECT_THAT(help.out, testing::HasSubstr("--check-config"));
}

}  // namespace
}  // namespace seastitch
