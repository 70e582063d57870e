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
  // sonar_time_offset_s: that the mapper adds to the stamps of MBES_PING.
  PingInputs(std::vector<std::string> names, bool each, double sonar_time_offset_s, Bus* bus);
  PingInputs(const PingInputs&) = delete;
  PingInputs& operator=(const PingInputs&) = delete;

  // What comes from now on is of this one.
  void Reading(std::size_t input) { input_ = input; }
  // The inputs of these pings, by number; each ping once. 0 for one that is not known, and counted.
  std::vector<std::uint16_t> Take(const SubmapSoundings& submap);
  bool HasPings() const { return std::find(seen_.begin(), seen_.end(), true) != seen_.end(); }
  std::int64_t unknown() const { return unknown_; }
  // Those that have pings, in their order, and those without.
  const std::vector<SurveyInput>& spans() const { return spans_; }

 private:
  using Key = std::tuple<std::int64_t, std::uint32_t, int>;  // time [us], number, head
  void Note(Time time, double offset_s, std::uint32_t number, int head);

  const bool each_;
  std::size_t input_ = 0;
  std::vector<SurveyInput> spans_;
  std::vector<bool> seen_;  // pings of an input
  std::map<Key, std::uint16_t> waiting_;
  std::int64_t unknown_ = 0;
};

}  // namespace seastitch
