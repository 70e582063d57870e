// `cmake --install` on a machine that has Seastitch already.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::string Text(const fs::path& path) {
  std::ifstream file(path);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

TEST(Install, KeepsAnEditedConfigurationAndBringsWhatIsMissing) {
  const TemporaryDir root;
  const fs::path build = BuildDir();
  const fs::path config = root.path() / "etc/seastitch";
  const std::string install =
      "DESTDIR=" + root.path().string() + " cmake --install " + build.string() + " --prefix /usr";

  const CommandResult first = RunCommand(install);
  ASSERT_EQ(first.exit_code, 0) << first.output;
  for (const char* mapper : {"mapper.yaml", "mapper_mems.yaml", "mapper_ins_tactical.yaml"})
    EXPECT_NE(Text(config / mapper).find("survey_dir: /var/lib/seastitch/survey"),
              std::string::npos)
        << mapper;
  EXPECT_EQ(Text(config / "sbg_ecan.dbc"), Text(ConfigFile("sbg_ecan.dbc")));
  EXPECT_TRUE(fs::exists(root.path() / "usr/bin/seastitch-mapper"));

  std::ofstream(config / "vehicle.yaml") << "mine\n";
  fs::remove(config / "optimizer.yaml");
  const CommandResult second = RunCommand(install);
  ASSERT_EQ(second.exit_code, 0) << second.output;
  EXPECT_EQ(Text(config / "vehicle.yaml"), "mine\n");
  EXPECT_NE(second.output.find("Kept: " + (config / "vehicle.yaml").string()), std::string::npos);
  EXPECT_TRUE(fs::exists(config / "optimizer.yaml"));
  EXPECT_EQ(Text(root.path() / "usr/share/seastitch/config/vehicle.yaml"),
            Text(ConfigFile("vehicle.yaml")));
}

}  // namespace
}  // namespace seastitch
