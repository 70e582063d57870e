#include "tools/ping_inputs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/convert/channels.hpp"
#include "common/runtime/bus.hpp"
#include "seastitch/mbes_ping_t.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;

mbes_ping_t PingAt(std::int64_t utime, int number) {
  mbes_ping_t ping{};
  ping.utime = utime;
  ping.ping_number = number;
  return ping;
}

SubmapSoundings Submap(const std::vector<std::pair<std::int64_t, std::uint32_t>>& pings) {
  SubmapSoundings submap;
  for (const auto& [utime, number] : pings) {
    SubmapSoundings::Ping& ping = submap.pings.emplace_back();
    ping.time = FromUtime(utime);
    ping.number = number;
  }
  return submap;
}

TEST(PingInputs, KnowsThePingsThatTheMapperMovedInTime) {
  Bus bus("memq://");
  PingInputs inputs({"a", "b"}, true, 0.022, &bus);
  bus.Publish(channels::kMbesPing, PingAt(1'000'000, 1));
  bus.HandleAll();
  inputs.Reading(1);
  bus.Publish(channels::kMbesPing, PingAt(2'000'000, 2));
  bus.HandleAll();
  EXPECT_THAT(inputs.Take(Submap({{1'022'000, 1}, {2'022'000, 2}})), ElementsAre(0, 1));
  EXPECT_EQ(inputs.unknown(), 0);
}

TEST(PingInputs, CountsWhatItDoesNotKnowAndForgetsWhatIsInNoSubmap) {
  Bus bus("memq://");
  PingInputs inputs({"a", "b"}, true, 0.0, &bus);
  inputs.Reading(1);
  for (int n = 1; n <= 3; ++n) {
    bus.Publish(channels::kMbesPing, PingAt(n * 1'000'000, n));
    bus.HandleAll();
  }
  EXPECT_THAT(inputs.Take(Submap({{2'000'000, 2}})), ElementsAre(1));
  EXPECT_THAT(inputs.Take(Submap({{1'000'000, 1}, {3'000'000, 3}})), ElementsAre(0, 1));
  EXPECT_EQ(inputs.unknown(), 1);
}

}  // namespace
}  // namespace seastitch
