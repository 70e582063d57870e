#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

// Declarations of parameters, one per parameter: its key, unit, range and meaning. Reading,
// checking, --print-config, docs/configuration.md and the shipped YAML files are all made from it
// (common/runtime/config/parameter_file.hpp). Pure.
//
//   ParameterTable TableOf(FilterParams* p) {
//     ParameterTable table;
//     table.Add("edge_m", &p->edge_m, Unit::kMetre, Range::Within(0.01, 10.0), "Of a voxel.");
//     return table;
//   }
//   FilterParams p;                      // what the file leaves out keeps the struct's default
//   LoadParameters("filter.yaml", TableOf(&p));    // throws ConfigError, one line
//   TableOf(&p).Check();                 // values that were set in code
namespace seastitch {

// Unit of the value in the file. The key ends with the unit's suffix; a test checks that.
enum class Unit : std::uint8_t {
  kNone,
  kMetre,
  kSquareMetre,
  kSecond,
  kMillisecond,
  kMetrePerSecond,
  kMetrePerSecond2,
  kRadianPerSecond,
  kRadianPerSecondRootHertz,
  kMetrePerSecond2RootHertz,
  kDegree,
  kDegreeFromRadian,  // degrees in the file, radians in the struct
  kHertz,
  kByte,
  kMegabyte,
  kNat,
  kNatPerPatch,
};
const char* SymbolOf(Unit unit);
const char* SuffixOf(Unit unit);

// Range of a number, in the unit of the file.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_is_inside = true;
  bool high_is_inside = true;
  bool zero_is_inside = false;  // beside what lies within the limits

  static Range Any() { return {}; }
  static Range Above(double low) { return Range{.low = low, .low_is_inside = false}; }
  static Range AtLeast(double low) { return Range{.low = low}; }
  static Range Within(double low, double high) { return Range{.low = low, .high = high}; }
  Range Below(double limit) const;
  Range AtMost(double limit) const;
  Range OrZero() const;

  bool Contains(double value) const;
  std::string Text() const;  // "above 0, at most 10"; empty for Any()
};

enum class Level : std::uint8_t { kDataSheet, kExpert };

struct Choice {
  std::vector<std::string> names;
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

// A named value of a configuration, bound to a field of a struct that outlives it.
class Parameter {
 public:
  using Value = std::variant<bool*,
                             int*,
                             std::int64_t*,
                             std::uint64_t*,
                             double*,
                             std::span<double>,     // of a fixed number
                             std::vector<double>*,  // of any number
                             std::string*,
                             std::filesystem::path*,
                             Choice>;

  Parameter(
      std::string key, std::string path, Value value, Unit unit, Range range, std::string sentence);

  Parameter& DataSheet();
  // The file must have the key.
  Parameter& Required();

  const std::string& key() const { return key_; }
  const std::string& path() const { return path_; }  // with the sections' keys: "submap.turn_deg"
  const Value& value() const { return value_; }
  Unit unit() const { return unit_; }
  const Range& range() const { return range_; }
  Level level() const { return level_; }
  bool required() const { return required_; }
  // Its former names, by kRenamedKeys.
  std::vector<std::string> old_keys() const;
  const std::string& sentence() const { return sentence_; }

  // Description of usable values: "a number above 0", "2 numbers, each above 0", "grid or gicp".
  std::string Expected() const;
  // The value as YAML; it reads as the same value again. IsUnset(): there is nothing to write.
  std::string Text() const;
  bool IsUnset() const;
  // True if a number, or each of several, is finite and within its range. Others always are.
  bool IsInRange() const;

 private:
  std::string key_;
  std::string path_;
  Value value_;
  Unit unit_;
  Range range_;
  Level level_ = Level::kExpert;
  bool required_ = false;
  std::string sentence_;
};

// All parameters of a file, or of one section of it, bound to one configuration.
class ParameterTable {
 public:
  ParameterTable() = default;
  ParameterTable(ParameterTable&&) = default;
  ParameterTable& operator=(ParameterTable&&) = default;

  // A number, numbers of a fixed (Eigen) or any count, a text, a path or a flag. Compiled once, for
  // each type of Parameter::Value: inlined into its hundreds of calls it takes minutes to compile.
  template <class T>
  Parameter& Add(std::string_view key, T* value, Unit unit, Range range, std::string_view sentence);
  template <int kSize>
  Parameter& Add(std::string_view key,
                 Eigen::Matrix<double, kSize, 1>* value,
                 Unit unit,
                 Range range,
                 std::string_view sentence) {
    return Insert(key, std::span<double>(value->data(), kSize), unit, range, sentence);
  }
  template <class T>
  Parameter& Add(std::string_view key, T* value, std::string_view sentence) {
    return Add(key, value, Unit::kNone, Range::Any(), sentence);
  }
  // One of several, by name.
  template <class Enum>
  Parameter& AddChoice(std::string_view key,
                       Enum* value,
                       const std::vector<std::pair<std::string, Enum>>& choices,
                       std::string_view sentence) {
    Choice choice;
    for (const auto& [name, unused] : choices) choice.names.push_back(name);
    choice.get = [value, choices] {
      std::size_t i = 0;
      while (i + 1 < choices.size() && choices[i].second != *value) ++i;
      return i;
    };
    choice.set = [value, choices](std::size_t i) { *value = choices[i].second; };
    return Insert(key, std::move(choice), Unit::kNone, Range::Any(), sentence);
  }
  // A text that is one of these.
  Parameter& AddChoice(std::string_view key,
                       std::string* value,
                       const std::vector<std::string>& names,
                       std::string_view sentence);

  // A map below this one. The reference stays good.
  ParameterTable& AddSection(std::string_view key, std::string_view sentence);
  // A list of maps.
  template <class T>
  void AddList(std::string_view key,
               std::vector<T>* values,
               void (*declare)(T*, ParameterTable*),
               std::string_view sentence) {
    lists_.push_back({std::string(key),
                      std::string(sentence),
                      [values] { return values->size(); },
                      [values](std::size_t size) { values->resize(size); },
                      [values, declare](std::size_t i, ParameterTable* table) {
                        declare(&(*values)[i], table);
                      }});
  }
  // Adds a condition beyond the ranges. The error is "FILE: PATH: 'VALUE' is not EXPECTED".
  void AddRule(const Parameter& parameter, std::string_view expected, std::function<bool()> holds);
  // A key of an earlier version whose place another has taken: a file that has it stops the program
  // with one line, "FILE: KEY: was removed, INSTEAD".
  void AddRemoved(std::string_view key, std::string_view instead);
  // A key of an earlier version without a replacement: it is ignored with one warning, so that a
  // dive replays with its own configuration.
  void AddIgnored(std::string_view key, std::string_view why);
  // By its path from here, such as "submap.turn_deg". It must be there.
  const Parameter& Find(const std::string& path) const;

  // Checks values that were set in code. Throws std::invalid_argument for the first one that is out
  // of its range or breaks a rule: "submap.turn_deg = -1, must be above 0".
  void Check() const;

  struct List {
    std::string key;
    std::string sentence;
    std::function<std::size_t()> size;
    std::function<void(std::size_t)> resize;
    std::function<void(std::size_t, ParameterTable*)> declare;

    ParameterTable Element(std::size_t i) const;
  };
  const std::string& key() const { return key_; }
  const std::string& path() const { return path_; }
  const std::string& sentence() const { return sentence_; }
  const std::deque<Parameter>& parameters() const { return parameters_; }
  const std::deque<ParameterTable>& sections() const { return sections_; }
  const std::vector<List>& lists() const { return lists_; }

  struct Rule {
    std::string path;  // of the parameter that is wrong where it is broken
    std::function<std::string()> value;
    std::string expected;
    std::function<bool()> holds;
  };
  const std::vector<Rule>& rules() const { return rules_; }
  using KeyAndText = std::pair<std::string, std::string>;
  const std::vector<KeyAndText>& removed() const { return removed_; }  // key, instead
  const std::vector<KeyAndText>& ignored() const { return ignored_; }  // key, why

 private:
  Parameter& Insert(std::string_view key,
                    Parameter::Value value,
                    Unit unit,
                    Range range,
                    std::string_view sentence);

  std::string key_;
  std::string path_;  // ends with a dot unless empty
  std::string sentence_;
  std::deque<Parameter> parameters_;
  std::deque<ParameterTable> sections_;
  std::vector<List> lists_;
  std::vector<Rule> rules_;
  std::vector<KeyAndText> removed_;
  std::vector<KeyAndText> ignored_;
};

}  // namespace seastitch
