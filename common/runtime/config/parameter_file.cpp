#include "common/runtime/config/parameter_file.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

template <class T>
std::optional<T> Scalar(const YAML::Node& node) {
  try {
    if (node.IsScalar()) return node.as<T>();
  } catch (const YAML::Exception&) {
    // Not a number: the caller's message states what was expected.
  }
  return std::nullopt;
}

// YAML accepts .nan and .inf as numbers; a configuration does not.
std::optional<double> NumberIn(const YAML::Node& node, Unit unit, const Range& range) {
  const auto number = Scalar<double>(node);
  if (!number || !std::isfinite(*number) || !range.Contains(*number)) return std::nullopt;
  return unit == Unit::kDegreeFromRadian ? Deg2Rad(*number) : *number;
}

std::optional<std::vector<double>> NumbersIn(const YAML::Node& node,
                                             Unit unit,
                                             const Range& range) {
  if (!node.IsSequence()) return std::nullopt;
  std::vector<double> numbers;
  for (const YAML::Node& element : node) {
    const auto number = NumberIn(element, unit, range);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

bool Assign(const YAML::Node& node, const Choice& choice) {
  const auto name = Scalar<std::string>(node);
  const auto found =
      name ? std::find(choice.names.begin(), choice.names.end(), *name) : choice.names.end();
  if (found == choice.names.end()) return false;
  choice.set(static_cast<std::size_t>(found - choice.names.begin()));
  return true;
}

}  // namespace

bool SetParameter(const Parameter& parameter, const YAML::Node& node) {
  const Unit unit = parameter.unit();
  const Range& range = parameter.range();
  return std::visit(
      [&](const auto& value) -> bool {
        using T = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<T, Choice>) {
          return Assign(node, value);
        } else if constexpr (std::is_same_v<T, std::span<double>>) {
          const auto numbers = NumbersIn(node, unit, range);
          if (!numbers || numbers->size() != value.size()) return false;
          std::copy(numbers->begin(), numbers->end(), value.begin());
          return true;
        } else if constexpr (std::is_same_v<T, std::vector<double>*>) {
          auto numbers = NumbersIn(node, unit, range);
          if (numbers) *value = std::move(*numbers);
          return numbers.has_value();
        } else if constexpr (std::is_same_v<T, double*>) {
          const auto number = NumberIn(node, unit, range);
          if (number) *value = *number;
          return number.has_value();
        } else if constexpr (std::is_same_v<T, std::filesystem::path*>) {
          const auto text = Scalar<std::string>(node);
          if (text) *value = *text;
          return text.has_value();
        } else {
          const auto scalar = Scalar<std::remove_pointer_t<T>>(node);
          if (!scalar) return false;
          if constexpr (std::is_arithmetic_v<std::remove_pointer_t<T>>)
            if (!range.Contains(static_cast<double>(*scalar))) return false;
          *value = *scalar;
          return true;
        }
      },
      parameter.value());
}

namespace {

void ReadParameters(const ParameterTable& table, ConfigMap* map) {
  for (const auto& [key, instead] : table.removed())
    if (map->Has(key)) map->Fail(key, "was removed, " + instead);
  for (const auto& [key, why] : table.ignored()) {
    if (!map->Has(key)) continue;
    map->Take(key);
    spdlog::warn("{}: {}{} is ignored: {}", map->file(), table.path(), key, why);
  }
  for (const Parameter& parameter : table.parameters()) {
    std::string key = parameter.key();
    map->Know(key);
    for (const std::string& old_key : parameter.old_keys()) {
      if (!map->Has(old_key)) continue;
      if (map->Has(key)) map->Fail(old_key, "is the earlier name of " + key + ", which stands too");
      spdlog::warn("{}: {} is now called {}", map->file(), old_key, parameter.path());
      key = old_key;
    }
    if (!map->Has(key)) {
      if (parameter.required()) map->Fail(key, "missing, expected " + parameter.Expected());
      continue;
    }
    const YAML::Node node = map->Take(key);
    if (!SetParameter(parameter, node)) map->FailNotA(key, node, parameter.Expected());
    if (parameter.required() && parameter.IsUnset()) map->FailNotA(key, node, "a text");
  }
}

void ReadSome(const ParameterTable& table, ConfigMap* map) {
  ReadParameters(table, map);
  for (const ParameterTable& section : table.sections()) {
    ConfigMap child = map->Child(section.key());
    ReadSome(section, &child);
  }
}

void ReadAll(const ParameterTable& table, ConfigMap* map) {
  ReadParameters(table, map);
  for (const ParameterTable& section : table.sections()) {
    ConfigMap child = map->Child(section.key());
    ReadAll(section, &child);
  }
  for (const ParameterTable::List& list : table.lists()) {
    std::vector<ConfigMap> children = map->Children(list.key);
    list.resize(children.size());
    for (std::size_t i = 0; i < children.size(); ++i) ReadAll(list.Element(i), &children[i]);
  }
  map->Finish();
  for (const ParameterTable::Rule& rule : table.rules())
    if (!rule.holds())
      map->Fail(rule.path.substr(table.path().size()),
                "'" + rule.value() + "' is not " + rule.expected);
}

}  // namespace

void LoadParameters(const std::string& path, const ParameterTable& table) {
  ConfigMap root = ConfigMap::Load(path);
  ReadAll(table, &root);
}

void ParseParameters(const std::string& text,
                     const std::string& name,
                     const ParameterTable& table) {
  ConfigMap root = ConfigMap::Parse(text, name);
  ReadAll(table, &root);
}

void PeekParameters(const std::string& path, const ParameterTable& table) {
  ConfigMap root = ConfigMap::Load(path);
  ReadSome(table, &root);
}

}  // namespace seastitch
