#pragma once

#include <compare>
#include <cstdint>

namespace seastitch {

// A number that can only be compared with its own kind.
template <class Tag>
struct Id {
  std::int32_t value = -1;
  friend auto operator<=>(const Id&, const Id&) = default;
};

// Submaps are numbered from 0 in the order in which they close. Also the id of a graph vertex.
using SubmapId = Id<struct SubmapTag>;

}  // namespace seastitch
