#include "drivers/dvl/dvl_can.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/dvl/dvl_driver.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'123'456;

DvlCanParams Shipped() { return LoadDvlDriverConfig(ConfigFile("dvl_driver.yaml")).can; }

DvlSample Dvl(int i) {
  DvlSample sample;
  sample.time = FromUtime(kStart + 200'000 * i);
  sample.bottom_lock = true;
  sample.v_dvl_mps = {1.5 + 0.0002 * i, -0.25, 0.01};
  sample.sigma_v_mps = {0.003, 0.004, 0.002};
  for (std::size_t b = 0; b < 4; ++b) {
    const auto number = static_cast<double>(b);
    sample.beams[b] = {b != 2, b != 2 ? 30.0 + number : 0.0, b != 2 ? 0.5 - 0.25 * number : 0.0};
  }
  sample.altitude_m = 27.125;
  return sample;
}

DepthSample Depth(int i) {
  DepthSample sample;
  sample.time = Dvl(i).time;
  sample.pressure_pa = 201'234.5;
  sample.depth_m = 20.0123 + 0.5 * i;
  sample.sigma_m = 0.02;
  return sample;
}

void ExpectSame(const DvlSample& a, const DvlSample& b) {
  EXPECT_EQ(ToUtime(a.time), ToUtime(b.time));
  EXPECT_EQ(a.bottom_lock, b.bottom_lock);
  EXPECT_LT((a.v_dvl_mps - b.v_dvl_mps).norm(), 1e-9);
  EXPECT_LT((a.sigma_v_mps - b.sigma_v_mps).norm(), 1e-9);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(a.beams[i].valid, b.beams[i].valid);
    EXPECT_NEAR(a.beams[i].range_m, b.beams[i].range_m, 1e-9);
    EXPECT_NEAR(a.beams[i].velocity_mps, b.beams[i].velocity_mps, 1e-9);
  }
  ASSERT_EQ(a.altitude_m.has_value(), b.altitude_m.has_value());
  if (a.altitude_m) {
    EXPECT_NEAR(*a.altitude_m, *b.altitude_m, 1e-9);
  }
}

class DvlCan : public testing::Test {
 protected:
  struct Output {
    std::vector<DvlSample> dvl;
    std::vector<DepthSample> depth;
  };
  Output Feed(const std::vector<CanFrame>& frames, Time recv) {
    Output all;
    for (const CanFrame& frame : frames) {
      const DvlOutput out = decoder.Add(frame, recv += Duration(200));
      if (out.dvl) all.dvl.push_back(*out.dvl);
      if (out.depth) all.depth.push_back(*out.depth);
    }
    return all;
  }
  std::int64_t Count(const std::string& name) {
    const Counters counters = decoder.counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }

  const DvlCanParams params = Shipped();
  DvlCanDecoder decoder{params};
  DvlCanEncoder encoder{params.signals};
};

TEST_F(DvlCan, FramesAreThoseOfTheDocument) {
  const std::vector<CanFrame> frames = encoder.Encode(Dvl(0), Depth(0));
  std::vector<std::string> bytes;
  for (const CanFrame& frame : frames) {
    char text[32];
    std::string line;
    for (const std::uint8_t byte : frame.data()) {
      std::snprintf(text, sizeof text, "%02X", byte);
      line += text;
    }
    std::snprintf(text, sizeof text, "%03X#", frame.id);
    bytes.push_back(text + line);
  }
  // By hand from docs/dvl_can.md, for the values of Dvl(0) and Depth(0).
  const std::vector<std::string> expected = {"300#00F1536540E20100",  // 1700000000, 123456
                                             "301#F824C1F2FCF40110",  // 75000, -12500, 500, lock
                                             "302#9600C8006400",      // 150, 200, 100
                                             "303#701738180000C819",  // 6000, 6200, 0, 6600
                                             "304#F56900001B",        // 27125; 1, 2, 4, altitude
                                             "305#C409E20400001EFB",  // 2500, 1250, 0, -1250
                                             "308#B9B41E00",          // 2012345
                                             "309#BB0D0300C800"};     // 200123, 200
  EXPECT_EQ(bytes, expected);
}

TEST_F(DvlCan, EnsemblesComeBack) {
  for (int i = 0; i < 20; ++i) {
    const Output out = Feed(encoder.Encode(Dvl(i), Depth(i)), Dvl(i).time);
    ASSERT_EQ(out.dvl.size(), 1u);
    ASSERT_EQ(out.depth.size(), 1u);
    ExpectSame(out.dvl[0], Dvl(i));
    EXPECT_EQ(out.depth[0].time, Depth(i).time);
    EXPECT_NEAR(out.depth[0].pressure_pa.value(), Depth(i).pressure_pa.value(), 1e-6);
    EXPECT_NEAR(out.depth[0].depth_m, Depth(i).depth_m, 1e-9);
    EXPECT_NEAR(out.depth[0].sigma_m, Depth(i).sigma_m, 1e-9);
  }
  EXPECT_TRUE(decoder.counters().empty());
}

// A gateway that sends what the shipped table lacks.
TEST(DvlCanSignals, QualityAndErrorVelocityComeBackWhereTheyAreMapped) {
  const TemporaryDir dir;
  const Dbc dbc =
      Dbc::Load(dir.Write("more.dbc",
                          "BO_ 784 DVL_QUALITY: 6 GATEWAY\n"
                          " SG_ Q1 : 0|8@1+ (0.5,0) [0|100] \"%\" V\n"
                          " SG_ Q2 : 8|8@1+ (0.5,0) [0|100] \"%\" V\n"
                          " SG_ Q3 : 16|8@1+ (0.5,0) [0|100] \"%\" V\n"
                          " SG_ Q4 : 24|8@1+ (0.5,0) [0|100] \"%\" V\n"
                          " SG_ ERROR_VELOCITY : 32|16@1- (0.001,0) [0|0] \"m/s\" V\n"));
  DvlCanParams params = Shipped();
  params.signals.Assign(dbc, kDvlErrorVelocity, "DVL_QUALITY.ERROR_VELOCITY");
  params.signals.Assign(dbc, kDvlBeamQuality1, "DVL_QUALITY.Q1 * 0.01");
  EXPECT_EQ(params.Validate(), "signals.beam_2_quality: missing");
  params.signals.Assign(dbc, kDvlBeamQuality2, "DVL_QUALITY.Q2 * 0.01");
  params.signals.Assign(dbc, kDvlBeamQuality3, "DVL_QUALITY.Q3 * 0.01");
  params.signals.Assign(dbc, kDvlBeamQuality4, "DVL_QUALITY.Q4 * 0.01");
  ASSERT_EQ(params.Validate(), "");

  DvlSample sample = Dvl(0);
  sample.error_velocity_mps = -0.017;
  for (std::size_t b = 0; b < 4; ++b) sample.beams[b].quality = 0.25 * static_cast<double>(b + 1);
  DvlCanDecoder decoder(params);
  std::optional<DvlSample> given;
  for (const CanFrame& frame : DvlCanEncoder(params.signals).Encode(sample, std::nullopt))
    if (const DvlOutput out = decoder.Add(frame, sample.time); out.dvl) given = out.dvl;
  ASSERT_TRUE(given);
  ExpectSame(*given, sample);
  EXPECT_NEAR(given->error_velocity_mps.value(), -0.017, 1e-12);
  for (std::size_t b = 0; b < 4; ++b)
    EXPECT_NEAR(given->beams[b].quality.value(), 0.25 * static_cast<double>(b + 1), 1e-12);
}

TEST_F(DvlCan, EitherPartMayComeAlone) {
  const Output dvl = Feed(encoder.Encode(Dvl(0), std::nullopt), Dvl(0).time);
  EXPECT_EQ(dvl.dvl.size(), 1u);
  EXPECT_TRUE(dvl.depth.empty());
  const Output depth = Feed(encoder.Encode(std::nullopt, Depth(1)), Depth(1).time);
  EXPECT_TRUE(depth.dvl.empty());
  ASSERT_EQ(depth.depth.size(), 1u);
  EXPECT_EQ(depth.depth[0].time, Depth(1).time);
  decoder.Finish();
  EXPECT_TRUE(decoder.counters().empty());
  EXPECT_TRUE(encoder.Encode(std::nullopt, std::nullopt).empty());
}

TEST_F(DvlCan, PressureAloneIsDepthByDensityAndGravity) {
  constexpr double kDensity = 1027.0, kGravity = 9.81;
  TemporaryDir dir;
  std::string config = TextOf(ConfigFile("dvl_driver.yaml"));
  const std::size_t depth = config.find("  depth_m:");
  config.erase(depth);
  config += "  depth_m: DEPTH_PRESSURE.PRESSURE * 9.9257e-5\n";
  std::filesystem::copy(ConfigFile("seastitch_dvl.dbc"), dir.path() / "seastitch_dvl.dbc");
  const DvlCanParams pressure_alone = LoadDvlDriverConfig(dir.Write("dvl_driver.yaml", config)).can;
  ASSERT_EQ(pressure_alone.Validate(), "");
  DvlCanDecoder of_pressure(pressure_alone);
  std::optional<DepthSample> got;
  for (const CanFrame& frame : encoder.Encode({}, Depth(0))) {
    if (const auto sample = of_pressure.Add(frame, Depth(0).time).depth) got = sample;
  }
  ASSERT_TRUE(got);
  EXPECT_NEAR(got->depth_m, Depth(0).pressure_pa.value() / (kDensity * kGravity), 1e-3);
  EXPECT_EQ(got->pressure_pa, Depth(0).pressure_pa);
  EXPECT_EQ(got->sigma_m, 0.0);
}

TEST_F(DvlCan, WithoutLockVelocityAndSigmaAreZero) {
  DvlSample sample = Dvl(0);
  sample.bottom_lock = false;
  sample.altitude_m.reset();
  const Output out = Feed(encoder.Encode(sample, std::nullopt), sample.time);
  ASSERT_EQ(out.dvl.size(), 1u);
  EXPECT_FALSE(out.dvl[0].bottom_lock);
  EXPECT_EQ(out.dvl[0].v_dvl_mps.norm(), 0.0);
  EXPECT_EQ(out.dvl[0].sigma_v_mps.norm(), 0.0);
  EXPECT_FALSE(out.dvl[0].altitude_m);
}

TEST_F(DvlCan, RandomLossNeverMixesEnsembles) {
  EXPECT_TRUE(rc::check([this] {
    const std::vector<std::uint8_t> dice =
        *rc::gen::container<std::vector<std::uint8_t>>(160, rc::gen::inRange<std::uint8_t>(0, 10));
    DvlCanDecoder fresh(params);
    std::size_t die = 0;
    for (int i = 0; i < 20; ++i) {
      Time recv = Dvl(i).time;
      for (const CanFrame& frame : encoder.Encode(Dvl(i), Depth(i))) {
        recv += Duration(200);
        if (dice[die++] < 3) continue;
        const DvlOutput out = fresh.Add(frame, recv);
        if (out.dvl) {
          const auto of = static_cast<double>((out.dvl->time - Dvl(0).time).count() / 200'000);
          RC_ASSERT(std::abs(out.dvl->v_dvl_mps.x() - 1.5 - 0.0002 * of) < 1e-9);
        }
        if (out.depth) {
          const auto of = static_cast<double>((out.depth->time - Dvl(0).time).count() / 200'000);
          RC_ASSERT(std::abs(out.depth->depth_m - 20.0123 - 0.5 * of) < 1e-9);
        }
      }
    }
  }));
}

TEST_F(DvlCan, LossesAreCountedByTheirKind) {
  std::vector<CanFrame> frames = encoder.Encode(Dvl(0), Depth(0));
  frames.erase(frames.begin() + 2);  // sigma
  frames.pop_back();                 // depth
  EXPECT_TRUE(Feed(frames, Dvl(0).time).dvl.empty());
  Feed({encoder.Encode(Dvl(1), Depth(1))[0]}, Dvl(1).time);
  EXPECT_EQ(Count("dvl_ensemble_incomplete"), 1);
  EXPECT_EQ(Count("depth_ensemble_incomplete"), 1);

  decoder = DvlCanDecoder(params);
  frames = encoder.Encode(Dvl(0), std::nullopt);
  Feed({frames.begin() + 1, frames.end()}, Dvl(0).time);  // without the time
  EXPECT_EQ(Count("dvl_frame_outside_ensemble"), 5);

  frames[0].SetData(FromHex("00F1536540420F00"));  // 1000000 us
  Feed({frames[0]}, Dvl(0).time);
  EXPECT_EQ(Count("dvl_time_malformed"), 1);
  frames[1].length = 7;
  Feed({frames[1]}, Dvl(0).time);
  EXPECT_EQ(Count("dvl_frame_malformed"), 1);
}

TEST_F(DvlCan, ReceiveClockIsLessTheLatency) {
  DvlCanParams receive = params;
  receive.clock = {DeviceClock::kReceive, 0.05};
  decoder = DvlCanDecoder(receive);
  const Output out = Feed(encoder.Encode(Dvl(0), std::nullopt), FromUtime(kStart + 900'000));
  ASSERT_EQ(out.dvl.size(), 1u);
  EXPECT_EQ(ToUtime(out.dvl[0].time), kStart + 900'200 - 50'000);
}

}  // namespace
}  // namespace seastitch
