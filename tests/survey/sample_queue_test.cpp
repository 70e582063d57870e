#include "survey/read/sample_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <stdexcept>

#include "survey/read/read_ahead.hpp"

namespace seastitch {
namespace {

DepthSample Depth(double depth_m) { return {FromUtime(1'000'000), std::nullopt, depth_m, 0.1}; }

// As the messages of two drivers are numbered: each kind by itself.
TEST(SampleQueue, NumbersEachKindInItsOrder) {
  SampleQueue queue;
  queue.Put(Depth(1.0), FromUtime(5));
  queue.Put(ImuSample{}, FromUtime(6));
  queue.Put(Depth(2.0), FromUtime(7));
  for (const std::int64_t seq : {0, 0, 1}) EXPECT_EQ(queue.Take()->stamp.seq, seq);
  EXPECT_FALSE(queue.Take());
  EXPECT_TRUE(queue.Faults().empty());
}

TEST(SampleQueue, SplitsAPingAsItsMessagesDo) {
  SampleQueue queue;
  SoundingPing ping{FromUtime(1'000'000), 7, 0, {}};
  ping.soundings.resize(kMaxSoundings + 1);
  queue.Put(ping, FromUtime(5));
  const auto first = queue.Take(), second = queue.Take();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(std::get<SoundingPing>(first->sample).soundings.size(), 2048u);
  EXPECT_EQ(std::get<SoundingPing>(second->sample).soundings.size(), 1u);
  EXPECT_EQ(second->stamp.seq, 1);
}

TEST(SampleQueue, NamesWhatItRefuses) {
  SampleQueue queue;
  queue.Put(Depth(std::numeric_limits<double>::quiet_NaN()), FromUtime(5));
  queue.Put(Depth(3.0), FromUtime(6));
  EXPECT_EQ(queue.Take()->stamp.seq, 1) << "a lost number shows, as in messages";
  EXPECT_EQ(queue.counters(), (Counters{{"depth_malformed", 1}}));
  ASSERT_EQ(queue.Faults().size(), 1u);
  EXPECT_EQ(queue.Faults()[0].kind, &conditions::kMessagesMalformed);
}

// ---- reading ahead

// A source of depths 0, 1, 2 ..., from two inputs in turn.
class Depths : public SampleSource {
 public:
  Depths(int samples, bool ends_badly) : samples_(samples), ends_badly_(ends_badly) {}
  std::optional<Received> Next() override {
    if (given_ < samples_) return Received{Depth(given_++), {}};
    if (ends_badly_) throw std::runtime_error("depths.log: damaged");
    return std::nullopt;
  }
  std::size_t input() const override { return static_cast<std::size_t>((given_ - 1) % 2); }
  int percent_read() const override { return 100 * given_ / samples_; }
  Counters refused() const override { return {}; }
  int given() const { return given_; }

 private:
  const int samples_;
  const bool ends_badly_;
  std::atomic<int> given_ = 0;
};

TEST(ReadAhead, GivesTheSameSamplesInTheirOrder) {
  for (const int samples : {1, 63, 64, 65, 1000}) {
    Depths source(samples, false);
    ReadAhead ahead(&source);
    for (int i = 0; i < samples; ++i) {
      const auto item = ahead.Next();
      ASSERT_TRUE(item) << i;
      EXPECT_EQ(std::get<DepthSample>(item->sample.sample).depth_m, i);
      EXPECT_EQ(item->input, static_cast<std::size_t>(i % 2));
      EXPECT_GE(ahead.percent_read(), 100 * i / samples);
    }
    EXPECT_FALSE(ahead.Next());
    EXPECT_FALSE(ahead.Next());
    EXPECT_EQ(ahead.percent_read(), 100);
  }
}

TEST(ReadAhead, ThrowsWhereTheSourceDidAfterWhatWasReadBefore) {
  Depths source(100, true);
  ReadAhead ahead(&source);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(ahead.Next()) << i;
  EXPECT_THROW(ahead.Next(), std::runtime_error);
}

TEST(ReadAhead, ReadsNoMoreThanItHolds) {
  Depths source(1'000'000, false);
  {
    ReadAhead ahead(&source);
    EXPECT_TRUE(ahead.Next());
  }
  EXPECT_LT(source.given(), 1000);
}

}  // namespace
}  // namespace seastitch
