// HEALTH names pings that no submap gets.

#include "mapper/health/ping_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <variant>
#include <vector>

#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

// A vehicle whose pings may be stamped or delivered wrongly.
class Pings : public testing::Test {
 protected:
  void Drive(double duration_s) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle_.Step(1.5, 0.0))
        std::visit([this](const auto& s) { Send(s); }, sample);
      for (; !late_.empty() && ToSeconds(vehicle_.time - late_.front().time) > kLateS;
           late_.erase(late_.begin()))
        mapper_.Add(late_.front());
    }
  }
  template <class Sample>
  void Send(const Sample& sample) {
    mapper_.Add(sample);
  }
  void Send(MbesPing ping) {
    ping.time += FromSeconds(ahead_s_);
    mapper_.Add(ping);
    ping.head = 1;
    if (second_sonar_is_late_) late_.push_back(ping);
  }
  std::string Refused() const {
    for (const Condition& condition : mapper_.conditions())
      if (condition.kind == &conditions::kPingsRefused) return condition.detail;
    return "";
  }

  static constexpr double kLateS = 1.5;  // longer than reorder_window_s
  PerfectVehicle vehicle_;
  Mapper mapper_{MapperParams{}};
  double ahead_s_ = 0.0;
  bool second_sonar_is_late_ = false;
  std::vector<MbesPing> late_;
};

TEST_F(Pings, ThatAreUsedAreNoFault) {
  for (int i = 0; i < 100; ++i) {
    Drive(1.0);
    EXPECT_EQ(Refused(), "");
  }
}

// Pings that came before navigation had started have no pose.
TEST_F(Pings, BeforeNavigationAreNoFault) {
  for (int i = 0; i < 100; ++i) {
    MbesPing ping;
    ping.time = vehicle_.time - FromSeconds(10.0 - 0.1 * i);
    mapper_.Add(ping);
  }
  vehicle_.sonar_on = false;
  Drive(20.0);
  EXPECT_EQ(mapper_.counters().at("pings_before_navigation"), 100);
  EXPECT_EQ(Refused(), "");
}

TEST_F(Pings, OfAClockThatIsAheadFromTheStartAreNamed) {
  ahead_s_ = 60.0;
  Drive(10.0);
  EXPECT_THAT(Refused(),
              HasSubstr("100 % of the last minute, mostly because their stamps are more "
                        "than 30 s ahead of navigation"));
  ahead_s_ = 0.0;
  Drive(70.0);
  EXPECT_EQ(Refused(), "") << "for a minute after the last";
}

TEST_F(Pings, OfASonarThatIsLaterThanTheOtherAreNamedSoon) {
  Drive(70.0);
  second_sonar_is_late_ = true;
  Drive(6.0);
  EXPECT_THAT(Refused(), HasSubstr("they came after a later ping was used"));
  Drive(70.0);
  EXPECT_THAT(Refused(), HasSubstr("50 % of the last minute"));
}

TEST(PingWatch, AFewAreNoFault) {
  PingWatch watch;
  PingTally lost;
  for (int s = 0; s < 200; ++s) {
    if (s % 10 == 0) lost.Add(PingLoss::kOutOfOrder);
    watch.Look(FromUtime(1'000'000 * s), 40 * s, lost);
  }
  EXPECT_TRUE(watch.conditions().empty()) << "one in 400";
}

}  // namespace
}  // namespace seastitch
