#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/placed_soundings.hpp"
#include "common/core/sample.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Remembers from which input of a replay each ping came.
class PingInputs {
 public:
  // each: remembers every ping, not only the time spans of the inputs. sonar_time_offset_s: the
  // mapper's correction of the stamps of pings that it places itself.
  PingInputs(std::vector<std::string> names, bool each, double sonar_time_offset_s);

  // Notes a ping of this input; other samples are nothing to it.
  void Add(const Sample& sample, std::size_t input);
  // The numbers of these pings' inputs; a ping can be asked for once. An unknown ping gives 0 and
  // is counted. Without `each` all are 0.
  std::vector<std::uint16_t> Take(const SubmapSoundings& submap);
  bool HasPings() const { return std::find(seen_.begin(), seen_.end(), true) != seen_.end(); }
  std::int64_t unknown() const { return unknown_; }
  // The inputs with pings, in their order, and those without.
  const std::vector<SurveyInput>& spans() const { return spans_; }

 private:
  using Key = std::tuple<std::int64_t, std::uint32_t, int>;  // time [us], number, head
  template <class Ping>
  void Note(const Ping& ping, double offset_s, std::size_t input);

  const bool each_;
  const double sonar_time_offset_s_;
  std::vector<SurveyInput> spans_;
  std::vector<bool> seen_;  // pings of an input
  std::map<Key, std::uint16_t> waiting_;
  std::int64_t unknown_ = 0;
};

}  // namespace seastitch
