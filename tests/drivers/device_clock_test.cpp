#include "drivers/device_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "codecs/kongsberg/kmall.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_decoder.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

const Time kStart = FromUtime(1'700'000'000'000'000);

// A device whose counter runs off our clock, and a transport that delays each message at random.
struct Simulation {
  double rate_hz = 100.0;
  double drift = 20e-6;  // the counter gains this
  double tick_s = 1e-6;
  std::uint32_t first_count = 0;
  double step_at_s = 1e9;
  double step_s = 0.0;  // of the counter
  double stall_at_s = 1e9;
  double stall_s = 0.0;  // of the transport: what is sent meanwhile comes at its end
  unsigned seed = 1;
};

struct Stamped {
  double t_s;      // true time of the measurement
  double error_s;  // of its stamp
  bool given;
};

std::vector<Stamped> Simulate(const Simulation& sim, double duration_s, ClockModel* model) {
  std::mt19937 random(sim.seed);
  std::uniform_real_distribution<double> delay_s(0.0002, 0.020);
  WrappingCounter counter(sim.tick_s);
  std::vector<Stamped> all;
  for (double t = 0.0; t < duration_s; t += 1.0 / sim.rate_hz) {
    const double device_s = t * (1.0 + sim.drift) + (t >= sim.step_at_s ? sim.step_s : 0.0);
    const auto ticks = static_cast<std::int64_t>(std::floor(device_s / sim.tick_s));
    const auto count = static_cast<std::uint32_t>(sim.first_count + ticks);
    double arrival_s = t + delay_s(random);
    if (t >= sim.stall_at_s && t < sim.stall_at_s + sim.stall_s)
      arrival_s = std::max(arrival_s, sim.stall_at_s + sim.stall_s);
    const Time recv = kStart + FromSeconds(arrival_s);
    const std::optional<Time> stamp = model->Add(counter.Unwrap(count, recv), recv);
    all.push_back({t, stamp ? ToSeconds(*stamp - kStart) - t : 0.0, stamp.has_value()});
  }
  return all;
}

// The share of messages of a span whose stamps are that good; one without a stamp is not.
double ShareWithin(const std::vector<Stamped>& all, double from_s, double to_s, double error_s) {
  double good = 0.0;
  double messages = 0.0;
  for (const Stamped& s : all) {
    if (s.t_s < from_s || s.t_s >= to_s) continue;
    messages += 1.0;
    if (s.given && std::abs(s.error_s) <= error_s) good += 1.0;
  }
  return good / messages;
}

double Quantile95(const std::vector<Stamped>& all, double from_s, double to_s) {
  std::vector<double> errors;
  for (const Stamped& s : all)
    if (s.t_s >= from_s && s.t_s < to_s) errors.push_back(s.given ? std::abs(s.error_s) : 1e9);
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() * 95 / 100];
}

// For docs/performance.md.
void Tell(const char* what, double error_s) {
  std::printf("95 %% of stamps within %.3f ms: %s\n", error_s * 1e3, what);
}

TEST(ClockModel, StampsAreWithinAMillisecondAfterHalfAMinute) {
  for (const double rate_hz : {5.0, 25.0, 100.0, 400.0}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      ClockModel model(0.0);
      Simulation sim;
      sim.rate_hz = rate_hz;
      sim.seed = seed;
      const auto all = Simulate(sim, 600.0, &model);
      EXPECT_GE(ShareWithin(all, 30.0, 600.0, 0.001), 0.95) << rate_hz << " Hz, seed " << seed;
      if (seed == 1)
        Tell((std::to_string(static_cast<int>(rate_hz)) + " Hz, from 30 s on").c_str(),
             Quantile95(all, 30.0, 600.0));
      EXPECT_TRUE(model.settled());
      EXPECT_EQ(model.steps(), 0);
      EXPECT_NEAR(model.drift_ppm(), -20.0, rate_hz < 20.0 ? 25.0 : 5.0);
      EXPECT_LT(model.error_s(), rate_hz < 20.0 ? 0.005 : 0.001);
    }
  }
}

TEST(ClockModel, AStepOfASecondIsRecoveredFromWithinFiveSeconds) {
  for (const double step_s : {1.0, -1.0}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      ClockModel model(0.0);
      Simulation sim;
      sim.seed = seed;
      sim.step_at_s = 100.0;
      sim.step_s = step_s;
      const auto all = Simulate(sim, 300.0, &model);
      EXPECT_EQ(model.steps(), 1);
      EXPECT_GE(ShareWithin(all, 30.0, 100.0, 0.001), 0.95);
      EXPECT_GE(ShareWithin(all, 105.0, 300.0, 0.001), 0.95) << step_s;
      EXPECT_GE(ShareWithin(all, 105.0, 110.0, 0.001), 0.95) << step_s;
      // Nothing is ever stamped a second off.
      EXPECT_TRUE(std::all_of(all.begin(), all.end(), [](const Stamped& s) {
        return !s.given || std::abs(s.error_s) < 0.025;
      }));
      if (seed == 1)
        Tell(step_s > 0 ? "5 to 10 s after a step of +1 s" : "5 to 10 s after a step of -1 s",
             Quantile95(all, 105.0, 110.0));
    }
  }
}

TEST(ClockModel, RunsOnThroughTheWrapOfTheCounter) {
  for (const double tick_s : {1e-6, 1e-4}) {
    ClockModel model(0.0);
    Simulation sim;
    sim.tick_s = tick_s;
    sim.first_count = static_cast<std::uint32_t>(0) - static_cast<std::uint32_t>(100.0 / tick_s);
    const auto all = Simulate(sim, 200.0, &model);
    EXPECT_EQ(model.steps(), 0);
    EXPECT_GE(ShareWithin(all, 30.0, 200.0, 0.001), 0.95);
    EXPECT_GE(ShareWithin(all, 99.0, 101.0, 0.001), 0.95);
  }
}

TEST(ClockModel, AStallOfTheTransportIsNoStep) {
  for (const double stall_s : {0.3, 1.5, 10.0}) {
    ClockModel model(0.0);
    Simulation sim;
    sim.stall_at_s = 100.0;
    sim.stall_s = stall_s;
    const auto all = Simulate(sim, 200.0, &model);
    EXPECT_EQ(model.steps(), 0);
    EXPECT_GE(ShareWithin(all, 100.0 + stall_s, 200.0, 0.001), 0.95) << stall_s;
    // What is late by no more than half a second is stamped all the same.
    EXPECT_GE(ShareWithin(all, 100.0 + std::max(0.0, stall_s - 0.5), 200.0, 0.001), 0.95);
  }
}

TEST(ClockModel, ARestartOfTheDeviceIsAStep) {
  ClockModel model(0.0);
  Simulation sim;
  sim.step_at_s = 100.0;
  sim.step_s = -100.0;  // from 0 again
  const auto all = Simulate(sim, 200.0, &model);
  EXPECT_EQ(model.steps(), 1);
  EXPECT_GE(ShareWithin(all, 105.0, 200.0, 0.001), 0.95);
}

TEST(ClockModel, SilenceOfHoursDoesNotConfuseTheCounter) {
  WrappingCounter counter(1e-6);
  const double wrap_s = 4294.967296;
  counter.Unwrap(1'000'000, kStart);
  const Time later = kStart + FromSeconds(3 * wrap_s + 100.0);
  EXPECT_EQ(counter.Unwrap(101'001'000, later) - Duration(1'000'000),
            FromSeconds(3 * wrap_s + 100.001));
}

TEST(ClockModel, TheLeastDelayIsTakenOff) {
  ClockModel model(0.0002);
  const auto all = Simulate(Simulation{}, 60.0, &model);
  double sum = 0.0;
  for (std::size_t i = all.size() - 1000; i < all.size(); ++i) sum += all[i].error_s;
  EXPECT_NEAR(sum / 1000.0, 0.0, 0.0001);
}

TEST(ClockModel, TheSameStampsGiveTheSameTimes) {
  ClockModel one(0.0);
  ClockModel two(0.0);
  const auto a = Simulate(Simulation{}, 60.0, &one);
  const auto b = Simulate(Simulation{}, 60.0, &two);
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(a[i].error_s, b[i].error_s);
}

TEST(ClockModel, AClockOfAnotherPaceNeverSettles) {
  // A survey simulated at ten times its speed.
  ClockModel model(0.0);
  for (int i = 0; i < 10'000; ++i) model.Add(Duration(100'000 * i), kStart + Duration(10'000 * i));
  EXPECT_FALSE(model.settled());
  EXPECT_EQ(model.steps(), 0);
}

TEST(Stamper, TheConfiguredClockDecides) {
  const Time device = FromUtime(1'600'000'000'000'000);
  EXPECT_EQ(Stamper({DeviceClock::kDevice, 0.0}).Stamp(device, kStart), device);
  EXPECT_EQ(Stamper({DeviceClock::kReceive, 0.25}).Stamp(device, kStart),
            kStart - Duration(250'000));
  EXPECT_EQ(Stamper({DeviceClock::kModel, 0.25}).Stamp(device, kStart, Duration(50'000)),
            kStart - Duration(300'000));
}

TEST(Stamper, FiguresTellHowADisciplinedClockStandsToOurs) {
  Stamper stamper({DeviceClock::kDevice, 0.0});
  for (int i = 0; i < 300; ++i) {
    const Time recv = kStart + std::chrono::milliseconds(100 * i);
    stamper.Stamp(recv - std::chrono::milliseconds(300), recv);
  }
  const Counters figures = stamper.Figures("dvl");
  EXPECT_EQ(figures.at("dvl_clock_settled"), 1);
  EXPECT_EQ(figures.at("dvl_clock_steps"), 0);
  EXPECT_EQ(figures.at("dvl_clock_offset_us"), 300'000);
  EXPECT_NEAR(static_cast<double>(figures.at("dvl_clock_drift_ppb")), 0.0, 1.0);
  EXPECT_TRUE(Stamper({DeviceClock::kReceive, 0.0}).Figures("dvl").empty());
}

// The whole way: frames of an inertial unit without UTC, over a wire that delays.
TEST(Stamper, AnInertialUnitWithoutUtcIsStampedByTheModel) {
  ImuCanParams params = LoadImuDriverConfig(ConfigFile("imu_driver.yaml")).can;
  params.clock.clock = DeviceClock::kModel;
  ImuCanDecoder decoder(params);
  // Its counter wraps 45 s after the start.
  ImuCanEncoder device(params.signals, kStart + FromSeconds(45.0 - 4294.967296));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> delay_s(0.0002, 0.020);
  int good = 0;
  int given = 0;
  for (int i = 0; i < 9000; ++i) {
    ImuSample sample;
    sample.time = kStart + std::chrono::milliseconds(10 * i);
    sample.attitude.emplace();
    Time recv = sample.time + FromSeconds(delay_s(random));
    for (const CanFrame& frame : device.Encode(sample)) {
      if (frame.id == 0x110 || frame.id == 0x111) continue;
      const auto stamped = decoder.Add(frame, recv);
      recv += Duration(130);
      if (!stamped || i < 3000) continue;
      ++given;
      if (std::abs(ToSeconds(stamped->time - sample.time)) < 0.001) ++good;
    }
  }
  EXPECT_EQ(given, 6000);
  EXPECT_GE(good, 0.95 * 6000);
  EXPECT_EQ(decoder.clock_figures().at("imu_clock_steps"), 0);
}

// Deep water delays a ping's datagrams by far more than its clock may be off: that part is known.
TEST(Stamper, ASonarWithoutDisciplineIsStampedByTheModelWhateverTheDepth) {
  MbesDecoderParams params;
  params.clock = {DeviceClock::kModel, 0.010};
  MbesDecoder decoder(params);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> processing_s(0.010, 0.030);
  std::vector<double> errors;
  for (int i = 0; i < 1000; ++i) {
    const Time truth = kStart + std::chrono::milliseconds(200 * i);
    MbesPing ping;
    ping.time = truth - std::chrono::seconds(3600) + FromSeconds(0.2 * i * 20e-6);  // its own clock
    ping.sound_speed_mps = 1500.0;
    const double last_echo_s = 0.1 + 0.08 * std::sin(0.01 * i);
    ping.beams.resize(2);
    ping.beams[0].twtt_s = static_cast<float>(0.5 * last_echo_s);
    ping.beams[1].twtt_s = static_cast<float>(last_echo_s);
    ping.beams[1].flags = kBeamValid | kBeamAmplitude;
    const Time recv = truth + FromSeconds(last_echo_s + processing_s(random));
    const auto output = decoder.Add(EncodeMrz(ping, KmallHeader{}), recv);
    ASSERT_EQ(output.size(), 1u);
    if (i >= 150) errors.push_back(std::abs(ToSeconds(std::get<MbesPing>(output[0]).time - truth)));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.001);
}

}  // namespace
}  // namespace seastitch
