// docs/design.md, section 2: which folder may know which. Holds it against every #include.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace seastitch {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kMayInclude{
    {"common/core", {"common/core"}},
    {"common/convert", {"common/core", "common/convert", "seastitch"}},
    {"common/storage", {"common/core", "common/storage"}},
    {"common/runtime", {"common/core", "common/runtime", "seastitch"}},
    {"drivers", {"common", "drivers", "seastitch"}},
    {"mapper", {"common", "mapper", "seastitch"}},
    {"optimizer", {"common", "optimizer", "seastitch"}},
    {"logger", {"common", "logger", "seastitch"}},
    {"products", {"common", "products", "seastitch"}},
    {"bench", {"common", "bench", "drivers", "seastitch"}},
};

// The pure parts of the processes: no messages, no process shell, no files.
const std::set<std::string> kPure{
    "mapper/navigation", "mapper/geometry", "mapper/registration", "drivers/can", "common/core"};

bool IsUnder(const std::string& path, const std::string& folder) {
  return path.rfind(folder + "/", 0) == 0;
}

std::vector<fs::path> Sources(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp") {
      files.push_back(entry.path());
    }
  }
  return files;
}

std::vector<std::string> ProjectIncludes(const fs::path& file) {
  static const std::regex include(R"re(^\s*#include "([^"]+)")re");
  std::vector<std::string> included;
  std::ifstream in(file);
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, include)) included.push_back(match[1]);
  }
  return included;
}

TEST(Includes, StayWithinWhatEachFolderMayKnow) {
  const fs::path root = SEASTITCH_SOURCE_DIR;
  for (const auto& [folder, allowed] : kMayInclude) {
    const std::vector<fs::path> files = Sources(root / folder);
    EXPECT_FALSE(files.empty()) << folder;
    for (const fs::path& file : files) {
      for (const std::string& include : ProjectIncludes(file)) {
        const bool ok = std::any_of(allowed.begin(), allowed.end(), [&](const std::string& a) {
          return IsUnder(include, a);
        });
        EXPECT_TRUE(ok) << fs::relative(file, root) << " includes " << include;
      }
    }
  }
}

TEST(Includes, PurePartsKnowNoMessageAndNoProcess) {
  const fs::path root = SEASTITCH_SOURCE_DIR;
  for (const std::string& folder : kPure) {
    for (const fs::path& file : Sources(root / folder)) {
      // The one place in each where a file or a node is allowed has it in its name.
      const std::string name = file.stem().string();
      if (name.ends_with("_driver") || name.ends_with("_config") || name == "signal_map") continue;
      for (const std::string& include : ProjectIncludes(file)) {
        EXPECT_FALSE(IsUnder(include, "common/runtime") || IsUnder(include, "common/storage") ||
                     IsUnder(include, "seastitch"))
            << fs::relative(file, root) << " includes " << include;
      }
    }
  }
}

}  // namespace
}  // namespace seastitch
