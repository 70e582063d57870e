#include "common/convert/message_inbox.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/core/channel_names.hpp"
#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

depth_t Depth(std::int64_t seq, double depth_m = 3.0) {
  return ToLcm(DepthSample{FromUtime(1'000'000 + seq), std::nullopt, depth_m, 0.1},
               {FromUtime(2'000'000 + seq), seq});
}
imu_t Imu(std::int64_t seq) {
  ImuSample sample;
  sample.time = FromUtime(1'000'000 + seq);
  return ToLcm(sample, {FromUtime(2'000'000 + seq), seq});
}

TEST(MessageInbox, GivesTheSampleAndItsStamp) {
  MessageInbox inbox;
  const auto received = inbox.Take(Depth(4), 0.0);
  ASSERT_TRUE(received);
  EXPECT_EQ(std::get<DepthSample>(received->sample).depth_m, 3.0);
  EXPECT_EQ(received->stamp.recv, FromUtime(2'000'004));
  EXPECT_EQ(received->stamp.seq, 4);
  EXPECT_TRUE(inbox.counters().empty());
}

TEST(MessageInbox, CountsLostMessages) {
  MessageInbox inbox;
  for (const std::int64_t seq : {0, 1, 4}) inbox.Take(Depth(seq), 0.0);
  EXPECT_EQ(inbox.counters(), (Counters{{"depth_lost", 2}}));
  EXPECT_TRUE(inbox.Faults(0.0).empty());
}

TEST(MessageInbox, NamesAMalformedMessageForTenSeconds) {
  MessageInbox inbox;
  EXPECT_FALSE(inbox.Take(Depth(0, std::numeric_limits<double>::infinity()), 100.0));
  EXPECT_EQ(inbox.counters(), (Counters{{"depth_malformed", 1}}));
  ASSERT_EQ(inbox.Faults(109.0).size(), 1u);
  EXPECT_EQ(inbox.Faults(109.0)[0].kind, &conditions::kMessagesMalformed);
  EXPECT_TRUE(inbox.Faults(111.0).empty());
}

// Two inertial units on one channel. A restarted driver, which begins at 0, is no second one.
TEST(MessageInbox, NamesASecondSenderAndTakesARestartedOne) {
  MessageInbox inbox;
  for (std::int64_t seq = 0; seq < 20; ++seq) {
    EXPECT_TRUE(inbox.Take(Imu(seq), 1.0));
    EXPECT_FALSE(inbox.Take(Imu(50'000 + seq), 1.0));
  }
  EXPECT_EQ(inbox.counters().at("imu_of_another_sender"), 20);
  ASSERT_EQ(inbox.Faults(2.0).size(), 1u);
  EXPECT_EQ(inbox.Faults(2.0)[0].kind, &conditions::kTwoSenders);

  MessageInbox restarted;
  for (std::int64_t seq = 100; seq < 120; ++seq) restarted.Take(Imu(seq), 1.0);
  int taken = 0;
  for (std::int64_t seq = 0; seq < 20; ++seq) taken += restarted.Take(Imu(seq), 1.0) ? 1 : 0;
  EXPECT_EQ(taken, 13) << "after seven messages";
  EXPECT_TRUE(restarted.Faults(1.0).empty());
}

TEST(MessageInbox, ReadsEncodedMessagesOfItsChannelsOnly) {
  MessageInbox inbox;
  const std::vector<std::uint8_t> depth = examples::Encoded(Depth(0));
  EXPECT_TRUE(inbox.Take(channels::kDepth, depth, 0.0));
  EXPECT_FALSE(inbox.Take(channels::kNav, depth, 0.0));
  EXPECT_FALSE(inbox.Take(channels::kDepth, Bytes(depth).first(depth.size() - 1), 0.0)) << "cut";
  EXPECT_FALSE(inbox.Take(channels::kImu, depth, 0.0)) << "of another type";
}

}  // namespace
}  // namespace seastitch
