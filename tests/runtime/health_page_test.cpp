// docs/health.md lists every fault of common/core/health/conditions.hpp. To write it anew:
//   SEASTITCH_WRITE_DOCS=1 build/tests/runtime_test --gtest_filter='HealthPage.*'

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "common/core/health/conditions.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

constexpr char kBegin[] = "<!-- begin: made from common/core/health/conditions.hpp -->\n";
constexpr char kEnd[] = "<!-- end -->\n";

std::string StateOf(const ConditionKind& kind) {
  const auto [holds_s, fewest, within_s] = kind.events;
  const std::string state = kind.severity == Severity::kLost ? "lost" : "degraded";
  if (holds_s == 0.0) return state;
  const auto seconds = [](double s) { return std::to_string(std::lround(s)) + " s"; };
  return state + (fewest == 1 ? ", for " + seconds(holds_s)
                              : ", while " + std::to_string(fewest) + " in " + seconds(within_s));
}

std::string Table() {
  std::string table =
      "| sentence | name | state | what to do |\n"
      "|---|---|---|---|\n";
  for (const ConditionKind* kind : conditions::kAll)
    table += std::string("| ") + kind->sentence + " | `" + kind->name + "` | " + StateOf(*kind) +
             " | " + kind->remedy + " |\n";
  return table;
}

TEST(HealthPage, ListsEveryFaultWithWhatToDo) {
  const std::filesystem::path page = SourceDir() / "docs/health.md";
  std::string text = TextOf(page);
  const std::size_t begin = text.find(kBegin);
  const std::size_t end = text.find(kEnd);
  ASSERT_NE(begin, std::string::npos) << page;
  ASSERT_NE(end, std::string::npos) << page;
  const std::size_t table = begin + sizeof kBegin - 1;
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr) {
    text.replace(table, end - table, Table());
    std::ofstream(page) << text;
  } else {
    EXPECT_EQ(text.substr(table, end - table), Table()) << page << ": see the head of this test";
  }
}

TEST(Conditions, AreAllInTheTable) {
  const std::string header = TextOf(SourceDir() / "common/core/health/conditions.hpp");
  const std::regex kind("constexpr ConditionKind (k\\w+)\\{");
  std::set<std::string> declared;
  for (std::sregex_iterator it(header.begin(), header.end(), kind), none; it != none; ++it)
    declared.insert((*it)[1]);
  EXPECT_EQ(declared.size(), std::size(conditions::kAll));
  for (const std::string& name : declared)
    EXPECT_NE(header.find("&" + name + ","), std::string::npos) << name << " is not in kAll";
}

TEST(Conditions, HaveUniqueNamesAndOneLineEach) {
  const std::regex name("[a-z0-9]+(_[a-z0-9]+)*");
  std::set<std::string> names;
  for (const ConditionKind* kind : conditions::kAll) {
    EXPECT_TRUE(std::regex_match(kind->name, name)) << kind->name;
    EXPECT_TRUE(names.insert(kind->name).second) << kind->name << " stands twice";
    const std::string sentence = kind->sentence;
    const std::string remedy = kind->remedy;
    EXPECT_FALSE(sentence.empty() || sentence.ends_with('.')) << kind->name;
    EXPECT_TRUE(remedy.ends_with('.')) << kind->name;
    EXPECT_EQ((sentence + remedy).find_first_of("\n|"), std::string::npos) << kind->name;
  }
}

}  // namespace
}  // namespace seastitch
