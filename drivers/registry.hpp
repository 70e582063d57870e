#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace seastitch {

// Tables of what a driver can speak: one line an entry, each with a `name` as configurations have
// it. Null where there is none of that name.
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

// The device that a DBC file describes, whatever it is.
inline constexpr char kSignalDevice[] = "signals";

}  // namespace seastitch
