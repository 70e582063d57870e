#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/checked.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
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
      ++malformed_[NameOf(T{})];
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
  // Malformed samples, such as imu_malformed.
  Counters counters() const {
    Counters counters;
    for (const auto& [name, count] : malformed_) counters[name + "_malformed"] = count;
    return counters;
  }
  // Names them.
  std::vector<Condition> Faults() const {
    std::vector<Condition> faults;
    for (const auto& [name, count] : malformed_)
      faults.push_back({&conditions::kMessagesMalformed, std::to_string(count) + " of " + name});
    return faults;
  }

 private:
  std::deque<Received> queue_;
  std::array<std::int64_t, std::variant_size_v<Sample>> seqs_{};  // of the next, by kind
  std::map<std::string, std::int64_t> malformed_;                 // by kind
};

}  // namespace seastitch
