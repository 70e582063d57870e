#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

// Counts of rejected and lost data, by reason. Every part of a driver has its own; HEALTH has all.
// They are for people: no code asks for one by its name.
using Counters = std::map<std::string, std::int64_t>;

// Counts by a reason that code asks for: an enum whose last value is kCount, with a function
// NameOf() for the names of its counters.
template <class Reason>
class Tally {
 public:
  void Add(Reason reason, std::int64_t n = 1) { counts_[static_cast<std::size_t>(reason)] += n; }
  void Add(const Tally& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  }
  std::int64_t operator[](Reason reason) const { return counts_[static_cast<std::size_t>(reason)]; }
  // Adds those above 0.
  void AddTo(Counters* counters) const {
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (counts_[i] > 0) (*counters)[NameOf(static_cast<Reason>(i))] += counts_[i];
  }

 private:
  std::array<std::int64_t, static_cast<std::size_t>(Reason::kCount)> counts_{};
};

}  // namespace seastitch
