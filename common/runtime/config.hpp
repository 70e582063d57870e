#pragma once

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace seastitch {

// A configuration that cannot be used. what() is one line: file, key, value, what was expected.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One YAML map that must be read whole: a key nobody asked for is a typing error, not a default.
// A key that stands twice and a key without a value are errors too.
//
//   ConfigMap root = ConfigMap::Load("mapper.yaml");
//   ConfigMap submap = root.Child("submap");
//   submap.Read("voxel_m", &p.voxel_m);   // absent: the struct's default stands
//   submap.Finish();                      // "mapper.yaml: submap.voxel_size: unknown key"
//   root.Finish();
//   Require(p.Validate(), ...)
class ConfigMap {
 public:
  // Throws ConfigError where the file is missing, is not YAML or is not a map.
  static ConfigMap Load(const std::string& path);

  // Reads an optional or a required key. Throws ConfigError
  // "mapper.yaml: submap.voxel_m: 'wide' is not a number".
  template <class T>
  void Read(const std::string& key, T* value) {
    read_.insert(key);
    if (const YAML::Node node = Get(key)) *value = As<T>(key, node);
  }
  template <class T>
  void Require(const std::string& key, T* value) {
    if (!Has(key)) throw ConfigError(Where(key) + ": missing");
    Read(key, value);
  }
  bool Has(const std::string& key) const { return static_cast<bool>(Get(key)); }

  // A nested map (empty where absent) and a list of maps.
  ConfigMap Child(const std::string& key);
  std::vector<ConfigMap> Children(const std::string& key);
  // The keys of this map, in file order, for maps whose keys are names; each then counts as read
  // only when it is read.
  std::vector<std::string> Keys() const;

  // Throws ConfigError for the first key that nobody read.
  void Finish() const;
  // Throws ConfigError "FILE: PATH.problem" unless problem is empty: for Validate().
  void Check(const std::string& problem) const;

  const std::string& file() const { return file_; }

 private:
  ConfigMap(YAML::Node node, std::string file, std::string path)
      : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {}

  YAML::Node Get(const std::string& key) const;
  std::string Where(const std::string& key) const;
  [[noreturn]] void ThrowNotA(const std::string& key,
                              const YAML::Node& node,
                              const char* expected) const;

  template <class T>
  T As(const std::string& key, const YAML::Node& node) const {
    if (node.IsNull()) ThrowNotA(key, node, Expected<T>());  // yaml-cpp makes it the text "null"
    try {
      T value = node.as<T>();
      if (IsUsable(value)) return value;
    } catch (const YAML::Exception&) {
      // Told below, with the value.
    }
    ThrowNotA(key, node, Expected<T>());
  }
  // .nan and .inf are numbers to YAML, but not to a configuration.
  template <class T>
  static bool IsUsable(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      return std::isfinite(value);
    } else if constexpr (requires { typename T::value_type; } && !std::is_same_v<T, std::string>) {
      for (const typename T::value_type element : value)
        if (!IsUsable<typename T::value_type>(element)) return false;
    }
    return true;
  }
  template <class T>
  static constexpr const char* Expected() {
    if constexpr (std::is_same_v<T, bool>)
      return "true or false";
    else if constexpr (std::is_integral_v<T>)
      return "a whole number";
    else if constexpr (std::is_floating_point_v<T>)
      return "a number";
    else if constexpr (std::is_same_v<T, std::string>)
      return "a text";
    else
      return "of the expected shape";
  }

  YAML::Node node_;
  std::string file_;
  std::string path_;
  std::set<std::string> read_;
};

}  // namespace seastitch
