#include "bench/simulator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

#include "drivers/dvl/dvl_can.hpp"
#include "drivers/imu/imu_can.hpp"
#include "drivers/mbes/mbes_decoder.hpp"
#include "tests/bench/bench_fixtures.hpp"

namespace seastitch::bench {
namespace {

std::uint64_t HashOfAllBytes(const SurveyConfig& config) {
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  std::uint64_t hash = 14695981039346656037u;
  const auto add = [&hash](std::uint64_t value) { hash = (hash ^ value) * 1099511628211u; };
  while (const auto event = simulator.Next()) {
    add(static_cast<std::uint64_t>(ToUtime(event->recv)));
    for (const std::uint8_t byte : event->bytes) add(byte);
    for (const CanFrame& frame : event->frames) {
      add(frame.id);
      for (const std::uint8_t byte : frame.data()) add(byte);
    }
  }
  return hash;
}

TEST(SurveySimulator, SameSeedSameBytes) {
  SurveyConfig config = ShortSurvey();
  config.errors = SensorErrors::OfClass("mems");
  config.mbes = MbesParams{};
  const std::uint64_t first = HashOfAllBytes(config);
  EXPECT_EQ(HashOfAllBytes(config), first);
  config.seed = 2;
  EXPECT_NE(HashOfAllBytes(config), first);
}

TEST(SurveySimulator, EventsComeInOrderOfArrivalFromEveryDevice) {
  const SurveyConfig config = ShortSurvey();
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  const double total_s = ToSeconds(simulator.total());
  EXPECT_NEAR(total_s, (20.0 + 2.0 * config.plan.lead_in_m) / config.plan.speed_mps, 1e-6);
  std::array<int, 3> events{};
  Time last = kSurveyStart;
  while (const auto event = simulator.Next()) {
    EXPECT_GE(event->recv, last);
    last = event->recv;
    ++events[static_cast<std::size_t>(event->device)];
  }
  EXPECT_NEAR(events[0], total_s * config.imu.rate_hz, 2.0);
  EXPECT_NEAR(events[1], total_s * config.dvl.rate_hz, 2.0);
  EXPECT_NEAR(events[2], (total_s - 0.5) * config.mbes.ping_rate_hz + 1.0, 2.0);
  EXPECT_EQ(simulator.counts().pings, events[2] - 1);  // and the profile
}

std::vector<double> FixTimes(const SurveyConfig& config) {
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  std::vector<double> times_s;
  while (const auto event = simulator.Next())
    if (event->fix) times_s.push_back(ToSeconds(event->fix->time - kSurveyStart));
  return times_s;
}

TEST(SurveySimulator, GpsComesAtTheSurfaceOnlyBeforeAndAfterTheDive) {
  SurveyConfig config = ShortSurvey();
  config.fixes.interval_s = 2.0;
  config.fixes.gps = true;
  EXPECT_TRUE(FixTimes(config).empty());  // it never comes up
  config.plan.surface_s = 5.0;
  config.plan.dive_s = 20.0;
  const double total_s =
      (20.0 + 2.0 * config.plan.lead_in_m) / config.plan.speed_mps + 2.0 * (5.0 + 20.0);
  const std::vector<double> expected{
      2.0, 4.0, total_s - 5.0, total_s - 3.0, total_s - 1.0};  // from when it is up again
  const std::vector<double> times_s = FixTimes(config);
  ASSERT_EQ(times_s.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(times_s[i], expected[i], 1e-6);
  config.fixes.gps = false;
  EXPECT_EQ(FixTimes(config).size(), static_cast<std::size_t>(total_s / 2.0));
}

TEST(SurveySimulator, ADiveComesFromTheSurfaceToItsFirstLineAndGoesUpAgain) {
  SurveyConfig config = ShortSurvey();
  const SurveySimulator on_line(config, CrookedVehicle(), ShippedDrivers().signals());
  config.plan.surface_s = 5.0;
  config.plan.dive_s = 20.0;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  const auto at = [](double t_s) { return kSurveyStart + FromSeconds(t_s); };
  const double total_s = ToSeconds(simulator.total());
  for (const double t_s : {1.0, 4.0, total_s - 4.0, total_s - 1.0})
    EXPECT_NEAR(simulator.TruthAt(at(t_s)).T_map_vehicle.translation().z(), 0.3, 0.4) << t_s;
  const Eigen::Vector3d p = simulator.TruthAt(at(25.0 + 10.0)).T_map_vehicle.translation();
  const Eigen::Vector3d q = on_line.TruthAt(at(10.0)).T_map_vehicle.translation();
  EXPECT_NEAR((p - q).head<2>().norm(), 0.0, 1e-6);  // the lines stay where they are
  EXPECT_NEAR(p.z(), q.z(), 0.3);
  // The sonar is on between the ways down and up.
  std::vector<double> pings_s;
  while (const auto event = simulator.Next())
    if (event->device == Device::kMbes) pings_s.push_back(ToSeconds(event->recv - kSurveyStart));
  EXPECT_EQ(pings_s.front(), 0.0);  // the profile
  EXPECT_GE(pings_s.at(1), 25.0);
  EXPECT_LE(pings_s.back(), total_s - 25.0 + 0.5);
}

// Where a detection lies, from nothing but its travel time, its two angles and the true poses, in
// water of one speed: three equations in three unknowns, by Newton's method.
Eigen::Vector3d Georeferenced(const MbesBeam& beam,
                              const Eigen::Isometry3d& T_map_tx,
                              const Eigen::Isometry3d& T_map_rx,
                              double speed_mps) {
  const Eigen::Vector3d tx = T_map_tx.translation();
  const Eigen::Vector3d rx = T_map_rx.translation();
  const Eigen::Vector3d forward = T_map_tx.linear().col(0);
  const Eigen::Vector3d starboard = T_map_rx.linear().col(1);
  const double range = 0.5 * double{beam.twtt_s} * speed_mps;
  Eigen::Vector3d p =
      rx +
      T_map_rx.linear() *
          (range * Eigen::Vector3d(0.0, std::sin(beam.rx_angle_rad), std::cos(beam.rx_angle_rad)));
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d from_tx = p - tx;
    const Eigen::Vector3d from_rx = p - rx;
    const Eigen::Vector3d to_tx = from_tx.normalized();
    const Eigen::Vector3d to_rx = from_rx.normalized();
    const Eigen::Vector3d miss(
        from_tx.dot(forward) - from_tx.norm() * std::sin(double{beam.tx_tilt_rad}),
        from_rx.dot(starboard) - from_rx.norm() * std::sin(double{beam.rx_angle_rad}),
        from_tx.norm() + from_rx.norm() - 2.0 * range);
    Eigen::Matrix3d jacobian;
    jacobian << (forward - std::sin(double{beam.tx_tilt_rad}) * to_tx).transpose(),
        (starboard - std::sin(double{beam.rx_angle_rad}) * to_rx).transpose(),
        (to_tx + to_rx).transpose();
    p -= jacobian.partialPivLu().solve(miss);
  }
  return p;
}

struct Residual {
  double height_m;  // of the sounding above the seabed there
  double sigma_m;   // as the sonar states it
};

// Decodes the survey's pings from its bytes and compares every valid beam with the seabed.
std::vector<Residual> ResidualsOnTheSeabed(const SurveyConfig& config) {
  const VehicleGeometry vehicle = CrookedVehicle();
  SurveySimulator simulator(config, vehicle, ShippedDrivers().signals());
  MbesDecoder decoder(MbesDecoderParams{});
  std::vector<Residual> residuals;
  while (const auto event = simulator.Next()) {
    if (event->device != Device::kMbes) continue;
    const auto outputs = decoder.Add(event->bytes, event->recv);
    if (outputs.empty() || !std::holds_alternative<MbesPing>(outputs[0])) continue;
    const MbesPing& ping = std::get<MbesPing>(outputs[0]);
    for (const MbesBeam& beam : ping.beams) {
      if ((beam.flags & kBeamValid) == 0) continue;
      // Poses at the very instants, not on the microsecond.
      const double tx_s = ToSeconds(ping.time - kSurveyStart) + double{beam.tx_delay_s};
      const auto pose = [&](double t) {
        const TrueState near = simulator.TruthAt(kSurveyStart + FromSeconds(t));
        return Eigen::Isometry3d(near.T_map_vehicle * vehicle.T_vehicle_mbes);
      };
      const Eigen::Isometry3d T_map_tx = pose(tx_s);
      const Eigen::Vector3d p =
          Georeferenced(beam, T_map_tx, pose(tx_s + double{beam.twtt_s}), ping.sound_speed_mps);
      const auto seabed = simulator.terrain().DepthAt(p.x(), p.y());
      EXPECT_TRUE(seabed);
      if (seabed)
        residuals.push_back(
            {*seabed - p.z(),
             double{beam.depth_sigma_ratio} * (p.z() - T_map_tx.translation().z())});
    }
  }
  EXPECT_EQ(decoder.counters(), Counters{});
  return residuals;
}

TEST(SurveySimulator, PingsWithoutNoiseLieOnTheSeabed) {
  SurveyConfig config = ShortSurvey();
  config.mbes.sector_tilt_deg = {-1.0, 0.5, 2.0};
  config.mbes.sector_delay_s = {0.0, 0.002, 0.004};
  const std::vector<Residual> residuals = ResidualsOnTheSeabed(config);
  EXPECT_GT(residuals.size(), 5000u);
  double worst = 0.0;
  for (const Residual& r : residuals) worst = std::max(worst, std::abs(r.height_m));
  EXPECT_LT(worst, 0.001);
}

TEST(SurveySimulator, NoiseIsWhatTheSonarSaysItIs) {
  SurveyConfig config = ShortSurvey();
  config.terrain.relief.rms_m = 0.0;
  config.mbes.range_noise_m = 0.02;
  config.mbes.range_noise_ratio = 0.002;
  config.mbes.angle_noise_deg = 0.1;
  const std::vector<Residual> residuals = ResidualsOnTheSeabed(config);
  double sum2 = 0.0;
  for (const Residual& r : residuals) sum2 += std::pow(r.height_m / r.sigma_m, 2);
  EXPECT_NEAR(std::sqrt(sum2 / static_cast<double>(residuals.size())), 1.0, 0.05);
}

TEST(SurveySimulator, BlundersComeAtTheirRates) {
  SurveyConfig config = ShortSurvey();
  config.terrain.relief.rms_m = 0.0;
  config.mbes.beams = 128;
  config.mbes.outlier_rate = 0.02;
  config.mbes.drop_rate = 0.05;
  const std::vector<Residual> residuals = ResidualsOnTheSeabed(config);
  double outliers = 0.0;
  for (const Residual& r : residuals) outliers += std::abs(r.height_m) > 0.2 ? 1.0 : 0.0;
  const auto found = static_cast<double>(residuals.size());
  EXPECT_NEAR(outliers / found, 0.02, 0.005);

  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  while (simulator.Next()) {
  }
  const auto without = static_cast<double>(simulator.counts().beams_without_detection);
  EXPECT_NEAR(without / (without + found), 0.05, 0.005);
}

TEST(SurveySimulator, AnOutOfRangeSeabedGivesNoBeams) {
  SurveyConfig config = ShortSurvey();
  config.plan.altitude_m = 0.0;
  config.plan.depth_m = 2.0;
  config.mbes.max_range_m = 10.0;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  while (simulator.Next()) {
  }
  EXPECT_EQ(simulator.counts().soundings, 0);
  EXPECT_GT(simulator.counts().pings, 0);
}

struct Decoded {
  std::vector<ImuSample> imu;
  std::vector<DvlSample> dvl;
  std::vector<DepthSample> depth;
};

Decoded DecodeCan(const SurveyConfig& config) {
  const DriverConfigs drivers = ShippedDrivers();
  SurveySimulator simulator(config, CrookedVehicle(), drivers.signals());
  ImuCanDecoder imu(drivers.imu.can);
  DvlCanDecoder dvl(drivers.dvl.can);
  Decoded decoded;
  while (const auto event = simulator.Next()) {
    for (const CanFrame& frame : event->frames) {
      if (event->device == Device::kImu) {
        if (const auto sample = imu.Add(frame, event->recv)) decoded.imu.push_back(*sample);
      } else {
        const DvlOutput output = dvl.Add(frame, event->recv);
        if (output.dvl) decoded.dvl.push_back(*output.dvl);
        if (output.depth) decoded.depth.push_back(*output.depth);
      }
    }
  }
  EXPECT_EQ(imu.counters(), Counters{});
  EXPECT_EQ(dvl.counters(), Counters{});
  return decoded;
}

TEST(SurveySimulator, IdealNavigationSensorsTellTheTruth) {
  const SurveyConfig config = ShortSurvey();
  const VehicleGeometry vehicle = CrookedVehicle();
  const SurveySimulator truth(config, vehicle, ShippedDrivers().signals());
  const Decoded decoded = DecodeCan(config);
  ASSERT_GT(decoded.imu.size(), 1000u);
  ASSERT_GT(decoded.dvl.size(), 100u);
  ASSERT_EQ(decoded.dvl.size(), decoded.depth.size());

  for (const ImuSample& sample : decoded.imu) {
    const TrueState s = truth.TruthAt(sample.time);
    const Eigen::Matrix3d R = s.T_map_vehicle.linear() * vehicle.T_vehicle_imu.linear();
    ASSERT_TRUE(sample.attitude);
    EXPECT_LT(Eigen::AngleAxisd(
                  Eigen::Matrix3d(R.transpose() * sample.attitude->q_ned_imu.toRotationMatrix()))
                  .angle(),
              1.5e-4);  // ECAN's step is 1e-4 rad
    const Eigen::Vector3d rate = vehicle.T_vehicle_imu.linear().transpose() * s.rate_vehicle_radps;
    EXPECT_LT((sample.angular_rate_radps - rate).norm(), 1.2e-3);
  }
  for (const DvlSample& sample : decoded.dvl) {
    const TrueState s = truth.TruthAt(sample.time);
    ASSERT_TRUE(sample.bottom_lock);
    const Eigen::Vector3d v_map =
        s.v_map_mps + s.T_map_vehicle.linear() *
                          s.rate_vehicle_radps.cross(vehicle.T_vehicle_dvl.translation().eval());
    const Eigen::Isometry3d T_map_dvl = s.T_map_vehicle * vehicle.T_vehicle_dvl;
    EXPECT_LT((sample.v_dvl_mps - T_map_dvl.linear().transpose() * v_map).norm(), 5e-5);
    // Each beam ends on the seabed.
    for (int i = 0; i < 4; ++i) {
      const double azimuth = Deg2Rad(45.0 + 90.0 * i);
      const double off = Deg2Rad(config.dvl.beam_angle_deg);
      const Eigen::Vector3d p = T_map_dvl * (sample.beams[std::size_t(i)].range_m *
                                             Eigen::Vector3d(std::sin(off) * std::cos(azimuth),
                                                             std::sin(off) * std::sin(azimuth),
                                                             std::cos(off)));
      EXPECT_NEAR(*truth.terrain().DepthAt(p.x(), p.y()), p.z(), 0.01);
    }
  }
  for (const DepthSample& sample : decoded.depth) {
    const TrueState s = truth.TruthAt(sample.time);
    const double depth = (s.T_map_vehicle * vehicle.p_vehicle_depth_m).z();
    EXPECT_NEAR(sample.depth_m, depth, 1e-4);
    EXPECT_NEAR(sample.pressure_pa.value(), depth * 1025.0 * 9.8045, 20.0);
  }
}

TEST(SurveySimulator, DvlDropoutTakesTheBottomLockAway) {
  SurveyConfig config = ShortSurvey();
  config.faults = {ParseFault("dvl_dropout:from_s=5,to_s=10")};
  int without = 0;
  for (const DvlSample& sample : DecodeCan(config).dvl) {
    const double t = ToSeconds(sample.time - kSurveyStart);
    EXPECT_EQ(sample.bottom_lock, t < 5.0 || t >= 10.0) << t;
    without += sample.bottom_lock ? 0 : 1;
  }
  EXPECT_EQ(without, 25);
}

TEST(SurveySimulator, LostPacketsAreLostAndCounted) {
  SurveyConfig config = ShortSurvey();
  const auto events = [&config](std::int64_t* lost) {
    SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
    std::int64_t n = 0;
    while (simulator.Next()) ++n;
    *lost = simulator.counts().events_lost;
    return n;
  };
  std::int64_t lost = 0;
  const std::int64_t all = events(&lost);
  EXPECT_EQ(lost, 0);
  config.faults = {ParseFault("packet_loss:device=imu,rate=0.1")};
  EXPECT_EQ(all - events(&lost), lost);
  EXPECT_NEAR(static_cast<double>(lost), 0.1 * 50.0 * 26.7, 40.0);
}

// Plain dead reckoning: what the device says of its attitude, times what the DVL says of the
// velocity, summed; and nothing filtered. Position error at the end, and the worst on the way.
struct Drift {
  double end_m;
  double worst_m;
  double distance_m;
};

Drift PlainDeadReckoning(const PlanParams& plan,
                         const std::string& error_class,
                         std::uint64_t seed) {
  const Path path(plan);
  ProceduralParams flat;
  flat.depth_m = 20.0;
  const ProceduralTerrain terrain(flat, 1);
  const Trajectory trajectory(path, plan, MotionParams{}, terrain, seed);
  const Water water({{0.0}, {1500.0}});
  const VehicleGeometry vehicle;  // everything at the reference point: no lever arm to forget
  const Scene scene{trajectory, terrain, water, vehicle};
  const SensorErrors errors = SensorErrors::OfClass(error_class);
  constexpr double kDt = 0.4;
  ImuModel imu({1.0 / kDt, 0.0}, errors, scene, seed);
  DvlModel dvl(DvlParams{}, errors, scene, seed);

  Drift drift{0.0, 0.0, trajectory.duration_s() * plan.speed_mps};
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_last = Eigen::Vector3d::Zero();
  for (int i = 0; i * kDt <= trajectory.duration_s(); ++i) {
    const double t = i * kDt;
    const Eigen::Quaterniond q = imu.SampleAt(t).attitude->q_ned_imu;
    const DvlSample sample = dvl.EnsembleAt(t, true);
    const Eigen::Vector3d v = sample.bottom_lock ? Eigen::Vector3d(q * sample.v_dvl_mps) : v_last;
    if (i > 0) p += 0.5 * kDt * (v_last + v);
    v_last = v;
    const Eigen::Vector3d off = p - trajectory.PoseAt(t).translation();
    drift.end_m = off.head<2>().norm();
    drift.worst_m = std::max(drift.worst_m, drift.end_m);
  }
  return drift;
}

struct ClassCase {
  const char* name;
  double min_percent;  // of the distance from the origin, RMS over seeds
  double max_percent;
};

class ErrorClass : public ::testing::TestWithParam<ClassCase> {};

TEST_P(ErrorClass, DriftsAsStated) {
  PlanParams straight;
  straight.lines = 1;
  straight.line_length_m = 1000.0;
  straight.lead_in_m = 0.0;
  straight.crosslines = 0;
  PlanParams lawn;  // the default: 6 lines and a crossline
  constexpr int kSeeds = 8;
  double straight2 = 0.0;
  double lawn2 = 0.0;
  double worst2 = 0.0;
  double lawn_distance = 0.0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Drift away = PlainDeadReckoning(straight, GetParam().name, std::uint64_t(seed));
    const Drift survey = PlainDeadReckoning(lawn, GetParam().name, std::uint64_t(seed));
    straight2 += std::pow(away.end_m / away.distance_m, 2) / kSeeds;
    lawn2 += std::pow(survey.end_m / survey.distance_m, 2) / kSeeds;
    worst2 += std::pow(survey.worst_m, 2) / kSeeds;
    lawn_distance = survey.distance_m;
  }
  const double percent = 100.0 * std::sqrt(straight2);
  std::printf(
      "%s: %.2f %% of the distance from the origin; lawn mower of %.0f m: %.2f %% of the "
      "way at its end, worst %.1f m (RMS of %d seeds)\n",
      GetParam().name,
      percent,
      lawn_distance,
      100.0 * std::sqrt(lawn2),
      std::sqrt(worst2),
      kSeeds);
  EXPECT_GE(percent, GetParam().min_percent);
  EXPECT_LE(percent, GetParam().max_percent);
}

INSTANTIATE_TEST_SUITE_P(Classes,
                         ErrorClass,
                         ::testing::Values(ClassCase{"ideal", 0.0, 0.01},
                                           ClassCase{"ins_tactical", 0.2, 0.5},
                                           ClassCase{"mems", 1.0, 3.0}),
                         [](const auto& p) { return std::string(p.param.name); });

}  // namespace
}  // namespace seastitch::bench
