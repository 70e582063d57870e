#include "mapper/input/ping_queue.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

Time At(double s) { return FromUtime(1'000'000'000) + FromSeconds(s); }

MbesPing PingAt(double s, float twtt_s = 0.0f) {
  MbesPing ping;
  ping.time = At(s);
  if (twtt_s > 0.0f) {
    MbesBeam beam;
    beam.twtt_s = twtt_s;
    beam.flags = kBeamValid;
    ping.beams.push_back(beam);
  }
  return ping;
}

TEST(PingQueue, WaitsForTheLastEcho) {
  PingQueue queue(10);
  queue.Add(PingAt(1.0, 0.5f));
  EXPECT_FALSE(queue.Take(At(1.4), At(1.4)));
  EXPECT_TRUE(queue.Take(At(1.6), At(1.6)));
  EXPECT_FALSE(queue.Take(At(9.0), At(9.0)));
}

TEST(PingQueue, PutsPingsInOrderOfTimeAndKeepsThatOfEqualTimes) {
  PingQueue queue(10);
  MbesPing second_head = PingAt(2.0);
  second_head.head = 1;
  queue.Add(PingAt(2.0));
  queue.Add(second_head);
  queue.Add(PingAt(1.0));
  EXPECT_EQ(queue.Take(At(5.0), At(5.0))->time, At(1.0));
  EXPECT_EQ(queue.Take(At(5.0), At(5.0))->head, 0);
  EXPECT_EQ(queue.Take(At(5.0), At(5.0))->head, 1);
}

TEST(PingQueue, IsBounded) {
  PingQueue queue(3);
  for (int i = 0; i < 10; ++i) queue.Add(PingAt(i));
  EXPECT_EQ(queue.size(), 3u);
  EXPECT_EQ(queue.dropped(), 7);
  EXPECT_EQ(queue.Take(At(20.0), At(20.0))->time, At(7.0));
}

TEST(PingQueue, IsNotHeldUpByAPingFromTheFuture) {
  PingQueue queue(10);
  queue.Add(PingAt(3600.0));
  queue.Add(PingAt(1.0));
  EXPECT_TRUE(queue.Take(At(2.0), At(2.0)));
  EXPECT_FALSE(queue.Take(At(2.0), At(2.0)));
  EXPECT_EQ(queue.from_the_future(), 1);
  queue.Add(PingAt(2.0 + 0.9 * PingQueue<>::kMaxAheadS));
  EXPECT_FALSE(queue.Take(At(2.0), At(2.0)));
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_TRUE(queue.TakeAny());
  EXPECT_FALSE(queue.TakeAny());
}

// After a gap in the inertial data its final states come later than its next samples.
TEST(PingQueue, WaitsForNavigationWhoseInputGoesOn) {
  PingQueue queue(10);
  queue.Add(PingAt(100.0));
  EXPECT_FALSE(queue.Take(At(2.0), At(100.0)));
  EXPECT_EQ(queue.from_the_future(), 0);
  EXPECT_TRUE(queue.Take(At(100.5), At(100.5)));
}

// In deep water the echoes of a ping come later than kMaxAheadS after it.
TEST(PingQueue, WaitsForTheLastEchoOfDeepWater) {
  PingQueue queue(10);
  queue.Add(PingAt(1.0, 39.0f));
  EXPECT_FALSE(queue.Take(At(1.0), At(1.0)));
  EXPECT_FALSE(queue.Take(At(39.9), At(39.9)));
  EXPECT_TRUE(queue.Take(At(40.1), At(40.1)));
  EXPECT_EQ(queue.from_the_future(), 0);
}

}  // namespace
}  // namespace seastitch
