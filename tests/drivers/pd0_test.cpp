#include "drivers/dvl/pd0.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;
using Axes = Pd0Ensemble::Axes;

constexpr std::int64_t kStart = 1'700'000'000'250'000;

std::vector<ByteVector> RealEnsembles() {
  const ByteVector all = BytesOf(Shared("vectors/pd0_real/adcp_auv_3.pd0"));
  std::vector<ByteVector> ensembles;
  for (std::size_t at = 0; at < all.size(); at += 432)
    ensembles.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                           all.begin() + static_cast<std::ptrdiff_t>(at + 432));
  return ensembles;
}

DvlSample Sample() {
  DvlSample sample;
  sample.time = FromUtime(kStart);
  sample.bottom_lock = true;
  sample.v_dvl_mps = {1.5, -0.2, 0.05};
  sample.sigma_v_mps.setConstant(Pd0Params{}.sigma_mps);
  for (std::size_t beam = 0; beam < 4; ++beam)
    sample.beams[beam] = {true, 20.0 + static_cast<double>(beam), 0.0};
  return sample;
}

Pd0Decoder ReceiveClock() {
  Pd0Params params;
  params.clock = {DeviceClock::kReceive, 0.1};
  return Pd0Decoder(params);
}

TEST(Pd0, RealEnsemblesOfAnAuv) {
  SKIP_WITHOUT(Shared("vectors/pd0_real"));
  const nlohmann::json golden = ReadJson(Shared("vectors/pd0_real/adcp_auv_3.json"));
  const std::vector<ByteVector> ensembles = RealEnsembles();
  ASSERT_EQ(ensembles.size(), golden.size());
  for (std::size_t i = 0; i < ensembles.size(); ++i) {
    std::size_t size = 0;
    const auto e = DecodePd0(ensembles[i], &size);
    ASSERT_TRUE(e);
    EXPECT_EQ(size, golden[i]["bytes_in_ensemble"].get<std::size_t>() + 2);
    const auto& variable = golden[i]["variable"];
    EXPECT_EQ(e->number, variable["ensemble"]);
    EXPECT_EQ(e->axes, Axes::kShip);
    EXPECT_TRUE(e->levelled);
    EXPECT_NEAR(e->heading_rad, Deg2Rad(variable["heading_cdeg"].get<double>() / 100), 1e-12);
    EXPECT_NEAR(e->pitch_rad, Deg2Rad(variable["pitch_cdeg"].get<double>() / 100), 1e-12);
    EXPECT_NEAR(e->roll_rad, Deg2Rad(variable["roll_cdeg"].get<double>() / 100), 1e-12);
    const auto& track = golden[i]["bottom_track"];
    for (std::size_t beam = 0; beam < 4; ++beam) {
      EXPECT_EQ(e->velocity_mps[beam], track["velocity_mmps"][beam].get<double>() / 1000.0);
      EXPECT_EQ(e->range_m[beam], track["range_cm"][beam].get<double>() / 100.0);
      ASSERT_TRUE(e->correlation);
      EXPECT_EQ((*e->correlation)[beam], track["correlation"][beam].get<int>());
    }
  }
  // 2014-12-19 17:17:55.94.
  std::size_t size = 0;
  EXPECT_EQ(ToUtime(DecodePd0(ensembles[0], &size)->time), 1'419'009'475'940'000);
  // The vehicle went ahead.
  const DvlSample sample = ToDvlSample(*DecodePd0(ensembles[0], &size), Pd0Params{});
  EXPECT_TRUE(sample.bottom_lock);
  EXPECT_NEAR(sample.v_dvl_mps.norm(), std::sqrt(58.0 * 58 + 137 * 137 + 12 * 12) / 1000, 1e-9);
  EXPECT_NEAR(sample.v_dvl_mps.x(), 0.137, 0.003);
  EXPECT_NEAR(*sample.altitude_m, 14.2, 0.1);
  EXPECT_EQ(sample.error_velocity_mps, -0.003);
  for (const DvlBeam& beam : sample.beams) EXPECT_EQ(beam.quality, 1.0);
}

TEST(Pd0, EveryTruncationAndEveryChangedByteOfARealEnsembleIsRefused) {
  SKIP_WITHOUT(Shared("vectors/pd0_real"));
  const ByteVector whole = RealEnsembles()[0];
  std::size_t size = 0;
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_FALSE(DecodePd0(Bytes(whole).first(n), &size)) << n;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    ByteVector changed = whole;
    changed[at] ^= 0x10;
    EXPECT_FALSE(DecodePd0(changed, &size)) << at;
  }
}

TEST(Pd0, AnyEnsembleComesBack) {
  EXPECT_TRUE(rc::check([] {
    const auto whole = [](int low, int high) { return *rc::gen::inRange(low, high); };
    Pd0Ensemble e;
    e.number = *rc::gen::arbitrary<std::uint16_t>();
    e.time = FromUtime(1'000'000'000'000'000 + 10'000 * std::int64_t{whole(0, 2'000'000'000)});
    e.axes = static_cast<Axes>(whole(0, 4));
    e.levelled = *rc::gen::arbitrary<bool>();
    e.roll_rad = Deg2Rad(whole(-4000, 4000) / 100.0);
    e.pitch_rad = Deg2Rad(whole(-4000, 4000) / 100.0);
    e.heading_rad = Deg2Rad(whole(0, 36000) / 100.0);
    for (std::size_t i = 0; i < 4; ++i) {
      if (*rc::gen::arbitrary<bool>()) e.velocity_mps[i] = whole(-32767, 32768) / 1000.0;
      if (*rc::gen::arbitrary<bool>()) e.range_m[i] = whole(1, 16'777'216) / 100.0;
    }
    if (*rc::gen::arbitrary<bool>()) {
      e.correlation.emplace();
      for (std::uint8_t& beam : *e.correlation) beam = static_cast<std::uint8_t>(whole(1, 256));
    }
    const ByteVector bytes = EncodePd0(e);
    std::size_t size = 0;
    const auto decoded = DecodePd0(bytes, &size);
    RC_ASSERT(decoded.has_value());
    RC_ASSERT(size == bytes.size());
    RC_ASSERT(decoded->number == e.number);
    RC_ASSERT(decoded->time == e.time);
    RC_ASSERT(decoded->axes == e.axes);
    RC_ASSERT(decoded->levelled == e.levelled);
    RC_ASSERT(std::abs(decoded->roll_rad - e.roll_rad) < 1e-12);
    RC_ASSERT(std::abs(decoded->pitch_rad - e.pitch_rad) < 1e-12);
    RC_ASSERT(std::abs(decoded->heading_rad - e.heading_rad) < 1e-12);
    RC_ASSERT(decoded->velocity_mps == e.velocity_mps);
    RC_ASSERT(decoded->range_m == e.range_m);
    RC_ASSERT(decoded->correlation == e.correlation);
    for (std::size_t n = 0; n < bytes.size(); ++n)
      RC_ASSERT(!DecodePd0(Bytes(bytes).first(n), &size).has_value());
  }));
}

TEST(Pd0, InstrumentAxesAreOursButForSigns) {
  const DvlSample sample = Sample();
  const DvlSample back = ToDvlSample(ToPd0Ensemble(sample, Pd0Params{}), Pd0Params{});
  EXPECT_TRUE(back.bottom_lock);
  EXPECT_LT((back.v_dvl_mps - sample.v_dvl_mps).norm(), 1e-12);
  for (std::size_t beam = 0; beam < 4; ++beam)
    EXPECT_NEAR(back.beams[beam].range_m, sample.beams[beam].range_m, 1e-12);
}

TEST(Pd0, ErrorVelocityAndCorrelationAreGivenWhereTheLogGivesThem) {
  DvlSample sample = Sample();
  const DvlSample without = ToDvlSample(ToPd0Ensemble(sample, Pd0Params{}), Pd0Params{});
  EXPECT_FALSE(without.error_velocity_mps);
  EXPECT_FALSE(HasQuality(without));

  sample.error_velocity_mps = -0.012;
  for (DvlBeam& beam : sample.beams) beam.quality = 0.4;  // 102 of 255
  Pd0Ensemble e = ToPd0Ensemble(sample, Pd0Params{});
  const DvlSample with = ToDvlSample(e, Pd0Params{});
  EXPECT_NEAR(with.error_velocity_mps.value(), -0.012, 1e-12);
  for (const DvlBeam& beam : with.beams) EXPECT_NEAR(beam.quality.value(), 0.4, 1e-12);
}

// The fourth velocity of a log that gives its beams is a beam's. The scale is that of the device:
// 1 / (2 sqrt(2) sin 30 degrees).
TEST(Pd0, ErrorVelocityOfBeamVelocitiesIsTheDisagreementOfTheTwoPairs) {
  Pd0Ensemble e;
  e.axes = Axes::kBeam;
  e.velocity_mps = {0.3, 0.1, 0.5, -0.1};
  EXPECT_NEAR(ToDvlSample(e, Pd0Params{}).error_velocity_mps.value(), 0.0, 1e-12);
  e.velocity_mps[3] = 0.4;  // off by 0.5
  EXPECT_NEAR(ToDvlSample(e, Pd0Params{}).error_velocity_mps.value(), -0.353553, 1e-6);
}

TEST(Pd0, BeamVelocitiesBecomeThoseOfTheAxes) {
  // What each beam of a log that moves with v sees: the bottom comes nearer along it.
  const Eigen::Vector3d v(1.5, -0.2, 0.05);
  const Pd0Params params;
  const double s = std::sin(params.beam_angle_rad);
  const double c = std::cos(params.beam_angle_rad);
  Pd0Ensemble e;
  e.axes = Axes::kBeam;
  const Eigen::Vector3d port(0, -s, c), starboard(0, s, c), forward(s, 0, c), aft(-s, 0, c);
  e.velocity_mps = {port.dot(v), starboard.dot(v), forward.dot(v), aft.dot(v)};
  e.range_m = {10.0, 10.0, 10.0, 10.0};
  const DvlSample sample = ToDvlSample(e, params);
  EXPECT_LT((sample.v_dvl_mps - v).norm(), 1e-12);
  EXPECT_NEAR(sample.beams[2].velocity_mps, forward.dot(v), 1e-12);
  e.velocity_mps[3].reset();
  EXPECT_FALSE(ToDvlSample(e, params).bottom_lock);
}

TEST(Pd0, LevelledAndEarthVelocitiesAreTurnedBack) {
  const Eigen::Vector3d v(1.5, -0.2, 0.05);
  const double roll = Deg2Rad(8.0);
  const double pitch = Deg2Rad(-12.0);
  const double heading = Deg2Rad(250.0);
  for (const Axes axes : {Axes::kShip, Axes::kEarth}) {
    Pd0Ensemble e;
    e.axes = axes;
    e.levelled = true;
    e.roll_rad = roll;
    e.pitch_rad = std::atan(std::tan(pitch) / std::cos(roll));  // as its tilt sensor says
    e.heading_rad = heading;
    const Eigen::Vector3d turned =
        RotationFromRpy(roll, pitch, axes == Axes::kEarth ? heading : 0.0) * v;
    e.velocity_mps = {-turned.y(), -turned.x(), turned.z(), 0.0};
    EXPECT_LT((ToDvlSample(e, Pd0Params{}).v_dvl_mps - v).norm(), 1e-9);
  }
}

TEST(Pd0, WithoutBottomThereIsNoLockButAnEnsemble) {
  DvlSample sample = Sample();
  sample.bottom_lock = false;
  sample.beams[1].valid = false;
  const DvlSample back = ToDvlSample(ToPd0Ensemble(sample, Pd0Params{}), Pd0Params{});
  EXPECT_FALSE(back.bottom_lock);
  EXPECT_EQ(back.v_dvl_mps, Eigen::Vector3d::Zero());
  EXPECT_FALSE(back.beams[1].valid);
  EXPECT_FALSE(back.altitude_m);
}

// Of a DVL with a pressure sensor, if its sigma is configured.
TEST(Pd0, DepthIsGivenIfItsSigmaIs) {
  Pd0Params params;
  params.depth_sigma_m = 0.1;
  Pd0Decoder decoder(params);
  Pd0Ensemble e = ToPd0Ensemble(Sample(), Pd0Params{});
  e.time = FromUtime(kStart);
  e.depth_m = 1234.5;
  ByteVector bytes = EncodePd0(e);
  const std::size_t variable_at = bytes[8] + 256u * bytes[9];
  EXPECT_EQ(bytes[variable_at + 16] + 256u * bytes[variable_at + 17], 12'345u) << "0.1 m";
  const auto outputs = decoder.Add(bytes, FromUtime(kStart));
  ASSERT_EQ(outputs.size(), 1u);
  ASSERT_TRUE(outputs[0].depth);
  EXPECT_EQ(outputs[0].depth->time, outputs[0].dvl.time);
  EXPECT_EQ(outputs[0].depth->depth_m, 1234.5);
  EXPECT_EQ(outputs[0].depth->sigma_m, 0.1);
}

TEST(Pd0, DatagramsOfOneAndOfMoreEnsembles) {
  Pd0Decoder decoder = ReceiveClock();
  Pd0Ensemble e = ToPd0Ensemble(Sample(), Pd0Params{});
  ByteVector both = EncodePd0(e);
  ++e.number;
  e.time += std::chrono::milliseconds(200);
  const ByteVector second = EncodePd0(e);
  both.insert(both.end(), second.begin(), second.end());
  const auto samples = decoder.Add(both, FromUtime(kStart));
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(ToUtime(samples[0].dvl.time), kStart - 100'000);
  EXPECT_FALSE(samples[0].depth);
  EXPECT_TRUE(decoder.counters().empty());

  EXPECT_TRUE(decoder.Add(second, FromUtime(kStart)).empty());  // doubled on the way
  EXPECT_TRUE(decoder.Add({}, FromUtime(kStart)).empty());
  e.number += 4;
  e.time += std::chrono::milliseconds(800);
  EXPECT_EQ(decoder.Add(EncodePd0(e), FromUtime(kStart)).size(), 1u);
  EXPECT_EQ(decoder.counters(),
            (Counters{{"pd0_gaps", 3}, {"pd0_malformed", 1}, {"pd0_repeated", 1}}));
}

}  // namespace
}  // namespace seastitch
