#pragma once

#include <string>

#include "common/parameters/parameters.hpp"
#include "common/runtime/config/config.hpp"

// Parameters in YAML files, and as text for people.
namespace seastitch {

// Reads a whole file into the values of the table. Throws ConfigError for the first key that is
// unknown, doubled, missing or not as expected.
void LoadParameters(const std::string& path, const ParameterTable& table);
// The same for a text; errors have `name` as the file's name.
void ParseParameters(const std::string& text, const std::string& name, const ParameterTable& table);
// Sets the value of one. False, without any change, where it is not usable.
bool SetParameter(const Parameter& parameter, const YAML::Node& node);
// Reads these keys of a file and leaves the others alone: for a key that chooses among tables.
void PeekParameters(const std::string& path, const ParameterTable& table);

// The configuration as YAML with a comment above each key, data sheet first; it loads as the same
// configuration again. `defaults`: the table of a configuration as nobody changed it.
std::string PrintParameters(const ParameterTable& values, const ParameterTable& defaults);

// Of a configuration for which `ParameterTable TableOf(Config*)` is declared.
template <class Config>
std::string PrintWithDefaults(Config values, Config defaults) {
  return PrintParameters(TableOf(&values), TableOf(&defaults));
}

// The same as a section of docs/configuration.md.
std::string ReferenceOf(const ParameterTable& defaults);

}  // namespace seastitch
