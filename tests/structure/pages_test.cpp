// The pages: every link from one to another, or to a file of the tree, leads somewhere.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> Pages() {
  std::vector<fs::path> pages{SourceDir() / "README.md", SourceDir() / "CONTRIBUTING.md"};
  for (const auto& entry : fs::recursive_directory_iterator(SourceDir() / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  return pages;
}

// Targets of `[text](target)` and `![text](target)` without an anchor; none of other sites.
std::vector<std::string> Links(const fs::path& page) {
  const std::string text = TextOf(page);
  static const std::regex link(R"re(\]\(([^)#\s]+)[^)]*\))re");
  std::vector<std::string> targets;
  for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
    const std::string target = (*it)[1];
    if (target.find("://") == std::string::npos) targets.push_back(target);
  }
  return targets;
}

TEST(Pages, EveryLinkLeadsToAFile) {
  int links = 0;
  for (const fs::path& page : Pages()) {
    for (const std::string& target : Links(page)) {
      ++links;
      EXPECT_TRUE(fs::exists(page.parent_path() / target))
          << fs::relative(page, SourceDir()) << " links to " << target;
    }
  }
  EXPECT_GT(links, 50);
}

}  // namespace
}  // namespace seastitch
