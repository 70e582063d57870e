#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "common/core/checked.hpp"
#include "common/core/counters.hpp"
#include "common/core/sample.hpp"

namespace seastitch {

// Samples that are made in this process, as messages would hold them: checked, split and numbered.
class SampleQueue {
 public:
  // A malformed sample is counted.
  template <class T>
  void Put(T sample, Time recv) {
    const std::int64_t seq = seqs_[Sample(std::in_place_type<T>).index()]++;
    if (auto checked = Checked(std::move(sample)))
      queue_.push_back({*std::move(checked), {recv, seq}});
    else
      ++malformed_[std::string(NameOf(T{})) + "_malformed"];
  }
  void Put(SoundingPing ping, Time recv) {
    for (SoundingPing& part : Split(std::move(ping))) Put<SoundingPing>(std::move(part), recv);
  }
  void Put(Sample sample, Time recv) {
    std::visit(Overloaded{[&](Heartbeat&) {}, [&](auto& s) { Put(std::move(s), recv); }}, sample);
  }

  std::optional<Received> Take() {
    if (queue_.empty()) return std::nullopt;
    Received first = std::move(queue_.front());
    queue_.pop_front();
    return first;
  }
  const Counters& malformed() const { return malformed_; }

 private:
  std::deque<Received> queue_;
  std::array<std::int64_t, std::variant_size_v<Sample>> seqs_{};  // of the next, by kind
  Counters malformed_;
};

}  // namespace seastitch
