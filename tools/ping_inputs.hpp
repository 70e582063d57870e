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

// Remembers from which input of a replay each ping came.
class PingInputs {
 public:
  // Receives the pings on the bus. each: remembers every ping, not only the time spans of the
  // inputs. sonar_time_offset_s: the mapper's correction of the stamps of MBES_PING.
  PingInputs(std::vector<std::string> names, bool each, double sonar_time_offset_s, Bus* bus);
  PingInputs(const PingInputs&) = delete;
  PingInputs& operator=(const PingInputs&) = delete;

  // Sets the number of the input that is read from now on.
  void Reading(std::size_t input) { input_ = input; }
  // The numbers of these pings' inputs; a ping can be asked for once. An unknown ping gives 0 and
  // is counted.
  std::vector<std::uint16_t> Take(const SubmapSoundings& submap);
  bool HasPings() const { return std::find(seen_.begin(), seen_.end(), true) != seen_.end(); }
  std::int64_t unknown() const { return unknown_; }
  // The inputs with pings, in their order, and those without.
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
