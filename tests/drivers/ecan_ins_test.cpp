// SBG Systems' ECAN as an INS: frames made here from the maker's table, not by a codec of ours.
#include "drivers/nav/ecan_ins.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "common/core/pose.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr std::int64_t kStart = 1'700'000'000'000'000;  // 2023-11-14 22:13:20 UTC
constexpr std::int64_t kPeriodUs = 20'000;
constexpr std::uint32_t kCountAtStart = 5'000'000;
constexpr std::uint32_t kNominal = 4u | 0xF0u | 1u << 27;  // mode and all that is valid, aligned

enum Id : std::uint32_t {
  kStatus03 = 0x102,
  kUtc0 = 0x110,
  kUtc1 = 0x111,
  kInfo = 0x130,
  kEuler = 0x132,
  kEulerAcc = 0x133,
  kPos = 0x134,
  kAltitude = 0x135,
  kPosAcc = 0x136,
  kVelNed = 0x137,
  kVelNedAcc = 0x138,
};

template <class... Numbers>
CanFrame Frame(std::uint32_t id, Numbers... numbers) {
  ByteWriter data;
  (data.Le(numbers), ...);
  CanFrame frame;
  frame.id = id;
  frame.SetData(data.bytes());
  return frame;
}

std::int16_t I16(int value) { return static_cast<std::int16_t>(value); }
std::uint16_t U16(int value) { return static_cast<std::uint16_t>(value); }

std::uint32_t CountAt(int i) { return kCountAtStart + static_cast<std::uint32_t>(i * kPeriodUs); }

CanFrame Solution(std::uint32_t word) { return Frame(kStatus03, word, U16(0)); }

std::vector<CanFrame> Utc() {
  constexpr std::uint32_t kTimeOfWeekMs = 252'818'000;  // GPS was 18 s ahead of UTC
  const auto byte = [](int value) { return static_cast<std::uint8_t>(value); };
  return {Frame(kUtc0, kCountAtStart, kTimeOfWeekMs),
          Frame(kUtc1, byte(23), byte(11), byte(14), byte(22), byte(13), byte(20), U16(0))};
}

// Every value of epoch i has i in it.
std::vector<CanFrame> Epoch(int i) {
  return {Frame(kInfo, CountAt(i)),
          Frame(kEuler, I16(100 + i), I16(-200 - i), I16(10'000 + i)),
          Frame(kEulerAcc, U16(10 + i), U16(20 + i), U16(0)),
          Frame(kPos, std::int32_t{575'000'000 + i}, std::int32_t{-112'500'000 - i}),
          Frame(kAltitude, std::int32_t{-37'500 - i}, I16(8000 + i)),
          Frame(kPosAcc, U16(25 + i), U16(30 + i), U16(50 + i)),
          Frame(kVelNed, I16(150 + i), I16(-30 - i), I16(5 + i)),
          Frame(kVelNedAcc, U16(3 + i), U16(4 + i), U16(5 + i))};
}

void ExpectEpoch(const NavigationSample& sample, int i) {
  SCOPED_TRACE(i);
  ASSERT_TRUE(sample.attitude && sample.position && sample.height && sample.velocity);
  const Eigen::Vector3d rpy = RpyFromRotation(sample.attitude->q_ned_imu.toRotationMatrix());
  EXPECT_LT((rpy - 1e-4 * Eigen::Vector3d(100 + i, -200 - i, 10'000 + i)).norm(), 1e-9);
  EXPECT_LT((sample.attitude->sigma_rpy_rad - 1e-4 * Eigen::Vector3d(10 + i, 20 + i, 0.5)).norm(),
            1e-12)
      << "0 is below the step";
  EXPECT_NEAR(sample.position->latitude_rad, Deg2Rad(57.5 + 1e-7 * i), 1e-12);
  EXPECT_NEAR(sample.position->longitude_rad, Deg2Rad(-11.25 - 1e-7 * i), 1e-12);
  EXPECT_LT((sample.position->sigma_north_east_m - 0.01 * Eigen::Vector2d(25 + i, 30 + i)).norm(),
            1e-9);
  EXPECT_NEAR(sample.height->value_m, -37.5 - 0.001 * i + 40.0 + 0.005 * i, 1e-9);
  EXPECT_NEAR(sample.height->sigma_m, 0.01 * (50 + i), 1e-9);
  EXPECT_FALSE(sample.depth);
  const Eigen::Vector3d v_mps(1.5 + 0.01 * i, -0.3 - 0.01 * i, 0.05 + 0.01 * i);
  EXPECT_LT((sample.velocity->v_ned_mps - v_mps).norm(), 1e-9);
  EXPECT_LT((sample.velocity->sigma_ned_mps - 0.01 * Eigen::Vector3d(3 + i, 4 + i, 5 + i)).norm(),
            1e-9);
}

class EcanInsTest : public testing::Test {
 protected:
  static EcanInsParams Params(DeviceClock clock) {
    EcanInsParams params;
    params.signals = EcanSignals(Dbc::Load(ConfigFile("sbg_ecan.dbc")));
    params.clock.clock = clock;
    return params;
  }
  // Frames as they leave the INS, 100 us apart, each in a packet of its own.
  static std::vector<NavigationSample> Feed(EcanIns* ins,
                                            const std::vector<CanFrame>& frames,
                                            std::int64_t utime) {
    std::vector<NavigationSample> samples;
    for (const CanFrame& frame : frames)
      for (NavOutput& output : ins->Add(EncodeCannelloni({&frame, 1}, 0), FromUtime(utime += 100)))
        samples.push_back(std::get<NavigationSample>(std::move(output)));
    return samples;
  }
  std::vector<NavigationSample> FeedEpoch(int i, const std::vector<CanFrame>& frames) {
    return Feed(&ins, frames, kStart + 2000 + i * kPeriodUs);
  }

  EcanIns ins{Params(DeviceClock::kReceive)};
};

TEST_F(EcanInsTest, AnEpochIsASampleWithItsSigmasAtOnce) {
  EXPECT_TRUE(FeedEpoch(0, Epoch(0)).empty()) << "more may come of the first one";
  for (int i = 1; i < 50; ++i) {
    const auto samples = FeedEpoch(i, Epoch(i));
    ASSERT_EQ(samples.size(), i == 1 ? 2u : 1u);
    ExpectEpoch(samples.back(), i);
    if (i == 1) ExpectEpoch(samples[0], 0);
    EXPECT_EQ(samples.back().status, InsStatus::kUnknown);
    EXPECT_EQ(samples.back().source, "sbg_ecan");
    EXPECT_EQ(ToUtime(samples.back().time), kStart + 2100 + i * kPeriodUs) << "of EKF_INFO";
  }
  EXPECT_EQ(ins.messages(), 50);
  EXPECT_THAT(ins.counters(), testing::IsEmpty());
}

// Frames that were written down from the maker's document by another program.
TEST_F(EcanInsTest, ReadsGoldenFramesOfTheMakersTable) {
  SKIP_WITHOUT(Shared("vectors/can"));
  std::vector<CanFrame> frames;
  for (const auto& vector : ReadJson(Shared("vectors/can/sbg_ecan_vectors.json"))) {
    CanFrame& frame = frames.emplace_back();
    frame.id =
        static_cast<std::uint32_t>(std::stoul(vector["can_id"].get<std::string>(), nullptr, 16));
    frame.SetData(FromHex(vector["data"]));
  }
  frames.push_back(Frame(kInfo, std::uint32_t{123'476'789}));
  const auto samples = Feed(&ins, frames, kStart);
  ASSERT_EQ(samples.size(), 1u);
  const NavigationSample& sample = samples[0];
  EXPECT_EQ(sample.status, InsStatus::kAligning);
  EXPECT_NEAR(sample.position->latitude_rad, Deg2Rad(59.4267712), 1e-12);
  EXPECT_NEAR(sample.position->longitude_rad, Deg2Rad(-10.4692188), 1e-12);
  EXPECT_LT((sample.position->sigma_north_east_m - Eigen::Vector2d(0.25, 0.3)).norm(), 1e-12);
  EXPECT_NEAR(sample.height->value_m, -37.5 + 40.0, 1e-12);
  EXPECT_NEAR(sample.height->sigma_m, 655.35, 1e-12);
  EXPECT_LT((sample.velocity->v_ned_mps - Eigen::Vector3d(0.03, -1.25, 0.06)).norm(), 1e-12);
  EXPECT_LT((sample.velocity->sigma_ned_mps - Eigen::Vector3d(0.05, 0.06, 0.07)).norm(), 1e-12);
  const Eigen::Quaterniond q(RotationFromRpy(-3.1416, 0.7854, 3.1415));
  EXPECT_LT(q.angularDistance(sample.attitude->q_ned_imu), 1e-7);
  EXPECT_LT((sample.attitude->sigma_rpy_rad - Eigen::Vector3d(0.001, 0.002, 3.1416)).norm(), 1e-12);
}

TEST_F(EcanInsTest, TimeIsTheUnitsThroughItsUtcFramesAndOverTheWrapOfItsCount) {
  EcanIns by_device(Params(DeviceClock::kDevice));
  EXPECT_TRUE(Feed(&by_device, Epoch(0), kStart).empty());
  EXPECT_TRUE(Feed(&by_device, Epoch(1), kStart).empty());
  EXPECT_THAT(by_device.counters(), ElementsAre(Pair("unstamped", 2)));
  Feed(&by_device, Utc(), kStart + 3000);
  int given = 0;
  for (std::int64_t second = 1; second < 6000; second += 50) {
    std::vector<CanFrame> frames = Epoch(0);
    frames[0] = Frame(kInfo, static_cast<std::uint32_t>(kCountAtStart + second * 1'000'000));
    for (const NavigationSample& sample :
         Feed(&by_device, frames, kStart + 3000 + second * 1'000'000)) {
      EXPECT_EQ(ToUtime(sample.time), kStart + second * 1'000'000);
      ++given;
    }
  }
  EXPECT_EQ(given, 120);
}

// Whatever frame is lost, its own values are missing, or the epoch; nothing is of another epoch.
TEST_F(EcanInsTest, ALostFrameCostsItsOwnValues) {
  for (std::size_t lost = 0; lost < 8; ++lost) {
    SCOPED_TRACE(lost);
    EcanIns fresh(Params(DeviceClock::kModel));
    std::vector<NavigationSample> samples;
    for (int i = 0; i < 20; ++i) {
      std::vector<CanFrame> frames = Epoch(i);
      if (i == 10) frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(lost));
      for (NavigationSample& sample : Feed(&fresh, frames, kStart + i * kPeriodUs))
        samples.push_back(std::move(sample));
    }
    ASSERT_EQ(samples.size(), lost == 0 ? 19u : 20u);
    for (std::size_t at = 0; at < samples.size(); ++at) {
      const int i = static_cast<int>(at) + (lost == 0 && at >= 10 ? 1 : 0);
      if (lost == 0 || i != 10) {
        ExpectEpoch(samples[at], i);
        continue;
      }
      EXPECT_EQ(samples[at].attitude.has_value(), lost != 1);
      EXPECT_EQ(samples[at].position.has_value(), lost != 3);
      EXPECT_EQ(samples[at].height.has_value(), lost != 4);
      EXPECT_EQ(samples[at].velocity.has_value(), lost != 6);
      if (lost == 2) {
        EXPECT_EQ(samples[at].attitude->sigma_rpy_rad, Eigen::Vector3d::Zero());
      }
    }
    if (lost == 0) {
      EXPECT_EQ(fresh.counters().at("frame_outside_epoch"), 7);
    }
  }
}

TEST_F(EcanInsTest, RandomLossNeverMixesEpochs) {
  EXPECT_TRUE(rc::check([] {
    const auto dice = *rc::gen::container<std::vector<int>>(320, rc::gen::inRange(0, 10));
    const int odds = *rc::gen::inRange(1, 9);
    EcanIns fresh(Params(DeviceClock::kReceive));
    std::size_t die = 0;
    for (int i = 0; i < 40; ++i) {
      std::vector<CanFrame> frames = Epoch(i);
      std::erase_if(frames, [&](const CanFrame&) { return dice[die++] < odds; });
      for (const NavigationSample& s : Feed(&fresh, frames, kStart + i * kPeriodUs)) {
        std::vector<double> of;  // the epoch, by each value
        if (s.position) of.push_back((Rad2Deg(s.position->latitude_rad) - 57.5) / 1e-7);
        if (s.position && s.position->sigma_north_east_m.x() > 0.0)
          of.push_back(s.position->sigma_north_east_m.x() / 0.01 - 25.0);
        if (s.velocity) of.push_back((s.velocity->v_ned_mps.x() - 1.5) / 0.01);
        if (s.attitude)
          of.push_back(RpyFromRotation(s.attitude->q_ned_imu.toRotationMatrix()).x() / 1e-4 -
                       100.0);
        for (const double epoch : of) RC_ASSERT(std::abs(epoch - of[0]) < 0.1);
      }
    }
  }));
}

// Position at a tenth of the rate of attitude, as outputs may be set.
TEST_F(EcanInsTest, OutputsOfDifferentRatesAreAllGiven) {
  int attitudes = 0, positions = 0;
  for (int i = 0; i < 100; ++i) {
    std::vector<CanFrame> frames = Epoch(i);
    if (i % 10 != 3) frames.resize(3);
    for (const NavigationSample& sample : FeedEpoch(i, frames)) {
      attitudes += sample.attitude ? 1 : 0;
      positions += sample.position ? 1 : 0;
    }
  }
  EXPECT_EQ(attitudes, 99) << "the last one is open";
  EXPECT_EQ(positions, 10 - 1) << "the first one came when nobody expected it";
}

TEST_F(EcanInsTest, StatusIsWhatItsFilterSays) {
  int i = 0;
  const auto status = [&](std::uint32_t word) {
    FeedEpoch(i, {Solution(word)});
    for (int n = 0; n < 2; ++n) FeedEpoch(i, Epoch(i)), ++i;
    const auto samples = FeedEpoch(i, Epoch(i));
    ++i;
    return samples.back();
  };
  EXPECT_EQ(status(kNominal).status, InsStatus::kDeadReckoning);
  for (const int bit : {11, 15, 22, 24})
    EXPECT_EQ(status(kNominal | 1u << bit).status, InsStatus::kAided) << bit;
  EXPECT_EQ(status(kNominal | 1u << 19 | 1u << 28).status, InsStatus::kDeadReckoning)
      << "Doppler log and depth say no place";
  EXPECT_EQ(status(kNominal & ~(1u << 27)).status, InsStatus::kAligning);
  EXPECT_EQ(status((kNominal & ~0xFu) | 0).status, InsStatus::kInvalid);
  EXPECT_EQ(status((kNominal & ~0xFu) | 1).status, InsStatus::kInvalid);
  EXPECT_TRUE(status((kNominal & ~0xFu) | 3).position);
  EXPECT_THAT(ins.counters(), ElementsAre(Pair("not_computed", 6)));
  const NavigationSample attitude_only = status((kNominal & ~0xFu) | 2);
  EXPECT_TRUE(attitude_only.attitude);
  EXPECT_FALSE(attitude_only.position || attitude_only.velocity || attitude_only.height);
  i += 300;  // 6 s without STATUS_03
  EXPECT_EQ(FeedEpoch(i, Epoch(i)).back().status, InsStatus::kUnknown);
}

TEST_F(EcanInsTest, ItsAltitudeUnderWaterIsItsDepth) {
  EcanInsParams params = Params(DeviceClock::kReceive);
  params.altitude_is_depth = true;
  EcanIns under_water(params);
  Feed(&under_water, Epoch(0), kStart);
  const auto samples = Feed(&under_water, Epoch(1), kStart + kPeriodUs);
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_NEAR(samples[1].depth->value_m, 37.501, 1e-9);
  EXPECT_NEAR(samples[1].depth->sigma_m, 0.51, 1e-9);
  EXPECT_FALSE(samples[1].height);
}

TEST_F(EcanInsTest, IdsThatWereChangedInTheUnitAreChangedInTheFile) {
  std::string changed = TextOf(ConfigFile("sbg_ecan.dbc"));
  const std::string from = "BO_ 304 ", to = "BO_ 2566848768 ";  // 0x130 to 0x18FF0100, 29 bits
  changed.replace(changed.find(from), from.size(), to);
  EcanInsParams params;
  params.signals = EcanSignals(Dbc::Parse(changed, "changed.dbc"));
  params.clock.clock = DeviceClock::kReceive;
  EcanIns other(params);
  for (int i = 0; i < 2; ++i) {
    std::vector<CanFrame> frames = Epoch(i);
    frames[0].id = 0x18FF0100;
    frames[0].extended = true;
    for (const NavigationSample& sample : Feed(&other, frames, kStart + i * kPeriodUs))
      EXPECT_TRUE(sample.position);
  }
  EXPECT_EQ(other.messages(), 2);
  const auto has = [](const EcanIns& of, std::uint32_t id) {
    const auto filters = of.can_filters();
    return std::any_of(filters.begin(), filters.end(), [id](auto f) { return f.id == id; });
  };
  EXPECT_TRUE(has(other, 0x18FF0100));
  EXPECT_FALSE(has(other, 0x130));
  EXPECT_TRUE(has(ins, 0x130));
  EXPECT_THROW(EcanSignals(Dbc::Parse("BO_ 304 EKF_INFO: 4 X\n", "x.dbc")), std::runtime_error);
}

TEST_F(EcanInsTest, WhatCannotBeUsedIsCounted) {
  const auto add = [this](std::vector<CanFrame> frames) { FeedEpoch(0, frames); };
  EXPECT_EQ(ins.unused_messages(), "");
  add({Frame(kEuler, I16(1), I16(2), I16(3))});  // before any EKF_INFO
  EXPECT_THAT(ins.unused_messages(), testing::HasSubstr("without EKF_INFO"));
  add({Frame(kInfo, U16(1))});  // short
  add({Frame(0x123, I16(0))});  // not wanted
  add({Frame(kInfo, CountAt(0)), Frame(kInfo, CountAt(1))});
  add({Frame(kPos, std::int32_t{900'000'001}, std::int32_t{0})});
  add({Frame(kPos, std::int32_t{0}, std::int32_t{-1'800'000'001})});
  EXPECT_TRUE(ins.Add(FromHex("0200000001"), FromUtime(kStart)).empty());
  EXPECT_THAT(ins.counters(),
              ElementsAre(Pair("cannelloni_malformed", 1),
                          Pair("epoch_empty", 1),
                          Pair("frame_malformed", 3),
                          Pair("frame_outside_epoch", 1)));
}

}  // namespace
}  // namespace seastitch
