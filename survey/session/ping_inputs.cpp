#include "survey/session/ping_inputs.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

namespace seastitch {

PingInputs::PingInputs(std::vector<std::string> names, bool each, double sonar_time_offset_s)
    : each_(each), sonar_time_offset_s_(sonar_time_offset_s), seen_(names.size(), false) {
  for (std::string& name : names) spans_.push_back({std::move(name), {}, {}});
}

void PingInputs::Add(const Sample& sample, std::size_t input) {
  std::visit(Overloaded{[&](const MbesPing& ping) { Note(ping, sonar_time_offset_s_, input); },
                        [&](const SoundingPing& ping) { Note(ping, 0.0, input); },
                        [](const auto&) {}},
             sample);
}

template <class Ping>
void PingInputs::Note(const Ping& ping, double offset_s, std::size_t input) {
  SurveyInput& span = spans_[input];
  span.first = seen_[input] ? std::min(span.first, ping.time) : ping.time;
  span.last = seen_[input] ? std::max(span.last, ping.time) : ping.time;
  seen_[input] = true;
  if (!each_) return;
  const std::int64_t utime = ToUtime(ping.time + FromSeconds(offset_s));
  waiting_[{utime, ping.ping_number, int{ping.head}}] = static_cast<std::uint16_t>(input);
}

std::vector<std::uint16_t> PingInputs::Take(const SubmapSoundings& submap) {
  if (!each_) return std::vector<std::uint16_t>(submap.pings.size(), 0);
  std::vector<std::uint16_t> inputs;
  inputs.reserve(submap.pings.size());
  for (const SubmapSoundings::Ping& ping : submap.pings) {
    const auto found = waiting_.find({ToUtime(ping.time), ping.number, int{ping.head}});
    inputs.push_back(found == waiting_.end() ? std::uint16_t{0} : found->second);
    if (found == waiting_.end()) ++unknown_;
  }
  // Pings come in the order of time: older ones that still wait are in no submap.
  if (!submap.pings.empty())
    waiting_.erase(waiting_.begin(),
                   waiting_.upper_bound({ToUtime(submap.pings.back().time),
                                         std::numeric_limits<std::uint32_t>::max(),
                                         std::numeric_limits<int>::max()}));
  return inputs;
}

}  // namespace seastitch
