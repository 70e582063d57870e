// docs/commands.md lists every option that the programs print with --help. To write it anew:
//   SEASTITCH_WRITE_DOCS=1 build/tests/commands_page_test

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"

namespace seastitch {
namespace {

constexpr char kBegin[] = "<!-- begin: made from the programs' --help -->\n";
constexpr char kEnd[] = "<!-- end -->\n";
constexpr std::size_t kNameWidth = 30;  // column of --help at which meanings begin

struct Argument {
  std::string name;  // with type, default and needs, as printed
  std::string meaning;
};

struct Help {
  std::string description;
  std::string usage;
  std::vector<Argument> arguments;
  std::vector<Argument> subcommands;
  std::string example;
};

std::string Trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? ""
                                    : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// Appends the line of an argument. A long name has its meaning in the next line.
void AddLine(const std::string& line, std::vector<Argument>* list) {
  if (line.starts_with(std::string(kNameWidth, ' '))) {
    list->back().meaning = Trimmed(line);
    return;
  }
  const bool has_both = line.size() > kNameWidth && line[kNameWidth - 1] == ' ';
  list->push_back({Trimmed(has_both ? line.substr(0, kNameWidth) : line),
                   has_both ? Trimmed(line.substr(kNameWidth)) : ""});
}

Help Parse(const std::string& text) {
  Help help;
  std::istringstream lines(text);
  std::getline(lines, help.description);
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("Usage: ")) help.usage = line.substr(7);
    if (line.empty() || line[0] != ' ') {
      section = line;
    } else if (section == "Positionals:" || section == "Options:") {
      AddLine(line, &help.arguments);
    } else if (section == "Subcommands:") {
      AddLine(line, &help.subcommands);
    } else if (section == "Example:") {
      help.example = Trimmed(line);
    }
  }
  return help;
}

Help HelpOf(const std::string& program, const std::string& arguments) {
  const CommandResult result = RunCommand(Program(program) + " " + arguments);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  return Parse(result.output);
}

std::string Matched(const std::string& text, const std::string& pattern) {
  std::smatch match;
  return std::regex_search(text, match, std::regex(pattern)) ? match[1].str() : "";
}

std::string Quoted(const std::string& names) {
  return std::regex_replace(names, std::regex("(\\S+)"), "`$1`");
}

// "--speed FLOAT:POSITIVE=1 Excludes: --log" to "`--speed` (1)", with the excluded options in
// brackets. Types are left out: the meaning has them.
std::string NameText(const std::string& name) {
  const std::string value = Matched(name, "^\\S+ [^ ]*?=(\\S+)");
  const std::string choices = Matched(name, "ENUM:(\\S+ or \\S+)");
  const std::string excludes = Matched(name, "Excludes: (.*)$");
  const std::string needs = Matched(name, "Needs: (.*)$");
  std::string text = "`" + name.substr(0, name.find(' ')) + "`";
  if (name.find(" ...") != std::string::npos) text += " ...";
  if (name.find(" REQUIRED") != std::string::npos) text += ", required";
  if (!choices.empty()) text += " " + choices;
  if (!value.empty()) text += ", default `" + value + "`";
  if (!excludes.empty()) text += ", not with " + Quoted(excludes);
  if (!needs.empty()) text += ", only with " + Quoted(needs);
  return text;
}

std::string TableOf(const std::vector<Argument>& arguments) {
  std::string table;
  for (const Argument& argument : arguments) {
    if (argument.name.starts_with("-h,") || argument.name == "--version") continue;
    table += "| " + NameText(argument.name) + " | " + argument.meaning + " |\n";
  }
  return table.empty() ? table : "\n| argument | meaning |\n|---|---|\n" + table;
}

std::string SectionOf(const std::string& command, const Help& help) {
  std::string description = help.description;
  description[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(description[0])));
  std::string section = "\n### seastitch " + command + "\n\n" + description + ".\n";
  if (!help.example.empty()) section += "\n    " + help.example + "\n";
  return section + TableOf(help.arguments);
}

std::string SectionsOfSeastitch() {
  std::string sections = "\n## The command `seastitch`\n";
  const Help all = HelpOf("seastitch", "--help");
  EXPECT_GE(all.subcommands.size(), 10u);
  for (const Argument& command : all.subcommands) {
    const Help help = HelpOf("seastitch", "help " + command.name);
    sections += SectionOf(command.name, help);
    for (const Argument& inner : help.subcommands) {
      Help of_inner = HelpOf("seastitch", command.name + " " + inner.name + " --help");
      of_inner.example.clear();
      sections += SectionOf(command.name + " " + inner.name, of_inner);
    }
  }
  return sections;
}

// The processes have the same options: one table for all.
std::string SectionOfProcesses() {
  std::string section = "\n## The processes\n\n| program | task |\n|---|---|\n";
  std::string options;
  for (const char* name : {"imu-driver",
                           "dvl-driver",
                           "mbes-driver",
                           "nav-driver",
                           "nav-output",
                           "mapper",
                           "optimizer",
                           "logger",
                           "page"}) {
    const std::string program = std::string("seastitch-") + name;
    const Help help = HelpOf(program, "--help");
    std::string task = help.description;
    if (task.ends_with('.')) task.pop_back();
    section += "| `" + program + "` | " + task + " |\n";
    const std::string table = TableOf(help.arguments);
    if (options.empty()) options = table;
    EXPECT_EQ(table, options) << program;
  }
  return section + options;
}

TEST(CommandsPage, ListsEveryOptionThatTheProgramsPrint) {
  const std::filesystem::path page = SourceDir() / "docs/commands.md";
  std::string text = TextOf(page);
  const std::size_t begin = text.find(kBegin);
  const std::size_t end = text.find(kEnd);
  ASSERT_NE(begin, std::string::npos) << page;
  ASSERT_NE(end, std::string::npos) << page;
  const std::size_t from = begin + sizeof kBegin - 1;
  const std::string sections = SectionOfProcesses() + SectionsOfSeastitch() + "\n";
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr) {
    text.replace(from, end - from, sections);
    std::ofstream(page) << text;
  } else {
    EXPECT_EQ(text.substr(from, end - from), sections) << page << ": see the head of this test";
  }
}

TEST(CommandsPage, ReadsALineOfHelp) {
  const Help help = Parse(
      "simulates\n"
      "Usage: seastitch bench [OPTIONS] file...\n"
      "\n"
      "Positionals:\n"
      "  file TEXT:FILE ... REQUIRED LCM logs\n"
      "\n"
      "Options:\n"
      "  --speed FLOAT:POSITIVE=1 Excludes: --log --out\n"
      "                              seconds per second\n"
      "  --quiet                     no progress\n"
      "\n"
      "Example:\n"
      "  seastitch bench --speed 2\n");
  EXPECT_EQ(TableOf(help.arguments),
            "\n| argument | meaning |\n|---|---|\n"
            "| `file` ..., required | LCM logs |\n"
            "| `--speed`, default `1`, not with `--log` `--out` | seconds per second |\n"
            "| `--quiet` | no progress |\n");
  EXPECT_EQ(help.example, "seastitch bench --speed 2");
}

}  // namespace
}  // namespace seastitch
