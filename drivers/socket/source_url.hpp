#pragma once

#include <map>
#include <set>
#include <string>

namespace seastitch {

// "SCHEME:ADDRESS[?KEY=VALUE[&KEY=VALUE]]"
struct SourceUrl {
  std::string text;  // the whole
  std::string scheme;
  std::string address;
  std::map<std::string, std::string> options;

  std::string Option(const std::string& key, const std::string& fallback) const {
    const auto found = options.find(key);
    return found == options.end() ? fallback : found->second;
  }
};

// Throws std::runtime_error "TEXT: reason", also for an option that is not among those allowed.
SourceUrl ParseSourceUrl(const std::string& text, const std::set<std::string>& allowed_options);

}  // namespace seastitch
