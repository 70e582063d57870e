#include "common/runtime/bus.hpp"
#include "common/convert/stream_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <string>
#include <vector>

#include "seastitch/counter_t.hpp"
#include "seastitch/graph_request_t.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

counter_t Counter(const std::string& name, std::int64_t value) {
  counter_t msg{};
  msg.name = name;
  msg.value = value;
  return msg;
}

TEST(Bus, SaysWhatItCannotOpen) {
  EXPECT_THAT([] { Bus bus("carrierpigeon://"); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::StartsWith("cannot open LCM bus carrierpigeon://: ")));
}

TEST(Bus, DeliversInOrderAndAlsoWhatHandlersPublish) {
  Bus bus("memq://");
  std::vector<std::int64_t> got;
  bus.Subscribe<counter_t>("PING", 0, [&](const counter_t& msg) {
    if (msg.value < 5) bus.Publish("PING", Counter("p", msg.value + 1));
    got.push_back(msg.value);
  });
  bus.Publish("PING", Counter("p", 0));
  bus.Publish("PING", Counter("p", 3));
  bus.HandleAll();
  EXPECT_THAT(got, testing::ElementsAre(0, 3, 1, 4, 2, 5, 3, 4, 5));
  EXPECT_EQ(bus.publish_errors(), 0);
}

// A live process must end then, or it would spin on a descriptor that stays readable.
TEST(Bus, SaysThatItIsDead) {
  const TemporaryDir dir;
  const std::string path = (dir.path() / "two.lcmlog").string();
  {
    lcm::LogFile log(path, "w");
    counter_t msg = Counter("p", 1);
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    for (int i = 0; i < 2; ++i) {
      lcm::LogEvent event{};
      event.channel = "PING";
      event.timestamp = 1'000'000;
      event.data = bytes.data();
      event.datalen = static_cast<int>(bytes.size());
      log.writeEvent(&event);
    }
  }
  Bus bus("file://" + path + "?speed=0");
  int got = 0;
  bus.Subscribe<counter_t>("PING", 0, [&](const counter_t&) { ++got; });
  const auto handle_to_the_end = [&] {
    pollfd ready{bus.fd(), POLLIN, 0};
    while (poll(&ready, 1, 5000) > 0) bus.HandleAll(Bus::kBurst);
  };
  EXPECT_THAT(handle_to_the_end,
              testing::ThrowsMessage<std::runtime_error>(
                  testing::EndsWith("two.lcmlog?speed=0: nothing comes from it any more")));
  EXPECT_EQ(got, 2);
}

TEST(Bus, KeepsMoreThanLcmsThirtyMessages) {
  Bus bus("memq://");
  int got = 0;
  bus.Subscribe<counter_t>("PING", 0, [&](const counter_t&) { ++got; });
  for (int i = 0; i < 1000; ++i) bus.Publish("PING", Counter("p", i));
  bus.HandleAll();
  EXPECT_EQ(got, 1000);
}

TEST(Bus, CountsWhatDoesNotDecodeWhole) {
  Bus bus("memq://");
  int got = 0;
  bus.Subscribe<counter_t>("PING", 0, [&](const counter_t&) { ++got; });
  const counter_t msg = Counter("name", 1);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    bus.PublishBytes("PING", bytes.data(), size);
  bytes.push_back(0);
  bus.PublishBytes("PING", bytes.data(), bytes.size());
  bus.Publish("PING", graph_request_t{});  // another type
  bus.PublishBytes("PING", bytes.data(), bytes.size() - 1);
  bus.HandleAll();
  EXPECT_EQ(got, 1);
  EXPECT_EQ(bus.decode_errors(), static_cast<std::int64_t>(bytes.size()) + 1);
  EXPECT_EQ(bus.undecodable().at("PING"), bus.decode_errors());
}

TEST(Bus, GivesEveryChannelToAPattern) {
  Bus bus("memq://");
  std::vector<std::string> channels;
  bus.SubscribeBytes(
      ".*", 0, [&](const std::string& channel, const void*, int) { channels.push_back(channel); });
  bus.Publish("A", Counter("", 1));
  bus.Publish("B.C", Counter("", 2));
  bus.HandleAll();
  EXPECT_THAT(channels, testing::ElementsAre("A", "B.C"));
}

TEST(SequenceWatch, CountsWhatIsMissingAndForgivesARestart) {
  SequenceWatch watch;
  EXPECT_EQ(watch.Add(7), 0);  // joined late
  EXPECT_EQ(watch.Add(8), 0);
  EXPECT_EQ(watch.Add(11), 2);
  EXPECT_EQ(watch.Add(0), 0);
  EXPECT_EQ(watch.Add(1), 0);
  EXPECT_EQ(watch.Add(3), 1);
}

TEST(SequenceWatch, CountsNothingOfDamagedNumbers) {
  SequenceWatch watch;
  std::int64_t lost = 0;
  for (std::int64_t seq = 0; seq < 1000; ++seq) {
    if (seq == 300) lost += watch.Add(std::int64_t{1} << 62);
    if (seq == 400) lost += watch.Add(std::int64_t{1} << 52);
    if (seq == 500) lost += watch.Add(-7);
    if (seq == 600) lost += watch.Add(17);
    if (seq % 10 != 9) lost += watch.Add(seq);
  }
  EXPECT_EQ(lost, 99);
}

TEST(SequenceWatch, CountsALongLoss) {
  SequenceWatch watch;
  watch.Add(0);
  EXPECT_EQ(watch.Add(50'000), 0) << "not known yet";
  EXPECT_EQ(watch.Add(50'001), 49'999);
  EXPECT_EQ(watch.Add(50'003), 1);
}

}  // namespace
}  // namespace seastitch
