#include "mapper/geometry/georeference.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kSpeed = 1500.0;
const Time kPing = FromUtime(1'700'000'000'000'000);

MbesBeam Beam(double rx_angle_deg, double tx_tilt_deg, double range_m) {
  MbesBeam beam;
  beam.twtt_s = static_cast<float>(2.0 * range_m / kSpeed);
  beam.rx_angle_rad = static_cast<float>(Deg2Rad(rx_angle_deg));
  beam.tx_tilt_rad = static_cast<float>(Deg2Rad(tx_tilt_deg));
  beam.flags = kBeamValid;
  return beam;
}

MbesPing Ping(std::vector<MbesBeam> beams) {
  MbesPing ping;
  ping.time = kPing;
  ping.sound_speed_mps = kSpeed;
  ping.beams = std::move(beams);
  return ping;
}

PoseLookup Standing(const Eigen::Isometry3d& T) {
  return [T](Time) { return T; };
}

Eigen::Vector3d OnlySounding(const MbesPing& ping,
                             const PoseLookup& lookup,
                             const VehicleGeometry& vehicle) {
  const auto result = Georeference(ping, lookup, vehicle, RayTracer::Constant(kSpeed));
  EXPECT_TRUE(result);
  EXPECT_EQ(result->soundings.size(), 1u);
  return result->soundings.at(0).p_map;
}

void ExpectNear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double tolerance) {
  EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " is not " << b.transpose();
}

// Ranges of 40 m carried as a float travel time, angles as float: 5 um.
constexpr double kFloat = 1e-5;

TEST(Georeference, LooksStraightDown) {
  const auto T = MakePose({100.0, 200.0, 30.0}, Eigen::Matrix3d::Identity());
  ExpectNear(OnlySounding(Ping({Beam(0, 0, 40)}), Standing(T), {}), {100, 200, 70}, kFloat);
}

// The correction as it is stated: across, and down.
TEST(Georeference, BendsAndStretchesASwath) {
  for (const SwathCorrection& correction :
       {SwathCorrection{0.002, 0.0}, SwathCorrection{0.0, 0.002}, SwathCorrection{0.003, -0.001}}) {
    for (const double angle_deg : {-60.0, 0.0, 30.0}) {
      const auto at = [&](const SwathCorrection& by) {
        return Georeference(Ping({Beam(angle_deg, 0.0, 20.0)}),
                            Standing(Eigen::Isometry3d::Identity()),
                            {},
                            RayTracer::Constant(kSpeed),
                            by)
            ->soundings.at(0)
            .p_map;
      };
      const Eigen::Vector3d as_it_is = at({}), corrected = at(correction);
      const double y = as_it_is.y(), z = as_it_is.z();
      const Eigen::Vector3d expected(0.0,
                                     y * (1.0 + correction.smile + correction.by_water),
                                     z - correction.smile * y * y / z);
      EXPECT_LT((corrected - expected).norm(), 1e-3) << angle_deg;
    }
  }
}

TEST(Georeference, PositiveReceiveAngleIsStarboardAndPositiveTiltForward) {
  const auto north = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  const double half = 20.0;
  const double root = 40.0 * std::sqrt(0.75);
  ExpectNear(OnlySounding(Ping({Beam(30, 0, 40)}), Standing(north), {}), {0, half, root}, kFloat);
  ExpectNear(OnlySounding(Ping({Beam(0, 30, 40)}), Standing(north), {}), {half, 0, root}, kFloat);
  // Heading east, starboard is south.
  const auto east = MakePose({0, 0, 0}, RotationFromRpy(0.0, 0.0, kPi / 2.0));
  ExpectNear(OnlySounding(Ping({Beam(30, 0, 40)}), Standing(east), {}), {-half, 0, root}, kFloat);
  ExpectNear(OnlySounding(Ping({Beam(0, 30, 40)}), Standing(east), {}), {0, half, root}, kFloat);
}

TEST(Georeference, RollToStarboardTurnsTheBeamToPort) {
  const auto rolled = MakePose({0, 0, 0}, RotationFromRpy(Deg2Rad(10.0), 0.0, 0.0));
  ExpectNear(OnlySounding(Ping({Beam(0, 0, 40)}), Standing(rolled), {}),
             {0.0, -40.0 * std::sin(Deg2Rad(10.0)), 40.0 * std::cos(Deg2Rad(10.0))},
             kFloat);
  // And the beam steered against it stands upright again.
  ExpectNear(OnlySounding(Ping({Beam(10, 0, 40)}), Standing(rolled), {}), {0.0, 0.0, 40.0}, kFloat);
}

TEST(Georeference, BowUpTurnsTheBeamForward) {
  const auto pitched = MakePose({0, 0, 0}, RotationFromRpy(0.0, Deg2Rad(10.0), 0.0));
  ExpectNear(OnlySounding(Ping({Beam(0, 0, 40)}), Standing(pitched), {}),
             {40.0 * std::sin(Deg2Rad(10.0)), 0.0, 40.0 * std::cos(Deg2Rad(10.0))},
             kFloat);
}

TEST(Georeference, LeverArmTurnsWithTheVehicle) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes.translation() = Eigen::Vector3d(2.0, 0.5, 0.25);
  const auto east = MakePose({10, 20, 5}, RotationFromRpy(0.0, 0.0, kPi / 2.0));
  ExpectNear(OnlySounding(Ping({Beam(0, 0, 40)}), Standing(east), vehicle),
             {10 - 0.5, 20 + 2.0, 5 + 0.25 + 40},
             kFloat);
}

TEST(Georeference, MountingAngleIsTakenOut) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes.linear() = RotationFromRpy(Deg2Rad(30.0), 0.0, 0.0);
  const auto level = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  ExpectNear(OnlySounding(Ping({Beam(30, 0, 40)}), Standing(level), vehicle), {0, 0, 40}, kFloat);
}

// Two heads that lean outwards, a metre apart.
TEST(Georeference, EachHeadHasAPlaceAndAnAngleOfItsOwn) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes.translation() = Eigen::Vector3d(2.0, 0.0, 0.25);
  const auto lean = [](double y_m, double roll_deg) {
    const auto pose = MakePose({0.1, y_m, 0.0}, RotationFromRpy(Deg2Rad(roll_deg), 0.0, 0.0));
    return SonarHead{pose, pose};
  };
  const SonarHead port = lean(-0.5, 30.0);
  vehicle.T_mbes_tx = port.T_mbes_tx;
  vehicle.T_mbes_rx = port.T_mbes_rx;
  vehicle.more_heads = {lean(0.5, -30.0)};
  const auto east = MakePose({10, 20, 5}, RotationFromRpy(0.0, 0.0, kPi / 2.0));
  MbesPing ping = Ping({Beam(0, 0, 40)});
  const double out = 0.5 + 20.0;
  const double depth = 5.25 + 40.0 * std::sqrt(0.75);
  ExpectNear(OnlySounding(ping, Standing(east), vehicle), {10 + out, 22.1, depth}, kFloat);
  ping.head = 1;
  ExpectNear(OnlySounding(ping, Standing(east), vehicle), {10 - out, 22.1, depth}, kFloat);
  ping.head = 2;  // the vehicle has none
  ExpectNear(OnlySounding(ping, Standing(east), vehicle), {10 + out, 22.1, depth}, kFloat);
}

// Three parts that send at times of their own, of a transmitter turned by a quarter, on a vehicle
// that moves and rolls.
TEST(Georeference, EachPartOfTheTransmitterHasItsOwnPlace) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes = MakePose({0.3, 0.0, 0.5}, RotationFromRpy(0.02, 0.01, 0.0));
  vehicle.T_mbes_tx = MakePose({-0.3, -0.1, 0.02}, RotationFromRpy(0.01, 0.015, Deg2Rad(85.0)));
  vehicle.T_mbes_rx = MakePose({0.05, 0.03, 0.0}, RotationFromRpy(0.0, 0.0, Deg2Rad(90.0)));
  vehicle.p_tx_parts_m = {{0.1, -0.06, -0.01}, {0.0, 0.0, 0.0}, {-0.1, 0.06, -0.02}};
  const auto pose_at = [](Time t) -> std::optional<Eigen::Isometry3d> {
    const double s = ToSeconds(t - kPing);
    return MakePose({10.0 + 3.0 * s, 20.0, 5.0}, RotationFromRpy(0.03 + 0.3 * s, -0.04, 1.0));
  };
  MbesPing ping = Ping({});
  for (int i = 0; i < 30; ++i) {
    MbesBeam beam = Beam(2.0 * i - 30.0, 1.0, 5.0);
    beam.tx_array = static_cast<std::uint8_t>(i / 10);
    beam.tx_delay_s = 0.002f * static_cast<float>(i / 10);
    ping.beams.push_back(beam);
  }
  const auto together = Georeference(ping, pose_at, vehicle, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(together);
  ASSERT_EQ(together->soundings.size(), ping.beams.size());
  EXPECT_EQ(together->beams_of_unknown_part, 0);
  const auto with_one_place = [&](std::size_t part) {
    VehicleGeometry one = vehicle;
    one.T_mbes_tx = vehicle.T_mbes_tx * Eigen::Translation3d(vehicle.p_tx_parts_m[part]);
    one.p_tx_parts_m.clear();
    return Georeference(ping, pose_at, one, RayTracer::Constant(kSpeed));
  };
  for (std::size_t i = 0; i < ping.beams.size(); ++i)
    ExpectNear(together->soundings[i].p_map, with_one_place(i / 10)->soundings[i].p_map, 1e-9);

  // A part that the vehicle does not have.
  for (std::size_t i = 20; i < 30; ++i) ping.beams[i].tx_array = 7;
  const auto unknown = Georeference(ping, pose_at, vehicle, RayTracer::Constant(kSpeed));
  EXPECT_EQ(unknown->beams_of_unknown_part, 10);
  ExpectNear(unknown->soundings[25].p_map, with_one_place(0)->soundings[25].p_map, 1e-9);
  vehicle.p_tx_parts_m.clear();
  EXPECT_EQ(
      Georeference(ping, pose_at, vehicle, RayTracer::Constant(kSpeed))->beams_of_unknown_part, 0);
}

// A ship over deep water: it rolls by 5 degrees in 8 s while a ping is on its way for 12 s.
TEST(Georeference, TakesTheAttitudeOfALateEcho) {
  const auto roll_rad = [](double s) { return Deg2Rad(5.0) * std::sin(2.0 * kPi / 8.0 * s); };
  const auto rolling = [&](Time t) -> std::optional<Eigen::Isometry3d> {
    return MakePose({0, 0, 5}, RotationFromRpy(roll_rad(ToSeconds(t - kPing)), 0.0, 0.0));
  };
  for (double twtt_s = 11.0; twtt_s < 12.0; twtt_s += 0.01) {
    const double range_m = 0.5 * twtt_s * kSpeed;
    const auto p = OnlySounding(Ping({Beam(60, 0, range_m)}), rolling, {});
    const double across_rad = Deg2Rad(60.0) - roll_rad(twtt_s);
    EXPECT_NEAR(p.y(), range_m * std::sin(across_rad), 0.02) << twtt_s;
  }
}

TEST(Georeference, BothAnglesLieOnTheirCones) {
  const auto level = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  const Eigen::Vector3d p = OnlySounding(Ping({Beam(60, 10, 40)}), Standing(level), {}) / 40.0;
  EXPECT_NEAR(p.x(), std::sin(Deg2Rad(10.0)), 1e-6);
  EXPECT_NEAR(p.y(), std::sin(Deg2Rad(60.0)), 1e-6);
  EXPECT_NEAR(p.norm(), 1.0, 1e-6);
}

// Detections beside each other have the bits of each alone, also where some have no echo.
TEST(EchoFromMidway, IsTheSameOfSeveralBesideEachOther) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto around = [&](const Eigen::Vector3d& axis) {
    return Eigen::Vector3d(axis +
                           0.1 * Eigen::Vector3d(normal(random), normal(random), normal(random)))
        .normalized();
  };
  int found = 0, none = 0;
  for (int trial = 0; trial < 500; ++trial) {
    Detections together;
    std::array<Detection, Detections::kMost> each;
    for (std::size_t i = 0; i < each.size(); ++i) {
      each[i] = {around(Eigen::Vector3d::UnitX()),
                 around(Eigen::Vector3d::UnitY()),
                 0.5 * uniform(random),
                 uniform(random),
                 0.1 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)),
                 uniform(random) < -0.95 ? 0.0 : 10.0 + 5.0 * uniform(random)};
      together.Set(i, each[i]);
    }
    const auto echoes = EchoesFromMidway(together);
    for (std::size_t i = 0; i < each.size(); ++i) {
      const auto alone = EchoFromMidway(each[i]);
      ASSERT_EQ(echoes[i].has_value(), alone.has_value());
      ++(alone ? found : none);
      if (alone) {
        EXPECT_EQ(*echoes[i], *alone);
      }
    }
  }
  EXPECT_GT(found, 1500);
  EXPECT_GT(none, 50);
}

TEST(EchoFromMidway, LiesOnBothConesAlsoOfAxesThatAreNotSquare) {
  const Eigen::Vector3d tx = RotationFromRpy(0.1, 0.05, 0.3) * Eigen::Vector3d::UnitX();
  const Eigen::Vector3d rx = RotationFromRpy(0.15, -0.02, 0.37) * Eigen::Vector3d::UnitY();
  ASSERT_GT(std::abs(tx.dot(rx)), 0.01);
  const Eigen::Vector3d at_one_place = Eigen::Vector3d::Zero();
  const auto d = EchoFromMidway({tx, rx, std::sin(0.2), std::sin(-0.7), at_one_place, 1.0});
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->norm(), 1.0, 1e-12);
  EXPECT_NEAR(d->dot(tx), std::sin(0.2), 1e-12);
  EXPECT_NEAR(d->dot(rx), std::sin(-0.7), 1e-12);
  EXPECT_GT(d->z(), 0.0);
  // An array mounted backwards looks down all the same.
  const auto backwards =
      EchoFromMidway({-tx, rx, std::sin(-0.2), std::sin(-0.7), at_one_place, 1.0});
  ASSERT_TRUE(backwards);
  ExpectNear(*backwards, *d, 1e-12);
  // Cones that miss each other; one and the same axis.
  EXPECT_FALSE(EchoFromMidway({tx, rx, std::sin(1.2), std::sin(1.2), at_one_place, 1.0}));
  EXPECT_FALSE(EchoFromMidway({tx, tx, std::sin(0.1), std::sin(0.1), at_one_place, 1.0}));
}

// A vehicle that moves at 3 m/s north and rolls at 20 deg/s: transmit in one place, receive in
// another. Only the receive array's roll steers the beam across, and the seabed that answers lies
// where the pulse was sent to: abreast of the place of transmission.
TEST(Georeference, TakesThePoseAtTransmitAndAtReceive) {
  const auto moving = [](Time t) -> std::optional<Eigen::Isometry3d> {
    const double s = ToSeconds(t - kPing);
    return MakePose({3.0 * s, 0.0, 10.0}, RotationFromRpy(Deg2Rad(20.0) * s, 0.0, 0.0));
  };
  MbesBeam beam = Beam(0, 0, 37.5);  // 50 ms
  beam.tx_delay_s = 0.01f;
  const auto result = Georeference(Ping({beam}), moving, {}, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(result);
  const double roll_rx = Deg2Rad(20.0) * 0.06;
  // Down to it and back to 15 cm further on are 75 m.
  const double down_m = (75.0 * 75.0 - 0.15 * 0.15) / 150.0;
  const Eigen::Vector3d expected(
      3.0 * 0.01, -down_m * std::sin(roll_rx), 10.0 + down_m * std::cos(roll_rx));
  ExpectNear(result->soundings.at(0).p_map, expected, 1e-4);
  ExpectNear(result->T_map_vehicle.translation(), {0.0, 0.0, 10.0}, 1e-12);
}

// Arrays apart, twisted against each other, the transmitter backwards, over a seabed a few metres
// away: from points to angles and times in closed form, and back.
TEST(Georeference, EachArrayHasItsOwnMounting) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes = MakePose({0.3, 0.0, 0.5}, RotationFromRpy(0.02, 0.01, 0.0));
  vehicle.T_mbes_tx = MakePose({-0.3, -0.1, 0.02}, RotationFromRpy(0.01, 0.015, Deg2Rad(178.0)));
  vehicle.T_mbes_rx = MakePose({0.05, 0.03, 0.0}, RotationFromRpy(-0.01, -0.015, Deg2Rad(-2.0)));
  const auto pose = MakePose({10, 20, 5}, RotationFromRpy(0.03, -0.04, 1.0));
  const Eigen::Isometry3d T_map_tx = pose * vehicle.T_vehicle_mbes * vehicle.T_mbes_tx;
  const Eigen::Isometry3d T_map_rx = pose * vehicle.T_vehicle_mbes * vehicle.T_mbes_rx;
  MbesPing ping = Ping({});
  std::vector<Eigen::Vector3d> seabed;
  for (int i = -6; i <= 6; ++i) {
    seabed.push_back(pose * Eigen::Vector3d(0.1 + 0.05 * i, 1.0 * i, 4.5 + 0.1 * i));
    const Eigen::Vector3d from_tx = T_map_tx.inverse() * seabed.back();
    const Eigen::Vector3d from_rx = T_map_rx.inverse() * seabed.back();
    MbesBeam beam = Beam(0, 0, 0.5 * (from_tx.norm() + from_rx.norm()));
    beam.tx_tilt_rad = static_cast<float>(std::asin(from_tx.normalized().x()));
    beam.rx_angle_rad = static_cast<float>(std::asin(from_rx.normalized().y()));
    ping.beams.push_back(beam);
  }
  const auto result = Georeference(ping, Standing(pose), vehicle, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(result);
  ASSERT_EQ(result->soundings.size(), seabed.size());
  for (std::size_t i = 0; i < seabed.size(); ++i)
    ExpectNear(result->soundings[i].p_map, seabed[i], 2e-4);
}

// Three sectors, sent 6 ms apart under tilts of their own from a vehicle that moves, rolls, pitches
// and turns while the echoes come back: from points on the seabed to what the sonar measures, by
// the laws alone (way of the sound at each instant, angles at each array), and back.
TEST(Georeference, PutsEverySectorWhereItsOwnPulseWasSent) {
  const auto pose_at = [](Time t) {
    const double s = ToSeconds(t - kPing);
    return MakePose({2.5 * s, 0.3 * s, 10.0 + 0.4 * s},
                    RotationFromRpy(0.10 + 0.35 * s, -0.05 - 0.2 * s, 0.7 + 0.15 * s));
  };
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes = MakePose({1.2, 0.1, 0.4}, RotationFromRpy(0.02, 0.01, -0.01));
  vehicle.T_mbes_tx = MakePose({-0.2, 0.0, 0.0}, Eigen::Matrix3d::Identity());
  vehicle.T_mbes_rx = MakePose({0.1, 0.05, 0.0}, Eigen::Matrix3d::Identity());
  const auto tx_at = [&](double s) {
    return pose_at(kPing + FromSeconds(s)) * vehicle.T_vehicle_mbes * vehicle.T_mbes_tx;
  };
  const auto rx_at = [&](double s) {
    return pose_at(kPing + FromSeconds(s)) * vehicle.T_vehicle_mbes * vehicle.T_mbes_rx;
  };

  MbesPing ping = Ping({});
  std::vector<Eigen::Vector3d> seabed;
  for (int i = -12; i <= 12; ++i) {
    const int sector = std::abs(i) / 5;
    const double delay_s = 0.006 * sector;
    seabed.push_back(tx_at(0.0) * Eigen::Vector3d(1.0 * sector, 3.0 * i, 30.0));
    const Eigen::Isometry3d tx = tx_at(delay_s);
    double twtt_s = 0.0;
    for (int round = 0; round < 10; ++round) {
      const Eigen::Vector3d p_rx = rx_at(delay_s + twtt_s).translation();
      twtt_s = ((seabed.back() - tx.translation()).norm() + (seabed.back() - p_rx).norm()) / kSpeed;
    }
    const Eigen::Vector3d from_tx = tx.inverse() * seabed.back();
    const Eigen::Vector3d from_rx = rx_at(delay_s + twtt_s).inverse() * seabed.back();
    MbesBeam beam = Beam(0, 0, 0.5 * kSpeed * twtt_s);
    beam.tx_delay_s = static_cast<float>(delay_s);
    beam.tx_tilt_rad = static_cast<float>(std::asin(from_tx.normalized().x()));
    beam.rx_angle_rad = static_cast<float>(std::asin(from_rx.normalized().y()));
    ping.beams.push_back(beam);
  }
  const auto result = Georeference(ping, pose_at, vehicle, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(result);
  ASSERT_EQ(result->soundings.size(), seabed.size());
  for (std::size_t i = 0; i < seabed.size(); ++i)
    ExpectNear(result->soundings[i].p_map, seabed[i], 1e-3);

  // And the delays are not too short to be seen: left out, they cost the outer sectors centimetres.
  for (MbesBeam& beam : ping.beams) beam.tx_delay_s = 0.0f;
  const auto at_once = Georeference(ping, pose_at, vehicle, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(at_once);
  EXPECT_GT((at_once->soundings.front().p_map - seabed.front()).norm(), 0.05);
  EXPECT_GT((at_once->soundings.back().p_map - seabed.back()).norm(), 0.05);
}

TEST(Georeference, RefusesAnEchoFromBetweenTheArrays) {
  VehicleGeometry vehicle;
  vehicle.T_mbes_tx.translation().x() = -0.5;
  const auto level = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  const auto result =
      Georeference(Ping({Beam(0, 0, 0.2)}), Standing(level), vehicle, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(result);
  EXPECT_EQ(result->beams_refused, 1);
}

TEST(Georeference, PitchAtTransmitSteersAlong) {
  const auto pitching = [](Time t) -> std::optional<Eigen::Isometry3d> {
    const double s = ToSeconds(t - kPing);
    return MakePose({0, 0, 0}, RotationFromRpy(0.0, Deg2Rad(5.0) - Deg2Rad(20.0) * s, 0.0));
  };
  const Eigen::Vector3d p = OnlySounding(Ping({Beam(0, 0, 37.5)}), pitching, {});
  ExpectNear(p, {37.5 * std::sin(Deg2Rad(5.0)), 0.0, 37.5 * std::cos(Deg2Rad(5.0))}, 1e-4);
}

MbesPing WidePing() {
  std::vector<MbesBeam> beams;
  for (int i = 0; i < 101; ++i) {
    MbesBeam beam = Beam(-65.0 + 1.3 * i, 1.0 - 0.02 * i, 30.0 + 0.2 * i);
    beam.tx_delay_s = static_cast<float>(1e-3 * (i % 3));
    beams.push_back(beam);
  }
  return Ping(std::move(beams));
}

PoseLookup Swaying(const Eigen::Isometry3d& T_map_start) {
  return [T_map_start](Time t) -> std::optional<Eigen::Isometry3d> {
    const double s = ToSeconds(t - kPing);
    return T_map_start * MakePose({1.5 * s, 0.1 * s, 0.0},
                                  RotationFromRpy(0.05 + 0.2 * s, -0.02 + 0.1 * s, 0.1 * s));
  };
}

TEST(Georeference, MovesAndTurnsWithTheMap) {
  SoundVelocityProfile profile;
  profile.depth_m = {0.0, 20.0, 40.0, 60.0};
  profile.speed_mps = {1510.0, 1505.0, 1485.0, 1484.0};
  const auto rays = RayTracer::Make(profile);
  const MbesPing ping = WidePing();
  VehicleGeometry vehicle;
  vehicle.T_vehicle_mbes = MakePose({1.0, 0.2, 0.3}, RotationFromRpy(0.02, 0.01, -0.03));
  const auto here = MakePose({0, 0, 12}, Eigen::Matrix3d::Identity());
  // Along the map's own plane: depth keeps its meaning in the water.
  const auto T = MakePose({5000.0, -3000.0, 0.0}, RotationFromRpy(0.0, 0.0, 2.0));
  const auto a = Georeference(ping, Swaying(here), vehicle, *rays);
  const auto b = Georeference(ping, Swaying(T * here), vehicle, *rays);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->soundings.size(), ping.beams.size());
  ASSERT_EQ(b->soundings.size(), ping.beams.size());
  for (std::size_t i = 0; i < a->soundings.size(); ++i)
    ExpectNear(T * a->soundings[i].p_map, b->soundings[i].p_map, 1e-8);
}

TEST(Georeference, SkipsAndCountsBeamsThatTheSonarOrReasonRefuses) {
  MbesPing ping = Ping({Beam(0, 0, 40)});
  const auto add = [&](auto change) {
    ping.beams.push_back(Beam(10, 0, 40));
    change(&ping.beams.back());
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  add([](MbesBeam* b) { b->flags = kBeamAmplitude; });
  add([&](MbesBeam* b) { b->flags = 0, b->twtt_s = nan; });
  add([&](MbesBeam* b) { b->twtt_s = nan; });
  add([](MbesBeam* b) { b->twtt_s = 0.0f; });
  add([](MbesBeam* b) { b->twtt_s = 1e30f; });
  add([&](MbesBeam* b) { b->rx_angle_rad = nan; });
  add([&](MbesBeam* b) { b->rx_angle_rad = 1e30f; });
  add([](MbesBeam* b) { b->tx_delay_s = -1.0f; });
  add([&](MbesBeam* b) { b->depth_sigma_ratio = nan; });
  add([](MbesBeam* b) { b->rx_angle_rad = 1.5f, b->tx_tilt_rad = 1.5f; });
  add([](MbesBeam* b) { b->depth_sigma_ratio = 0.01f; });
  const auto level = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  const auto result = Georeference(ping, Standing(level), {}, RayTracer::Constant(kSpeed));
  ASSERT_TRUE(result);
  EXPECT_EQ(result->beams_read, 12);
  EXPECT_EQ(result->beams_invalid, 2);
  EXPECT_EQ(result->beams_refused, 8);
  ASSERT_EQ(result->soundings.size(), 2u);
  EXPECT_EQ(result->soundings[0].beam, 0);
  EXPECT_EQ(result->soundings[0].depth_sigma_m, 0.0f);
  EXPECT_EQ(result->soundings[1].beam, 11);
  EXPECT_NEAR(result->soundings[1].depth_sigma_m, 0.01 * 40.0 * std::cos(Deg2Rad(10.0)), 1e-4);
}

TEST(Georeference, HasNothingWithoutAPoseUpToTheLastEcho) {
  const auto until = [](double last_s) -> PoseLookup {
    return [last_s](Time t) -> std::optional<Eigen::Isometry3d> {
      if (ToSeconds(t - kPing) > last_s) return std::nullopt;
      return Eigen::Isometry3d::Identity();
    };
  };
  const MbesPing ping = Ping({Beam(0, 0, 30.0), Beam(45, 0, 37.5)});
  const RayTracer rays = RayTracer::Constant(kSpeed);
  EXPECT_TRUE(Georeference(ping, until(0.05), {}, rays));
  EXPECT_FALSE(Georeference(ping, until(0.049), {}, rays));
  EXPECT_FALSE(Georeference(ping, until(-1.0), {}, rays));
}

TEST(Georeference, TakesTheProfilesSpeedWhereThePingsCannotBe) {
  MbesPing ping = Ping({Beam(45, 0, 40)});
  const auto level = MakePose({0, 0, 0}, Eigen::Matrix3d::Identity());
  const auto good = Georeference(ping, Standing(level), {}, RayTracer::Constant(kSpeed));
  EXPECT_FALSE(good->speed_from_profile);
  for (const double speed : {0.0, 1e30, std::numeric_limits<double>::quiet_NaN()}) {
    ping.sound_speed_mps = speed;
    const auto result = Georeference(ping, Standing(level), {}, RayTracer::Constant(kSpeed));
    EXPECT_TRUE(result->speed_from_profile);
    ExpectNear(result->soundings.at(0).p_map, good->soundings.at(0).p_map, 1e-12);
  }
}

}  // namespace
}  // namespace seastitch
