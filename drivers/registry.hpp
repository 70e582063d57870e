#pragma once

#include <cstddef>
#include <string>

namespace seastitch {

// Tables of what a driver can speak: one line an entry, each with a `name` as configurations have
// it. Null where there is none of that name.
template <class Entry, std::size_t kSize>
const Entry* FindEntry(const Entry (&table)[kSize], const std::string& name) {
  for (const Entry& entry : table)
    if (entry.name == name) return &entry;
  return nullptr;
}

// "'sidescan' is none of kmall, r2sonic, s7k"; empty where there is one of that name.
template <class Entry, std::size_t kSize>
std::string ProblemWithName(const Entry (&table)[kSize], const std::string& name) {
  if (FindEntry(table, name) != nullptr) return "";
  std::string names;
  for (const Entry& entry : table) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return "'" + name + "' is none of " + names;
}

}  // namespace seastitch
