// Every parameter of every file, from the outside: a text goes in, a configuration or one line
// comes out.

#include "tools/configuration.hpp"
#include "common/runtime/config/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>

#include "bench/survey_config.hpp"
#include "common/parameters/renamed_keys.hpp"
#include "mapper/mapper_config.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

void Collect(const ParameterTable& table, std::vector<const Parameter*>* parameters) {
  for (const Parameter& parameter : table.parameters()) parameters->push_back(&parameter);
  for (const ParameterTable& section : table.sections()) Collect(section, parameters);
}

std::vector<const Parameter*> AllOf(const ConfigurationFile& file) {
  std::vector<const Parameter*> parameters;
  Collect(file.table, &parameters);
  return parameters;
}

// A file with this value, and with something for the keys that are required.
std::string FileWith(const ConfigurationFile& file,
                     const Parameter& wanted,
                     const std::string& text) {
  YAML::Node root(YAML::NodeType::Map);
  const auto set = [&root](const std::string& path, const std::string& value) {
    const std::size_t dot = path.find('.');
    const std::size_t second = dot == std::string::npos ? dot : path.find('.', dot + 1);
    const YAML::Node node = YAML::Load(value);
    if (dot == std::string::npos)
      root[path] = node;
    else if (second == std::string::npos)
      root[path.substr(0, dot)][path.substr(dot + 1)] = node;
    else
      root[path.substr(0, dot)][path.substr(dot + 1, second - dot - 1)][path.substr(second + 1)] =
          node;
  };
  for (const Parameter* parameter : AllOf(file)) {
    const bool is_number = std::holds_alternative<double*>(parameter->value());
    if (parameter->required()) set(parameter->path(), is_number ? "1" : "something");
    if (parameter->path() == "device" || parameter->path() == "clock")
      set(parameter->path(), parameter->Text());
  }
  set(wanted.path(), text);
  return YAML::Dump(root);
}

// The line that the file stops the program with; empty where it loads.
std::string ErrorOf(const std::string& name, const std::string& text) {
  for (ConfigurationFile& fresh : ConfigurationFiles()) {
    if (fresh.name != name) continue;
    try {
      ParseParameters(text, "test.yaml", fresh.table);
    } catch (const ConfigError& e) {
      return e.what();
    }
  }
  return "";
}

bool IsWhole(const Parameter& p) {
  return std::holds_alternative<int*>(p.value()) ||
         std::holds_alternative<std::int64_t*>(p.value()) ||
         std::holds_alternative<std::uint64_t*>(p.value());
}
bool IsNumber(const Parameter& p) {
  return IsWhole(p) || std::holds_alternative<double*>(p.value());
}
bool IsNumbers(const Parameter& p) {
  return std::holds_alternative<std::span<double>>(p.value()) ||
         std::holds_alternative<std::vector<double>*>(p.value());
}

// As a scalar, or as a list with as many as there must be.
std::string NumberText(const Parameter& p, double value) {
  std::ostringstream text;
  text.precision(17);
  text << value;
  if (!IsNumbers(p)) return text.str();
  std::string list = text.str();
  if (const auto* fixed = std::get_if<std::span<double>>(&p.value()))
    for (std::size_t i = 1; i < fixed->size(); ++i) list += ", " + text.str();
  return "[" + list + "]";
}

// The first value outside of a limit, as far as numbers are that fine.
double JustBelow(const Parameter& p, double limit) {
  if (IsWhole(p)) return limit - 1.0;
  return limit == 0.0 ? -1e-300 : std::nextafter(limit, -1e300);
}
double JustAbove(const Parameter& p, double limit) {
  if (IsWhole(p)) return limit + 1.0;
  return limit == 0.0 ? 1e-300 : std::nextafter(limit, 1e300);
}

std::vector<double> AtLimits(const Parameter& p) {
  const Range& r = p.range();
  std::vector<double> values;
  if (std::isfinite(r.low)) values.push_back(r.low_is_inside ? r.low : JustAbove(p, r.low));
  if (std::isfinite(r.high)) values.push_back(r.high_is_inside ? r.high : JustBelow(p, r.high));
  if (r.zero_is_inside) values.push_back(0.0);
  return values;
}

std::vector<double> BeyondLimits(const Parameter& p, double further) {
  const Range& r = p.range();
  std::vector<double> values;
  if (std::isfinite(r.low)) {
    values.push_back(r.low_is_inside ? JustBelow(p, r.low) : r.low);
    values.push_back(std::floor(r.low - further));
  }
  if (std::isfinite(r.high)) {
    values.push_back(r.high_is_inside ? JustAbove(p, r.high) : r.high);
    values.push_back(std::ceil(r.high + further));
  }
  std::erase_if(values, [&r](double value) { return r.zero_is_inside && value == 0.0; });
  return values;
}

double Inside(const Parameter& p, double part) {
  const double low = std::isfinite(p.range().low) ? p.range().low : -100.0;
  const double high = std::isfinite(p.range().high) ? p.range().high : low + 1000.0;
  const double value = low + (high - low) * (0.01 + 0.98 * part);
  return IsWhole(p) ? std::clamp(std::round(value), low, high) : value;
}

// It loads, or stops for a rule that binds it to another parameter: never for its range.
void ExpectInside(const ConfigurationFile& file, const Parameter& p, double value) {
  const std::string error = ErrorOf(file.name, FileWith(file, p, NumberText(p, value)));
  EXPECT_THAT(error, Not(HasSubstr(p.Expected()))) << file.name << " " << p.path() << " " << value;
  EXPECT_TRUE(error.empty() || error.find("' is not ") != std::string::npos) << error;
}

// One line: file, key, value, what was expected.
void ExpectRefused(const ConfigurationFile& file, const Parameter& p, const std::string& text) {
  const std::string error = ErrorOf(file.name, FileWith(file, p, text));
  EXPECT_THAT(error, testing::StartsWith("test.yaml: " + p.path() + ": "))
      << file.name << " " << text;
  EXPECT_THAT(error, testing::EndsWith(" is not " + p.Expected())) << file.name << " " << text;
  EXPECT_THAT(error, Not(HasSubstr("\n")));
}

TEST(Configuration, EveryParameterLoadsAtItsLimitsAndStopsBeyond) {
  for (const ConfigurationFile& file : ConfigurationFiles()) {
    for (const Parameter* p : AllOf(file)) {
      if (IsNumber(*p) || IsNumbers(*p)) {
        for (const double value : AtLimits(*p)) ExpectInside(file, *p, value);
        for (const double value : BeyondLimits(*p, 1.0))
          ExpectRefused(file, *p, NumberText(*p, value));
        ExpectRefused(file, *p, IsNumbers(*p) ? "[1, wide]" : "wide");
        ExpectRefused(file, *p, "");
        if (!IsWhole(*p)) ExpectRefused(file, *p, IsNumbers(*p) ? "[.nan]" : ".nan");
        if (IsWhole(*p)) ExpectRefused(file, *p, "1.5");
      } else if (std::holds_alternative<bool*>(p->value())) {
        ExpectRefused(file, *p, "2");
      } else if (std::holds_alternative<Choice>(p->value())) {
        ExpectRefused(file, *p, "sundial");
      } else {
        ExpectRefused(file, *p, "[a, b]");
      }
    }
  }
}

RC_GTEST_PROP(Configuration, LoadsEveryValueInsideAndNoneBeyond, ()) {
  const int part = *rc::gen::inRange(0, 1001);
  const double further = *rc::gen::inRange(1, 1'000'000);
  const auto files = ConfigurationFiles();
  const ConfigurationFile& file =
      files[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(files.size())))];
  const auto parameters = AllOf(file);
  const Parameter& p = *parameters[static_cast<std::size_t>(
      *rc::gen::inRange(0, static_cast<int>(parameters.size())))];
  if (!IsNumber(p) && !IsNumbers(p)) return;
  ExpectInside(file, p, Inside(p, part / 1000.0));
  for (const double value : BeyondLimits(p, further)) ExpectRefused(file, p, NumberText(p, value));
  RC_ASSERT(!testing::Test::HasFailure());
}

// What a configuration prints is read as the same configuration.
RC_GTEST_PROP(Configuration, PrintedOneIsReadAsTheSame, ()) {
  const int part = *rc::gen::inRange(0, 1001);
  auto files = ConfigurationFiles();
  auto again = ConfigurationFiles();
  for (std::size_t i = 0; i < files.size(); ++i) {
    for (const Parameter* p : AllOf(files[i])) {
      if (p->required() && p->IsUnset()) RC_ASSERT(SetParameter(*p, YAML::Load("'some: #thing'")));
      // Together all of them would break the rules between them; a few are changed.
      if ((IsNumber(*p) || IsNumbers(*p)) && *rc::gen::inRange(0, 25) == 0) {
        const std::string before = p->Text();
        RC_ASSERT(SetParameter(*p, YAML::Load(NumberText(*p, Inside(*p, part / 1000.0)))));
        auto fresh = ConfigurationFiles();
        try {
          ParseParameters(
              PrintParameters(files[i].table, again[i].table), "test.yaml", fresh[i].table);
        } catch (const ConfigError&) {
          RC_ASSERT(SetParameter(*p, YAML::Load(before)));
        }
      }
    }
    const std::string printed = PrintParameters(files[i].table, again[i].table);
    ParseParameters(printed, "test.yaml", again[i].table);
    const auto given = AllOf(files[i]);
    const auto read = AllOf(again[i]);
    for (std::size_t k = 0; k < given.size(); ++k) RC_ASSERT(given[k]->Text() == read[k]->Text());
  }
}

TEST(Configuration, NegativeZeroIsPrintedAsZero) {
  auto files = ConfigurationFiles();
  for (const Parameter* p : AllOf(files[0]))
    if (p->key() == "sonar_time_offset_s") {
      ASSERT_TRUE(SetParameter(*p, YAML::Load("-0.0")));
      EXPECT_EQ(p->Text(), "0");
      return;
    }
  FAIL() << "no such key";
}

TEST(Configuration, KeysEndWithTheirUnit) {
  for (const ConfigurationFile& file : ConfigurationFiles())
    for (const Parameter* p : AllOf(file))
      EXPECT_TRUE(p->path().starts_with("signals.") || p->key().ends_with(SuffixOf(p->unit())))
          << file.name << " " << p->path();
}

TEST(Configuration, EveryParameterHasASentence) {
  for (const ConfigurationFile& file : ConfigurationFiles())
    for (const Parameter* p : AllOf(file))
      EXPECT_TRUE(p->path().starts_with("signals.") || p->sentence().ends_with("."))
          << file.name << " " << p->path();
}

// A file's own head, which the programs do not know.
std::string HeadOf(const std::string& text) {
  std::istringstream lines(text);
  std::string head;
  for (std::string line; std::getline(lines, line) && line.starts_with("#");) head += line + "\n";
  return head;
}

void ExpectFile(const fs::path& path, const std::string& expected) {
  const std::string name = path.filename().string();
  const fs::path generated = BuildDir() / "generated" / name;
  fs::create_directories(generated.parent_path());
  std::ofstream(generated, std::ios::binary) << expected;
  EXPECT_TRUE(TextOf(path) == expected)
      << path << " is not what the programs know; " << generated << " is";
}

TEST(Configuration, ShippedFilesAreWhatTheProgramsPrint) {
  const auto defaults = ConfigurationFiles();
  auto files = ConfigurationFiles();
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i].name.starts_with("config/bench/"))
      continue;  // one of many, with what differs alone
    const fs::path path = ConfigFile(files[i].name);
    SCOPED_TRACE(path.string());
    LoadParameters(path.string(), files[i].table);
    ExpectFile(path,
               HeadOf(TextOf(path)) + "\n" + PrintParameters(files[i].table, defaults[i].table));
  }
}

TEST(Configuration, ReferencePageIsWhatTheProgramsKnow) {
  ExpectFile(SourceDir() / "docs" / "configuration.md", ConfigurationPage());
}

TEST(Configuration, ShippedMapperFilesAndSurveysLoad) {
  int loaded = 0;
  for (const auto& entry : fs::directory_iterator(SourceDir() / "config")) {
    if (!entry.path().filename().string().starts_with("mapper")) continue;
    EXPECT_NO_THROW(LoadMapperConfig(entry.path().string())) << entry.path();
    ++loaded;
  }
  for (const auto& entry : fs::directory_iterator(SourceDir() / "config" / "bench")) {
    EXPECT_NO_THROW(bench::LoadSurvey(entry.path().string())) << entry.path();
    ++loaded;
  }
  EXPECT_GE(loaded, 12);
}

bool IsSource(const fs::path& path) {
  return path.extension() == ".cpp" || path.extension() == ".hpp";
}

// How often each text stands between quotation marks in the sources outside tests/.
std::map<std::string, int> QuotedTexts() {
  static const std::regex kQuoted("\"([a-z][a-z0-9_]*)\"");
  std::map<std::string, int> counts;
  for (const char* folder :
       {"bench", "common", "drivers", "logger", "mapper", "optimizer", "products", "tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(SourceDir() / folder)) {
      if (!IsSource(entry.path())) continue;
      const std::string text = TextOf(entry.path());
      for (std::sregex_iterator i(text.begin(), text.end(), kQuoted), end; i != end; ++i)
        ++counts[(*i)[1].str()];
    }
  }
  return counts;
}

// Names that results have too (report.json, info, status), where they are no keys of a
// configuration.
const std::set<std::string> kNamesInReports{"altitude_m",
                                            "depth_m",
                                            "east_m",
                                            "heading_deg",
                                            "latitude_deg",
                                            "length_m",
                                            "longitude_deg",
                                            "north_m",
                                            "rate_hz",
                                            "rms_m",
                                            "speed_mps"};

TEST(Configuration, EveryRenamedKeyIsThatOfAParameter) {
  std::set<std::string> paths;
  for (const ConfigurationFile& file : ConfigurationFiles())
    for (const Parameter* p : AllOf(file)) paths.insert(p->path());
  for (const RenamedKey& renamed : kRenamedKeys)
    EXPECT_TRUE(paths.contains(renamed.path)) << renamed.path;
}

// The same name in two sections is two parameters; a declaration that several files share is one.
TEST(Configuration, EachKeyStandsOnceAsAQuotedString) {
  std::map<std::string, std::set<std::string>> places;  // of each key
  for (const ConfigurationFile& file : ConfigurationFiles())
    for (const Parameter* p : AllOf(file)) {
      places[p->key()].insert(file.name + " " + p->path());
      for (const std::string& old_key : p->old_keys()) {
        places[old_key].insert(file.name + " " + p->path());
        if (p->path() == p->key()) places[p->key()].insert("kRenamedKeys");
      }
    }
  const std::map<std::string, int> counts = QuotedTexts();
  for (const auto& [key, where] : places) {
    if (key.find('_') == std::string::npos) continue;  // a word that has other uses
    if (kNamesInReports.contains(key)) continue;
    const auto count = counts.find(key);
    ASSERT_NE(count, counts.end()) << key;
    EXPECT_LE(count->second, static_cast<int>(where.size())) << key;
  }
}

TEST(Configuration, ProcessesAndReplayPrintWhatTheyUse) {
  const TemporaryDir dir;
  for (const char* name : {"seastitch-mapper",
                           "seastitch-optimizer",
                           "seastitch-logger",
                           "seastitch-imu-driver",
                           "seastitch-dvl-driver",
                           "seastitch-mbes-driver",
                           "seastitch-nav-driver",
                           "seastitch-nav-output",
                           "seastitch-page",
                           "seastitch replay"}) {
    const std::string out = (dir / "out.yaml").string();
    const bool is_replay = std::string(name) == "seastitch replay";
    const std::string program = is_replay ? Program("seastitch") + " replay" : Program(name);
    ASSERT_EQ(std::system((program + " --print-config > " + out).c_str()), 0) << name;
    EXPECT_THAT(TextOf(out), testing::StartsWith("# ")) << name;
  }
  const std::string first = (dir / "first.yaml").string();
  const std::string second = (dir / "second.yaml").string();
  const std::string mapper = Program("seastitch-mapper") + " --print-config --config ";
  ASSERT_EQ(std::system((mapper + ConfigFile("mapper_mems.yaml") + " > " + first).c_str()), 0);
  ASSERT_EQ(std::system((mapper + first + " > " + second).c_str()), 0);
  EXPECT_EQ(TextOf(first), TextOf(second));
  EXPECT_THAT(TextOf(first), HasSubstr("attitude_heading_deg: 0.6\n"));
}

}  // namespace
}  // namespace seastitch
