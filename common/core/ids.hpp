#pragma once

#include <compare>
#include <cstdint>

namespace seastitch {

// An integer type of its own, so that two kinds of ids cannot be mixed.
template <class Tag>
struct Id {
  std::int32_t value = -1;
  friend auto operator<=>(const Id&, const Id&) = default;
};

// Number of a submap, from 0 in the order in which they close; also the id of its graph vertex.
using SubmapId = Id<struct SubmapTag>;

}  // namespace seastitch
