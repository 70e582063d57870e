#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace seastitch {

// A configuration that cannot be used. what() is one line: file, key, value, what was expected.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Reader of a YAML map in which every key has to be read, so that a misspelt key is an error
// instead of a default. A repeated key and a key without a value are errors, too. Used by
// ParameterTable.
class ConfigMap {
 public:
  // Throws ConfigError where the file is missing, is not YAML or is not a map.
  static ConfigMap Load(const std::string& path);
  // The same for a text; errors have `name` as the file's name.
  static ConfigMap Parse(const std::string& text, const std::string& name);

  bool Has(const std::string& key) const { return static_cast<bool>(Get(key)); }
  // A key that may stand in the map: an error of an unknown one names the most similar of them.
  void Know(const std::string& key) { known_.push_back(key); }
  // The value of a key, which then counts as read.
  YAML::Node Take(const std::string& key);
  // A nested map (empty where absent) and a list of maps.
  ConfigMap Child(const std::string& key);
  std::vector<ConfigMap> Children(const std::string& key);

  // Throws ConfigError for the first key that was not read: "FILE: PATH: unknown key; did you mean
  // 'NAME'?".
  void Finish() const;
  // Throws ConfigError "FILE: PATH: problem".
  [[noreturn]] void Fail(const std::string& key, const std::string& problem) const;
  [[noreturn]] void FailNotA(const std::string& key,
                             const YAML::Node& node,
                             const std::string& expected) const;

  const std::string& file() const { return file_; }

 private:
  ConfigMap(YAML::Node node, std::string file, std::string path)
      : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {}

  YAML::Node Get(const std::string& key) const;

  YAML::Node node_;
  std::string file_;
  std::string path_;
  std::set<std::string> taken_;
  std::vector<std::string> known_;
};

}  // namespace seastitch
