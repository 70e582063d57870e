// Dead reckoning that is saved, and goes on in a new object.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/fault_cases.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"

namespace seastitch::test {
namespace {

struct SoundSpeedSample {
  Time time;
  double speed_mps;
};
using AnySample = std::variant<SoundSpeedSample, DvlSample, DepthSample, PositionFix, ImuSample>;

Time TimeOf(const AnySample& sample) {
  return std::visit([](const auto& s) { return s.time; }, sample);
}

// In order of time but for what a bus does to it.
std::vector<AnySample> SamplesOf(const Dive& dive, std::uint32_t seed) {
  std::vector<AnySample> samples;
  samples.insert(samples.end(), dive.imu.begin(), dive.imu.end());
  samples.insert(samples.end(), dive.dvl.begin(), dive.dvl.end());
  samples.insert(samples.end(), dive.depth.begin(), dive.depth.end());
  samples.insert(samples.end(), dive.fixes.begin(), dive.fixes.end());
  for (std::size_t i = 0; i < dive.imu.size(); i += 3000)
    samples.push_back(SoundSpeedSample{dive.imu[i].time, 1480.0 + static_cast<double>(i % 7)});
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> delay_s(0.0, 0.3);
  std::vector<std::pair<Time, std::size_t>> order;
  for (std::size_t i = 0; i < samples.size(); ++i)
    order.emplace_back(TimeOf(samples[i]) + FromSeconds(delay_s(random)), i);
  std::sort(order.begin(), order.end());
  std::vector<AnySample> as_received;
  for (const auto& [time, i] : order) as_received.push_back(samples[i]);
  return as_received;
}

void Feed(const AnySample& sample, DeadReckoning* navigation) {
  if (const auto* water = std::get_if<SoundSpeedSample>(&sample))
    return navigation->AddSoundSpeed(water->time, water->speed_mps);
  std::visit(
      [&](const auto& s) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(s)>, SoundSpeedSample>)
          navigation->Add(s);
      },
      sample);
}

// With a fix now and then, of which one in three is wrong.
void AddFixes(Dive* dive) {
  constexpr double kMPerRad = 6.37e6;
  for (std::size_t i = 20; i < dive->truth.size(); i += 23) {
    const Eigen::Vector3d p = dive->truth[i].T_map_vehicle.translation();
    const double off_m = i % 3 == 0 ? 60.0 : 0.5;
    PositionFix fix;
    fix.time = dive->truth[i].time;
    fix.latitude_rad = dive->vehicle.datum.latitude_rad + (p.x() + off_m) / kMPerRad;
    fix.longitude_rad = dive->vehicle.datum.longitude_rad +
                        p.y() / (kMPerRad * std::cos(dive->vehicle.datum.latitude_rad));
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    fix.source = i % 2 == 0 ? "usbl" : "gps";
    dive->fixes.push_back(fix);
  }
}

// What anybody can see of it now, to the last bit.
void ExpectSame(const DeadReckoning& one, const DeadReckoning& other) {
  ASSERT_EQ(one.latest(), other.latest());
  const auto same_state = [](const std::optional<NavState>& a, const std::optional<NavState>& b) {
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) return;
    EXPECT_EQ(a->time, b->time);
    EXPECT_TRUE(a->T_map_vehicle.matrix() == b->T_map_vehicle.matrix());
    EXPECT_TRUE(a->v_map_mps == b->v_map_mps);
    EXPECT_TRUE(a->covariance == b->covariance);
    EXPECT_EQ(a->bottom_lock, b->bottom_lock);
  };
  same_state(one.StateAt(*one.latest()), other.StateAt(*one.latest()));
  same_state(one.Predicted(), other.Predicted());
  EXPECT_EQ(one.place_is_known(), other.place_is_known());
  EXPECT_EQ(one.start_state(), other.start_state());
  for (const NavSensor sensor :
       {NavSensor::kAttitude, NavSensor::kDvl, NavSensor::kDepth, NavSensor::kPositionFix}) {
    EXPECT_EQ(one.health(sensor).refused_share, other.health(sensor).refused_share);
    EXPECT_EQ(one.health(sensor).refused_since, other.health(sensor).refused_since);
    EXPECT_EQ(one.innovations(sensor).used, other.innovations(sensor).used);
    EXPECT_EQ(one.innovations(sensor).lag_one, other.innovations(sensor).lag_one);
  }
  const auto suspected = one.suspected_offsets();
  const auto also = other.suspected_offsets();
  ASSERT_EQ(suspected.size(), also.size());
  for (std::size_t i = 0; i < suspected.size(); ++i) EXPECT_EQ(suspected[i].add_s, also[i].add_s);
}

void ExpectSameRelative(Time since, const DeadReckoning& one, const DeadReckoning& other) {
  const auto a = one.RelativeCovariance(since, *one.latest());
  const auto b = other.RelativeCovariance(since, *one.latest());
  ASSERT_EQ(a.has_value(), b.has_value());
  if (!a) return;
  EXPECT_TRUE(a->isApprox(*b, 1e-9)) << *a << "\n\n" << *b;
}

struct RestartCase {
  FaultCase fault;
  bool fuse_fixes = false;
};

class Restart : public testing::TestWithParam<RestartCase> {};

// Saved at drawn moments, restored into a new object; both are fed what follows. What a sample
// changes that is not saved shows here.
TEST_P(Restart, GoesOnToTheLastBit) {
  Dive dive = SimulatedDive(3);
  dive.params.fuse_position_fixes = GetParam().fuse_fixes;
  dive.params.dvl_sound_speed_mps = 1500.0;
  GetParam().fault.apply(&dive);
  AddFixes(&dive);
  const std::vector<AnySample> samples = SamplesOf(dive, 7);
  DeadReckoning navigation(dive.params, dive.vehicle);
  DeadReckoning other(dive.params, dive.vehicle);
  std::mt19937 random(11);
  std::uniform_int_distribution<std::size_t> spacing(200, samples.size() / 12);
  std::size_t save_at = spacing(random);
  int restarts = 0;
  Time since;
  for (std::size_t i = 0; i < samples.size() && !HasFatalFailure(); ++i) {
    Feed(samples[i], &navigation);
    if (restarts > 0) Feed(samples[i], &other);
    if (restarts > 0 && i % 50 == 0) {
      SCOPED_TRACE(i);
      ExpectSame(navigation, other);
      ExpectSameRelative(since, navigation, other);
    }
    if (i < save_at || !navigation.latest()) continue;
    save_at = i + spacing(random);
    since = std::max(*navigation.latest() - FromSeconds(40.0),
                     dive.imu.front().time + FromSeconds(5.0));
    const auto saved = navigation.Save(since);
    ASSERT_TRUE(saved);
    EXPECT_LT(saved->size(), 400'000U);
    other = DeadReckoning(dive.params, dive.vehicle);
    ASSERT_TRUE(other.Restore(*saved));
    const auto again = other.Save(since);
    ASSERT_TRUE(again);
    EXPECT_TRUE(*again == *saved);
    ExpectSame(navigation, other);
    ++restarts;
  }
  EXPECT_GT(restarts, 10);
  const auto fixes = navigation.TakeFixes(*navigation.latest());
  const auto also = other.TakeFixes(*navigation.latest());
  ASSERT_EQ(fixes.size(), also.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) EXPECT_EQ(fixes[i].time, also[i].time);
}

FaultCase NoFault() {
  return {"none", [](Dive*) {}};
}

INSTANTIATE_TEST_SUITE_P(
    Faults,
    Restart,
    testing::Values(RestartCase{NoFault(), false},
                    RestartCase{NoFault(), true},
                    RestartCase{LateAttitude(0.45), false},
                    RestartCase{LateDvl(0.5), true},
                    RestartCase{AttitudeEvery(1.0), false},
                    RestartCase{HeadingStep(20.0, 195.0, 315.0), true},
                    RestartCase{WrongVelocities(195.0, 60.0), false},
                    RestartCase{Stuck(StuckSensor::kGyro, 195.0, 40.0), false},
                    RestartCase{Stuck(StuckSensor::kAccelerometer, 195.0, 120.0), true},
                    RestartCase{Stuck(StuckSensor::kAttitude, 195.0, 120.0), false},
                    RestartCase{InertialGap(195.0, 60.0), true}),
    [](const auto& test) { return "Case" + std::to_string(test.index); });

}  // namespace
}  // namespace seastitch::test
