#include "tools/ping_inputs.hpp"

#include <algorithm>
#include <utility>

#include "common/convert/channels.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/mbes_soundings_t.hpp"

namespace seastitch {

PingInputs::PingInputs(std::vector<std::string> names, bool each, Bus* bus)
    : each_(each), seen_(names.size(), false) {
  for (std::string& name : names) spans_.push_back({std::move(name), {}, {}});
  bus->Subscribe<mbes_ping_t>(channels::kMbesPing, 0, [this](const mbes_ping_t& ping) {
    Note(ping.utime, static_cast<std::uint32_t>(ping.ping_number), ping.head);
  });
  bus->Subscribe<mbes_soundings_t>(
      channels::kMbesSoundings, 0, [this](const mbes_soundings_t& ping) {
        Note(ping.utime, static_cast<std::uint32_t>(ping.ping_number), ping.head);
      });
}

void PingInputs::Note(std::int64_t utime, std::uint32_t number, int head) {
  SurveyInput& span = spans_[input_];
  const Time time = FromUtime(utime);
  span.first = seen_[input_] ? std::min(span.first, time) : time;
  span.last = seen_[input_] ? std::max(span.last, time) : time;
  seen_[input_] = true;
  if (each_) waiting_[{utime, number, head}] = static_cast<std::uint16_t>(input_);
}

std::vector<std::uint16_t> PingInputs::Take(const SubmapSoundings& submap) {
  std::vector<std::uint16_t> inputs;
  inputs.reserve(submap.pings.size());
  for (const SubmapSoundings::Ping& ping : submap.pings) {
    const auto found = waiting_.find({ToUtime(ping.time), ping.number, int{ping.head}});
    inputs.push_back(found == waiting_.end() ? std::uint16_t{0} : found->second);
    if (found != waiting_.end()) waiting_.erase(found);
  }
  return inputs;
}

}  // namespace seastitch
