#pragma once

#include <cstddef>
#include <functional>

namespace seastitch {

// A function that calls work(0) to work(n - 1), in any order and on any threads; the calls must not
// depend on each other. A pure function takes it as a parameter, so that its caller decides about
// threads.
using ForEach = std::function<void(std::size_t n, const std::function<void(std::size_t)>& work)>;

// One after another.
inline void ForEachInTurn(std::size_t n, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < n; ++i) work(i);
}

}  // namespace seastitch
