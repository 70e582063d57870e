#pragma once

#include <cstdint>
#include <string>

namespace seastitch {

// "1 submap", "3 submaps"; `many` where the plural is not `one` with an s.
inline std::string Counted(std::uint64_t count,
                           const std::string& one,
                           const std::string& many = {}) {
  return std::to_string(count) + " " + (count == 1 ? one : many.empty() ? one + "s" : many);
}

}  // namespace seastitch
