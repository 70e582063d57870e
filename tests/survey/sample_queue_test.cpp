#include "survey/read/sample_queue.hpp"

#include <gtest/gtest.h>

#include <limits>

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

}  // namespace
}  // namespace seastitch
