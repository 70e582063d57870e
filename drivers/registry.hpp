#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace seastitch {

// Finds an entry of a table of formats or devices by its `name`, as used in configurations. Null if
// there is none.
template <class Entry, std::size_t kSize>
const Entry* FindEntry(const Entry (&table)[kSize], const std::string& name) {
  for (const Entry& entry : table)
    if (entry.name == name) return &entry;
  return nullptr;
}

template <class Entry, std::size_t kSize>
std::vector<std::string> NamesOf(const Entry (&table)[kSize]) {
  std::vector<std::string> names;
  for (const Entry& entry : table) names.push_back(entry.name);
  return names;
}

// Any device described by a DBC file.
inline constexpr char kSignalDevice[] = "signals";

}  // namespace seastitch
