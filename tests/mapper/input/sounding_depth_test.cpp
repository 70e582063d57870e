#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

namespace seastitch {
namespace {

constexpr double kImuHz = 50.0;
constexpr double kSpeedMps = 1500.0;
constexpr double kSeabedM = 40.0;  // below the water line, flat
constexpr double kFirstPingS = 5.0;
constexpr double kLastPingS = 60.0;

// Of the vertical below the sonar and 45 degrees to either side, in the vertical plane across the
// vehicle: what a sonar would measure that stands still while it listens.
MbesPing PingAt(const test::TruthState& truth, const VehicleGeometry& vehicle) {
  MbesPing ping;
  ping.time = test::At(truth.t);
  ping.sound_speed_mps = kSpeedMps;
  const Eigen::Isometry3d T_map_mbes = truth.T_map_vehicle * vehicle.T_vehicle_mbes;
  const double yaw = LevelPose(truth.T_map_vehicle).yaw;
  const double down_m = kSeabedM - T_map_mbes.translation().z();
  for (const double across_m : {-down_m, 0.0, down_m}) {
    const Eigen::Vector3d way(-across_m * std::sin(yaw), across_m * std::cos(yaw), down_m);
    const Eigen::Vector3d direction = T_map_mbes.linear().transpose() * way.normalized();
    MbesBeam beam;
    beam.twtt_s = static_cast<float>(2.0 * way.norm() / kSpeedMps);
    beam.tx_tilt_rad = static_cast<float>(std::asin(direction.x()));
    beam.rx_angle_rad = static_cast<float>(std::asin(direction.y()));
    beam.flags = kBeamValid;
    ping.beams.push_back(beam);
  }
  return ping;
}

// Largest error of depth over the pings of a vehicle that rolls, pitches and heaves slowly, whose
// pressure port is taken to be at p_vehicle_depth_m. Sensors without errors.
void FindWorstDepthError(const Eigen::Vector3d& p_vehicle_depth_m, double* worst_m) {
  VehicleGeometry vehicle = test::TestVehicle();
  vehicle.p_vehicle_depth_m = {1.5, 0.4, -0.3};
  vehicle.T_vehicle_mbes = MakePose({-1.0, -0.3, 0.5}, RotationFromRpy(0.03, -0.02, 0.05));
  test::Motion motion;
  motion.roll_amplitude_rad = Deg2Rad(12.0);
  motion.pitch_amplitude_rad = Deg2Rad(10.0);
  const auto truth = test::Truth(motion, vehicle, kLastPingS + 1.0, kImuHz);

  const NavigationParams params;
  test::Sensors perfect(params, kImuHz, 1, 0.0);
  VehicleGeometry believed = vehicle;
  believed.p_vehicle_depth_m = p_vehicle_depth_m;
  DeadReckoning navigation(params, believed);
  test::Feed(truth, {}, &perfect, &navigation);

  *worst_m = 0.0;
  for (const test::TruthState& state : truth) {
    if (state.t < kFirstPingS || state.t > kLastPingS) continue;
    // While it listens the vehicle stands as navigation has it at the ping.
    const auto nav = navigation.StateAt(test::At(state.t));
    ASSERT_TRUE(nav) << "at " << state.t << " s";
    const auto pose = [&](Time) { return nav->T_map_vehicle; };
    const auto soundings =
        Georeference(PingAt(state, vehicle), pose, vehicle, RayTracer::Constant(kSpeedMps));
    ASSERT_TRUE(soundings) << "at " << state.t << " s";
    ASSERT_EQ(soundings->soundings.size(), 3u) << "at " << state.t << " s";
    for (const Sounding& s : soundings->soundings) {
      ASSERT_TRUE(s.p_map.allFinite()) << "at " << state.t << " s";
      *worst_m = std::max(*worst_m, std::abs(s.p_map.z() - kSeabedM));
    }
  }
}

// Pressure counts from the water line, so a sounding's depth does too: neither draft nor height
// of the vehicle's reference point enters, only where port and sonar are in it.
TEST(SoundingDepth, IsBelowTheWaterLineWhateverRollAndPitchDoToPortAndSonar) {
  double worst_m = 0.0;
  ASSERT_NO_FATAL_FAILURE(FindWorstDepthError({1.5, 0.4, -0.3}, &worst_m));
  EXPECT_LT(worst_m, 0.02);
  ASSERT_NO_FATAL_FAILURE(FindWorstDepthError({0.0, 0.0, 0.0}, &worst_m));
  EXPECT_GT(worst_m, 0.3);
}

}  // namespace
}  // namespace seastitch
