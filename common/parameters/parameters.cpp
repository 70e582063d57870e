#include "common/parameters/parameters.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "common/core/pose.hpp"
#include "common/parameters/renamed_keys.hpp"

namespace seastitch {
namespace {

struct UnitNames {
  const char* symbol;
  const char* suffix;
};

UnitNames NamesOf(Unit unit) {
  switch (unit) {
    case Unit::kNone: return {"", ""};
    case Unit::kMetre: return {"m", "_m"};
    case Unit::kSquareMetre: return {"m2", "_m2"};
    case Unit::kSecond: return {"s", "_s"};
    case Unit::kMillisecond: return {"ms", "_ms"};
    case Unit::kMetrePerSecond: return {"m/s", "_mps"};
    case Unit::kMetrePerSecond2: return {"m/s2", "_mps2"};
    case Unit::kRadianPerSecond: return {"rad/s", "_radps"};
    case Unit::kRadianPerSecondRootHertz: return {"rad/s/sqrt(Hz)", "_radps_rthz"};
    case Unit::kMetrePerSecond2RootHertz: return {"m/s2/sqrt(Hz)", "_mps2_rthz"};
    case Unit::kDegree:
    case Unit::kDegreeFromRadian: return {"deg", "_deg"};
    case Unit::kHertz: return {"Hz", "_hz"};
    case Unit::kByte: return {"B", "_bytes"};
    case Unit::kMegabyte: return {"MB", "_mb"};
    case Unit::kNat: return {"nat", "_nats"};
    case Unit::kNatPerPatch: return {"nat/patch", "_nats_per_patch"};
  }
  return {"", ""};
}

// The shortest decimal that reads as the same number; -0 is written as 0.
std::string NumberText(double value) {
  const double magnitude = std::abs(value);
  const bool plain = value == 0.0 || (magnitude >= 1e-4 && magnitude < 1e9);
  std::array<char, 64> text;
  const auto end = std::to_chars(text.data(),
                                 text.data() + text.size(),
                                 value == 0.0 ? 0.0 : value,
                                 plain ? std::chars_format::fixed : std::chars_format::scientific);
  return std::string(text.data(), end.ptr);
}

// The shortest decimal in degrees that converts to exactly the same radians. It exists for every
// angle that was read in degrees; for others the nearest decimal is used.
std::string DegreesText(double rad) {
  const double deg = Rad2Deg(rad);
  for (int digits = 1; digits < 17; ++digits) {
    std::array<char, 64> text;
    std::snprintf(text.data(), text.size(), "%.*g", digits, deg);
    const double rounded = std::strtod(text.data(), nullptr);
    if (Deg2Rad(rounded) == rad) return NumberText(rounded);
  }
  return NumberText(deg);
}

std::string TextOf(double value, Unit unit) {
  return unit == Unit::kDegreeFromRadian ? DegreesText(value) : NumberText(value);
}

std::string TextOf(std::span<const double> values, Unit unit) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + TextOf(value, unit);
  return "[" + text + "]";
}

// Without quotation marks if YAML reads the text as a string anyway.
std::string TextOf(const std::string& value) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string("_./-").find(c) != std::string::npos;
  };
  const bool starts_plain = !value.empty() && (std::isalpha(static_cast<unsigned char>(value[0])) ||
                                               value[0] == '/' || value[0] == '.');
  if (starts_plain && std::all_of(value.begin(), value.end(), is_plain) && value != "null" &&
      value != "Null" && value != "NULL")
    return value;
  std::string quoted = "\"";
  for (const char c : value) {
    const auto code = static_cast<unsigned char>(c);
    char escape[8];
    std::snprintf(escape, sizeof escape, "\\x%02X", code);
    if (c == '"' || c == '\\')
      quoted += {'\\', c};
    else
      quoted += code < 0x20 || code == 0x7f ? std::string(escape) : std::string{c};
  }
  return quoted + "\"";
}

std::string AnyOf(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  return text;
}

std::string WithRange(const std::string& what, const char* separator, const Range& range) {
  const std::string text = range.Text();
  return text.empty() ? what : what + separator + text;
}

}  // namespace

const char* SymbolOf(Unit unit) { return NamesOf(unit).symbol; }
const char* SuffixOf(Unit unit) { return NamesOf(unit).suffix; }

Range Range::Below(double limit) const {
  Range range = *this;
  range.high = limit;
  range.high_is_inside = false;
  return range;
}

Range Range::AtMost(double limit) const {
  Range range = *this;
  range.high = limit;
  return range;
}

Range Range::OrZero() const {
  Range range = *this;
  range.zero_is_inside = true;
  return range;
}

bool Range::Contains(double value) const {
  if (zero_is_inside && value == 0.0) return true;
  return (low_is_inside ? value >= low : value > low) &&
         (high_is_inside ? value <= high : value < high);
}

std::string Range::Text() const {
  const bool has_low = std::isfinite(low);
  const bool has_high = std::isfinite(high);
  std::string text = zero_is_inside ? "0 or " : "";
  if (has_low && has_high && low_is_inside && high_is_inside)
    return text + "from " + NumberText(low) + " to " + NumberText(high);
  if (has_low) text += (low_is_inside ? "at least " : "above ") + NumberText(low);
  if (has_low && has_high) text += ", ";
  if (has_high) text += (high_is_inside ? "at most " : "below ") + NumberText(high);
  return text;
}

Parameter::Parameter(
    std::string key, std::string path, Value value, Unit unit, Range range, std::string sentence)
    : key_(std::move(key)),
      path_(std::move(path)),
      value_(std::move(value)),
      unit_(unit),
      range_(range),
      sentence_(std::move(sentence)) {}

Parameter& Parameter::DataSheet() {
  level_ = Level::kDataSheet;
  return *this;
}

Parameter& Parameter::Required() {
  required_ = true;
  return *this;
}

std::vector<std::string> Parameter::old_keys() const {
  std::vector<std::string> keys;
  for (const RenamedKey& renamed : kRenamedKeys)
    if (path_ == renamed.path) keys.emplace_back(renamed.was);
  return keys;
}

std::string Parameter::Expected() const {
  return std::visit(
      [this](const auto& value) -> std::string {
        using T = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<T, bool*>)
          return "true or false";
        else if constexpr (std::is_same_v<T, double*>)
          return WithRange("a number", " ", range_);
        else if constexpr (std::is_same_v<T, std::span<double>>)
          return WithRange(std::to_string(value.size()) + " numbers", ", each ", range_);
        else if constexpr (std::is_same_v<T, std::vector<double>*>)
          return WithRange("a list of numbers", ", each ", range_);
        else if constexpr (std::is_same_v<T, std::string*> ||
                           std::is_same_v<T, std::filesystem::path*>)
          return "a text";
        else if constexpr (std::is_same_v<T, Choice>)
          return AnyOf(value.names);
        else
          return WithRange("a whole number", " ", range_);
      },
      value_);
}

std::string Parameter::Text() const {
  return std::visit(
      [this](const auto& value) -> std::string {
        using T = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<T, bool*>)
          return *value ? "true" : "false";
        else if constexpr (std::is_same_v<T, double*>)
          return TextOf(*value, unit_);
        else if constexpr (std::is_same_v<T, std::span<double>>)
          return TextOf(value, unit_);
        else if constexpr (std::is_same_v<T, std::vector<double>*>)
          return TextOf(*value, unit_);
        else if constexpr (std::is_same_v<T, std::string*>)
          return TextOf(*value);
        else if constexpr (std::is_same_v<T, std::filesystem::path*>)
          return TextOf(value->string());
        else if constexpr (std::is_same_v<T, Choice>)
          return TextOf(value.names[value.get()]);
        else
          return std::to_string(*value);
      },
      value_);
}

bool Parameter::IsUnset() const {
  if (const auto* text = std::get_if<std::string*>(&value_)) return (*text)->empty();
  if (const auto* path = std::get_if<std::filesystem::path*>(&value_)) return (*path)->empty();
  if (const auto* number = std::get_if<double*>(&value_)) return !std::isfinite(**number);
  return false;
}

bool Parameter::IsInRange() const {
  const auto is_in = [this](double value) {
    const double in_file = unit_ == Unit::kDegreeFromRadian ? Rad2Deg(value) : value;
    return std::isfinite(value) && range_.Contains(in_file);
  };
  return std::visit(
      [&](const auto& value) -> bool {
        using T = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<T, std::span<double>>)
          return std::all_of(value.begin(), value.end(), is_in);
        else if constexpr (std::is_same_v<T, std::vector<double>*>)
          return std::all_of(value->begin(), value->end(), is_in);
        else if constexpr (!std::is_same_v<T, Choice> && std::is_pointer_v<T> &&
                           std::is_arithmetic_v<std::remove_pointer_t<T>> &&
                           !std::is_same_v<T, bool*>)
          return is_in(static_cast<double>(*value));
        else
          return true;
      },
      value_);
}

template <class T>
Parameter& ParameterTable::Add(
    std::string_view key, T* value, Unit unit, Range range, std::string_view sentence) {
  return Insert(key, value, unit, range, sentence);
}

template Parameter& ParameterTable::Add(std::string_view, bool*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(std::string_view, int*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(
    std::string_view, std::int64_t*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(
    std::string_view, std::uint64_t*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(std::string_view, double*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(
    std::string_view, std::vector<double>*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(
    std::string_view, std::string*, Unit, Range, std::string_view);
template Parameter& ParameterTable::Add(
    std::string_view, std::filesystem::path*, Unit, Range, std::string_view);

Parameter& ParameterTable::AddChoice(std::string_view key,
                                     std::string* value,
                                     const std::vector<std::string>& names,
                                     std::string_view sentence) {
  std::vector<std::pair<std::string, std::string>> choices;
  for (const std::string& name : names) choices.emplace_back(name, name);
  return AddChoice<std::string>(key, value, choices, sentence);
}

ParameterTable& ParameterTable::AddSection(std::string_view key, std::string_view sentence) {
  ParameterTable& section = sections_.emplace_back();
  section.key_ = key;
  section.path_ = path_ + section.key_ + ".";
  section.sentence_ = sentence;
  return section;
}

Parameter& ParameterTable::Insert(std::string_view key,
                                  Parameter::Value value,
                                  Unit unit,
                                  Range range,
                                  std::string_view sentence) {
  return parameters_.emplace_back(std::string(key),
                                  path_ + std::string(key),
                                  std::move(value),
                                  unit,
                                  range,
                                  std::string(sentence));
}

void ParameterTable::AddRule(const Parameter& parameter,
                             std::string_view expected,
                             std::function<bool()> holds) {
  rules_.push_back({parameter.path(),
                    [copy = parameter] { return copy.Text(); },
                    std::string(expected),
                    std::move(holds)});
}

void ParameterTable::AddRemoved(std::string_view key, std::string_view instead) {
  removed_.emplace_back(key, instead);
}

void ParameterTable::AddIgnored(std::string_view key, std::string_view why) {
  ignored_.emplace_back(key, why);
}

const Parameter& ParameterTable::Find(const std::string& path) const {
  for (const Parameter& parameter : parameters_)
    if (parameter.path() == path_ + path) return parameter;
  for (const ParameterTable& section : sections_)
    if (path.starts_with(section.key_ + "."))
      return section.Find(path.substr(section.key_.size() + 1));
  throw std::logic_error("no parameter " + path_ + path);
}

ParameterTable ParameterTable::List::Element(std::size_t i) const {
  ParameterTable table;
  declare(i, &table);
  return table;
}

void ParameterTable::Check() const {
  const auto fail = [](const std::string& path, const std::string& value, const std::string& why) {
    throw std::invalid_argument(path + " = " + value + ", must be " + why);
  };
  for (const Parameter& parameter : parameters_)
    if (!parameter.IsInRange()) {
      const std::string range = parameter.range().Text();
      fail(parameter.path(), parameter.Text(), range.empty() ? "finite" : range);
    }
  for (const ParameterTable& section : sections_) section.Check();
  for (const List& list : lists_)
    for (std::size_t i = 0; i < list.size(); ++i) list.Element(i).Check();
  for (const Rule& rule : rules_)
    if (!rule.holds()) fail(rule.path, rule.value(), rule.expected);
}

}  // namespace seastitch
