#include "survey/session/ping_inputs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace seastitch {
namespace {

using testing::ElementsAre;

MbesPing PingAt(std::int64_t utime, std::uint32_t number) {
  MbesPing ping;
  ping.time = FromUtime(utime);
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
  PingInputs inputs({"a", "b"}, true, 0.022);
  inputs.Add(PingAt(1'000'000, 1), 0);
  inputs.Add(PingAt(2'000'000, 2), 1);
  EXPECT_THAT(inputs.Take(Submap({{1'022'000, 1}, {2'022'000, 2}})), ElementsAre(0, 1));
  EXPECT_EQ(inputs.unknown(), 0);
}

TEST(PingInputs, CountsWhatItDoesNotKnowAndForgetsWhatIsInNoSubmap) {
  PingInputs inputs({"a", "b"}, true, 0.0);
  for (std::uint32_t n = 1; n <= 3; ++n) inputs.Add(PingAt(n * 1'000'000, n), 1);
  EXPECT_THAT(inputs.Take(Submap({{2'000'000, 2}})), ElementsAre(1));
  EXPECT_THAT(inputs.Take(Submap({{1'000'000, 1}, {3'000'000, 3}})), ElementsAre(0, 1));
  EXPECT_EQ(inputs.unknown(), 1);
}

}  // namespace
}  // namespace seastitch
