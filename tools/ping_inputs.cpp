#include "tools/ping_inputs.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/convert/channels.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/mbes_soundings_t.hpp"

namespace seastitch {

PingInputs::PingInputs(std::vector<std::string> names,
                       bool each,
                       double sonar_time_offset_s,
                       Bus* bus)
    : each_(each), seen_(names.size(), false) {
  for (std::string& name : names) spans_.push_back({std::move(name), {}, {}});
  bus->Subscribe<mbes_ping_t>(
      channels::kMbesPing, 0, [this, sonar_time_offset_s](const mbes_ping_t& ping) {
        Note(FromUtime(ping.utime),
             sonar_time_offset_s,
             static_cast<std::uint32_t>(ping.ping_number),
             ping.head);
      });
  bus->Subscribe<mbes_soundings_t>(
      channels::kMbesSoundings, 0, [this](const mbes_soundings_t& ping) {
        Note(FromUtime(ping.utime), 0.0, static_cast<std::uint32_t>(ping.ping_number), ping.head);
      });
}

void PingInputs::Note(Time time, double offset_s, std::uint32_t number, int head) {
  SurveyInput& span = spans_[input_];
  span.first = seen_[input_] ? std::min(span.first, time) : time;
  span.last = seen_[input_] ? std::max(span.last, time) : time;
  seen_[input_] = true;
  if (!each_) return;
  const std::int64_t utime = ToUtime(time + FromSeconds(offset_s));
  waiting_[{utime, number, head}] = static_cast<std::uint16_t>(input_);
}

std::vector<std::uint16_t> PingInputs::Take(const SubmapSoundings& submap) {
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
