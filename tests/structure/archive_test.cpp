// Whatever is saved for a restart is saved whole: every member of a type that lists its fields for
// an archive stands in that list, or under "Not saved:" with a reason.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::string WithoutComments(const std::string& text) {
  return std::regex_replace(text, std::regex("//[^\n]*"), "");
}

// The first brace of `text` at or after `at`, to the one that closes it.
std::string Braced(const std::string& text, std::size_t at) {
  const std::size_t begin = text.find('{', at);
  if (begin == std::string::npos) return "";
  int depth = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    depth += (text[i] == '{') - (text[i] == '}');
    if (depth == 0) return text.substr(begin + 1, i - begin - 1);
  }
  return "";
}

// With a semicolon in place of everything in braces.
std::string OwnLevel(const std::string& body) {
  std::string own;
  int depth = 0;
  for (const char c : body) {
    if (c == '{' && depth++ == 0) own += ';';
    if (depth == 0) own += c;
    if (c == '}') --depth;
  }
  return own;
}

// Data members that are neither constant nor pointers: those are given by the constructor.
std::set<std::string> MembersOf(const std::string& body) {
  static const std::regex kNoMember(
      "^\\s*(using|static|friend|template|typedef|enum|struct|class|const|constexpr|explicit)\\b");
  static const std::regex kAccess("(public|private|protected)\\s*:");
  static const std::regex kName("([A-Za-z_]\\w*)\\s*(\\[\\w*\\]\\s*)?$");
  std::set<std::string> members;
  const std::string own = std::regex_replace(OwnLevel(WithoutComments(body)), kAccess, ";");
  std::size_t begin = 0;
  for (std::size_t end; (end = own.find(';', begin)) != std::string::npos; begin = end + 1) {
    std::string statement = own.substr(begin, end - begin);
    if (std::regex_search(statement, kNoMember)) continue;
    statement = statement.substr(0, statement.find('='));
    if (statement.find_first_of("(*&") != std::string::npos) continue;
    while (!statement.empty() && std::isspace(static_cast<unsigned char>(statement.back())))
      statement.pop_back();
    std::smatch name;
    if (statement.find(' ') != std::string::npos && std::regex_search(statement, name, kName))
      members.insert(name[1]);
  }
  return members;
}

std::set<std::string> Words(const std::string& text) {
  static const std::regex kWord("[A-Za-z_]\\w*");
  return {std::sregex_token_iterator(text.begin(), text.end(), kWord), {}};
}

std::vector<std::string> Missing(const std::set<std::string>& members,
                                 const std::set<std::string>& listed) {
  std::vector<std::string> missing;
  std::set_difference(
      members.begin(), members.end(), listed.begin(), listed.end(), std::back_inserter(missing));
  return missing;
}

// By the name of a type: what its list lacks.
using Lacks = std::map<std::string, std::vector<std::string>>;

// Types that list their fields themselves.
Lacks LackOfOwnLists(const std::string& text) {
  static const std::regex kType("(enum )?(struct|class)\\s+([\\w:]+)[^;{()]*\\{");
  Lacks lacks;
  for (std::sregex_iterator it(text.begin(), text.end(), kType), end; it != end; ++it) {
    if ((*it)[1].matched) continue;
    const std::string body = Braced(text, static_cast<std::size_t>(it->position()));
    if (OwnLevel(WithoutComments(body)).find("static void Fields(") == std::string::npos) continue;
    // The list at this level comes after those of types within.
    std::string list;
    int depth = 0;
    for (std::size_t i = 0; i < body.size(); ++i) {
      if (depth == 0 && body.compare(i, 19, "static void Fields(") == 0) list = Braced(body, i);
      depth += (body[i] == '{') - (body[i] == '}');
    }
    std::smatch not_saved;
    if (std::regex_search(body, not_saved, std::regex("Not saved:([^\n]*(\n *//[^\n]*)*)")))
      list += not_saved[1];
    lacks[(*it)[3]] = Missing(MembersOf(body), Words(list));
  }
  return lacks;
}

// Plain structs with a list beside them.
Lacks LackOfListsBeside(const std::string& text, const std::string& all_headers) {
  static const std::regex kList("void Fields\\(Archive& archive, Of<Archive, (\\w+)>&");
  Lacks lacks;
  for (std::sregex_iterator it(text.begin(), text.end(), kList), end; it != end; ++it) {
    const std::string name = (*it)[1];
    std::smatch type;
    const bool found =
        std::regex_search(all_headers, type, std::regex("struct " + name + "( : \\w+)? \\{"));
    if (!found) {
      lacks[name] = {"the struct itself"};
      continue;
    }
    const std::string body = Braced(all_headers, static_cast<std::size_t>(type.position()));
    lacks[name] =
        Missing(MembersOf(body), Words(Braced(text, static_cast<std::size_t>(it->position()))));
  }
  return lacks;
}

TEST(Archive, HoldsEveryMember) {
  std::vector<fs::path> files;
  std::string headers;
  for (const char* folder : {"common", "mapper"}) {
    for (const auto& entry : fs::recursive_directory_iterator(SourceDir() / folder)) {
      const fs::path& file = entry.path();
      if (file.extension() != ".hpp" && file.extension() != ".cpp") continue;
      files.push_back(file);
      if (file.extension() == ".hpp") headers += TextOf(file);
    }
  }
  std::size_t types = 0;
  for (const fs::path& file : files) {
    const std::string text = TextOf(file);
    if (text.find("Fields(Archive&") == std::string::npos) continue;
    Lacks lacks = LackOfOwnLists(text);
    lacks.merge(LackOfListsBeside(text, headers));
    for (const auto& [type, missing] : lacks) {
      ++types;
      for (const std::string& member : missing)
        ADD_FAILURE() << file << ": " << type << "::Fields() lacks " << member;
    }
  }
  EXPECT_GE(types, 25U);
}

TEST(Archive, SeesWhatAListLacks) {
  const std::string text = R"(
class Outer {
 public:
  explicit Outer(int a) : limit_(a) {}
  // Not saved: counters_, which are
  // of one process; cache_.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.kept_, self.list_);
  }
  bool IsFull() const { return kept_ > limit_; }

 private:
  struct Inner {
    double a = 0.0;
    std::optional<Time> b{};
    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.a);
    }
  };
  static constexpr int kMost = 3;
  void Do(int n);
  const int limit_;
  int* const where_ = nullptr;
  int kept_ = 0;
  std::array<Inner, kMost> list_{};
  std::map<std::string, std::int64_t> counters_;
  int cache_ = 0;
  std::vector<Inner> forgotten_;  // of the last second
  double also_[3] = {};
};
)";
  const Lacks lacks = LackOfOwnLists(text);
  ASSERT_EQ(lacks.size(), 2U);
  EXPECT_EQ(lacks.at("Outer"), (std::vector<std::string>{"also_", "forgotten_"}));
  EXPECT_EQ(lacks.at("Inner"), std::vector<std::string>{"b"});

  const std::string list = R"(
template <class Archive>
void Fields(Archive& archive, Of<Archive, Pose>& pose) {
  archive(pose.x);
}
)";
  EXPECT_EQ(LackOfListsBeside(list, "struct Pose {\n  double x = 0.0;\n  double y = 0.0;\n};\n"),
            (Lacks{{"Pose", {"y"}}}));
}

}  // namespace
}  // namespace seastitch
