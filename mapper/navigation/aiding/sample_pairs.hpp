#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>

#include "common/core/time.hpp"
#include "mapper/navigation/nav_events.hpp"

namespace seastitch {

// Pairs of samples of one sensor about a second apart, far enough that a change exceeds the noise
// of both. A pair is passed on with the first sample of this sensor that is wait_s later; by then
// the inertial data reach as far.
template <class Sample>
class SamplePairs {
 public:
  static constexpr double kLeastS = 0.95;  // 1 Hz, and some jitter
  static constexpr double kMostS = 2.5;

  explicit SamplePairs(double wait_s) : wait_s_(wait_s) {}

  void Clear() {
    samples_.clear();
    next_ = 1;
  }

  // Calls use(from, to, share) for those pairs that are complete. share: part of the span that no
  // earlier pair covered, 0 to 1.
  template <class Use>
  void Add(Time t, const Sample& sample, const Use& use) {
    samples_.push_back({t, sample});
    for (; next_ < samples_.size() && SpanS(next_, samples_.size() - 1) >= wait_s_; ++next_) {
      while (SpanS(1, next_) >= kLeastS) {
        samples_.pop_front();
        --next_;
      }
      const double span_s = SpanS(0, next_);
      if (span_s >= kLeastS && span_s <= kMostS)
        use(samples_.front(), samples_[next_], std::min(1.0, SpanS(next_ - 1, next_) / span_s));
    }
  }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.samples_, self.next_);
  }

 private:
  double SpanS(std::size_t a, std::size_t b) const {
    return ToSeconds(samples_[b].time - samples_[a].time);
  }

  const double wait_s_;
  std::deque<Stamped<Sample>> samples_;
  std::size_t next_ = 1;  // the first that has not been given as `to`
};

}  // namespace seastitch
