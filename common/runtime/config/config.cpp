#include "common/runtime/config/config.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <optional>

#include "common/runtime/config/nearest_name.hpp"
#include "common/runtime/files/whole_file.hpp"

namespace seastitch {
namespace {

constexpr int kMaxDepth = 16;
constexpr std::size_t kLongestQuote = 60;

std::string ReadFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw ConfigError(path + ": is a directory");
  const std::optional<std::string> text = ReadWholeFile(path);
  if (!text) throw ConfigError(path + ": cannot be opened: " + std::strerror(errno));
  return *text;
}

YAML::Node ParseYaml(const std::string& text, const std::string& path) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw ConfigError(path + ":" + std::to_string(e.mark.line + 1) + ": not YAML: " + e.msg);
  }
}

std::string Joined(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

// Refuses double keys: of two equal keys yaml-cpp finds the first and ignores the second.
void CheckKeys(const YAML::Node& node, const std::string& where, int depth) {
  if (depth > kMaxDepth) throw ConfigError(where + ": nested too deeply");
  if (node.IsSequence())
    for (const YAML::Node& child : node) CheckKeys(child, where, depth + 1);
  if (!node.IsMap()) return;
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const YAML::Node& key = entry.first;
    if (!key.IsScalar()) throw ConfigError(where + ": a key is not a word");
    if (!seen.insert(key.Scalar()).second)
      throw ConfigError(where + ": " + key.Scalar() + ": stands twice");
    CheckKeys(entry.second, where, depth + 1);
  }
}

std::string Quoted(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsNull()) return "an empty value";
  std::string text = node.IsSequence() ? YAML::Dump(node) : node.Scalar();
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (text.size() > kLongestQuote) text = text.substr(0, kLongestQuote) + "...";
  return "'" + text + "'";
}

}  // namespace

ConfigMap ConfigMap::Load(const std::string& path) { return Parse(ReadFile(path), path); }

ConfigMap ConfigMap::Parse(const std::string& text, const std::string& name) {
  const YAML::Node root = ParseYaml(text, name);
  if (!root.IsMap())
    throw ConfigError(name + ": expected a map of keys ({} where every default is to stand)");
  CheckKeys(root, name, 0);
  return ConfigMap(root, name, "");
}

YAML::Node ConfigMap::Take(const std::string& key) {
  taken_.insert(key);
  known_.push_back(key);
  return Get(key);
}

ConfigMap ConfigMap::Child(const std::string& key) {
  const YAML::Node node = Take(key);
  if (!node || node.IsNull())
    return ConfigMap(YAML::Node(YAML::NodeType::Map), file_, Joined(path_, key));
  if (!node.IsMap()) FailNotA(key, node, "a map");
  return ConfigMap(node, file_, Joined(path_, key));
}

std::vector<ConfigMap> ConfigMap::Children(const std::string& key) {
  std::vector<ConfigMap> children;
  const YAML::Node list = Take(key);
  if (!list || list.IsNull()) return children;
  if (!list.IsSequence()) FailNotA(key, list, "a list");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string name = key + "[" + std::to_string(i) + "]";
    if (!list[i].IsMap()) FailNotA(name, list[i], "a map");
    children.push_back(ConfigMap(list[i], file_, Joined(path_, name)));
  }
  return children;
}

void ConfigMap::Finish() const {
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (taken_.contains(key)) continue;
    constexpr std::size_t kShortest = 3;  // a shorter word is similar to any
    const std::string nearest = key.size() < kShortest ? "" : NearestName(key, known_);
    Fail(key, nearest.empty() ? "unknown key" : "unknown key; did you mean '" + nearest + "'?");
  }
}

void ConfigMap::Fail(const std::string& key, const std::string& problem) const {
  throw ConfigError(file_ + ": " + Joined(path_, key) + ": " + problem);
}

void ConfigMap::FailNotA(const std::string& key,
                         const YAML::Node& node,
                         const std::string& expected) const {
  Fail(key, Quoted(node) + " is not " + expected);
}

YAML::Node ConfigMap::Get(const std::string& key) const { return node_[key]; }

}  // namespace seastitch
