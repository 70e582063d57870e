#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/placed_soundings.hpp"
#include "common/runtime/bus.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Which of the inputs of a replay each ping came from.
class PingInputs {
 public:
  // Listens to the pings on the bus. each: remembers every ping and not only the inputs' spans.
  PingInputs(std::vector<std::string> names, bool each, Bus* bus);
  PingInputs(const PingInputs&) = delete;
  PingInputs& operator=(const PingInputs&) = delete;

  // What comes from now on is of this one.
  void Reading(std::size_t input) { input_ = input; }
  // The inputs of these pings, by number; each ping once.
  std::vector<std::uint16_t> Take(const SubmapSoundings& submap);
  bool HasPings() const { return std::find(seen_.begin(), seen_.end(), true) != seen_.end(); }
  // Those that have pings, in their order, and those without.
  const std::vector<SurveyInput>& spans() const { return spans_; }

 private:
  using Key = std::tuple<std::int64_t, std::uint32_t, int>;  // time [us], number, head
  void Note(std::int64_t utime, std::uint32_t number, int head);

  const bool each_;
  std::size_t input_ = 0;
  std::vector<SurveyInput> spans_;
  std::vector<bool> seen_;  // pings of an input
  std::map<Key, std::uint16_t> waiting_;
};

}  // namespace seastitch
