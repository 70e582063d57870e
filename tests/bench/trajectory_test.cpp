#include "bench/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/sensor_models.hpp"
#include "tests/bench/bench_fixtures.hpp"

namespace seastitch::bench {
namespace {

PlanParams Lawn() {
  PlanParams plan;
  plan.lines = 3;
  plan.line_length_m = 60.0;
  plan.spacing_m = 18.0;  // less than 2.6 radii: the turns are loops
  plan.heading_deg = 20.0;
  return plan;
}

Eigen::Vector2d InPlanAxes(const Path& path, double t_s, double heading_deg) {
  return Eigen::Rotation2Dd(-Deg2Rad(heading_deg)) * path.At(t_s).p;
}

TEST(Path, RunsItsLinesAndTheCrossline) {
  const PlanParams plan = Lawn();
  const Path path(plan);
  EXPECT_EQ(path.At(0.0).p, Eigen::Vector2d(0.0, 0.0));
  std::array<double, 3> on_line{};
  double on_crossline = 0.0;
  for (double t = 0.0; t < path.duration_s(); t += 0.1) {
    const Eigen::Vector2d p = InPlanAxes(path, t, plan.heading_deg);
    for (int line = 0; line < 3; ++line)
      if (std::abs(p.y() - line * plan.spacing_m) < 1e-4 && p.x() >= plan.lead_in_m &&
          p.x() <= plan.lead_in_m + plan.line_length_m)
        on_line[std::size_t(line)] += 0.1 * plan.speed_mps;
    if (std::abs(p.x() - plan.lead_in_m - 30.0) < 1e-4 && p.y() > 0.0 && p.y() < 36.0)
      on_crossline += 0.1 * plan.speed_mps;
  }
  for (const double metres : on_line) EXPECT_NEAR(metres, 60.0, 0.5);
  EXPECT_NEAR(on_crossline, 36.0, 0.5);
}

TEST(Path, KeepsSpeedAndRadius) {
  const PlanParams plan = Lawn();
  const Path path(plan);
  constexpr double kH = 1e-3;
  for (double t = kH; t < path.duration_s() - kH; t += 0.37) {
    const Path::State s = path.At(t);
    const Eigen::Vector2d v = (path.At(t + kH).p - path.At(t - kH).p) / (2.0 * kH);
    EXPECT_NEAR(v.x(), plan.speed_mps * std::cos(s.course_rad), 1e-6) << t;
    EXPECT_NEAR(v.y(), plan.speed_mps * std::sin(s.course_rad), 1e-6) << t;
    EXPECT_LE(std::abs(s.course_rate_radps), plan.speed_mps / plan.turn_radius_m + 1e-9);
  }
}

class TrajectoryTest : public ::testing::Test {
 protected:
  TrajectoryTest() {
    ProceduralParams params;
    params.relief.rms_m = 1.0;
    terrain_ = std::make_unique<ProceduralTerrain>(params, 4);
    trajectory_ = std::make_unique<Trajectory>(Path(Lawn()), Lawn(), MotionParams{}, *terrain_, 4);
  }

  std::unique_ptr<Terrain> terrain_;
  std::unique_ptr<Trajectory> trajectory_;
};

TEST_F(TrajectoryTest, StartsAtTheOriginOfTheMap) {
  const Eigen::Vector3d p = trajectory_->PoseAt(0.0).translation();
  EXPECT_EQ(p.x(), 0.0);
  EXPECT_EQ(p.y(), 0.0);
}

TEST_F(TrajectoryTest, FollowsTheSeabed) {
  double sum = 0.0;
  int n = 0;
  for (double t = 0.0; t < trajectory_->duration_s(); t += 1.0, ++n) {
    const Eigen::Vector3d p = trajectory_->PoseAt(t).translation();
    const double altitude = *terrain_->DepthAt(p.x(), p.y()) - p.z();
    EXPECT_NEAR(altitude, Lawn().altitude_m, 3.0);
    sum += altitude;
  }
  EXPECT_NEAR(sum / n, Lawn().altitude_m, 0.2);
}

TEST_F(TrajectoryTest, RatesAndAccelerationsAreThoseOfThePoses) {
  constexpr double kH = 1e-4;
  for (double t = 0.1; t < trajectory_->duration_s() - 0.1; t += 0.73) {
    const TrueState s = trajectory_->StateAt(t);
    const TrueState before = trajectory_->StateAt(t - kH);
    const TrueState after = trajectory_->StateAt(t + kH);
    const Eigen::Vector3d v =
        (after.T_map_vehicle.translation() - before.T_map_vehicle.translation()) / (2.0 * kH);
    EXPECT_LT((v - s.v_map_mps).norm(), 1e-5) << t;
    EXPECT_LT(((after.v_map_mps - before.v_map_mps) / (2.0 * kH) - s.a_map_mps2).norm(), 1e-4) << t;
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(before.T_map_vehicle.linear().transpose() * after.T_map_vehicle.linear()));
    EXPECT_LT((turn.axis() * turn.angle() / (2.0 * kH) - s.rate_vehicle_radps).norm(), 1e-6) << t;
    EXPECT_LT(((after.rate_vehicle_radps - before.rate_vehicle_radps) / (2.0 * kH) -
               s.accel_vehicle_radps2)
                  .norm(),
              1e-4)
        << t;
  }
}

// Rates and specific force of an ideal unit, integrated over the turning Earth from the true start,
// lead back to the true pose: signs, lever arm, gravity, Coriolis and all.
TEST_F(TrajectoryTest, IntegratedInertialDataReproduceTheTrack) {
  const VehicleGeometry vehicle = CrookedVehicle();
  const Water water({{0.0}, {1500.0}});
  const Scene scene{*trajectory_, *terrain_, water, vehicle};
  ImuModel imu({400.0, 0.0}, SensorErrors::OfClass("ideal"), scene, 1);

  // 15.041 deg/h; gravity of the 1980 formula, which is that of WGS 84 to 1e-6.
  const double sine2 = std::pow(std::sin(vehicle.datum.latitude_rad), 2);
  const double sine2_double = std::pow(std::sin(2.0 * vehicle.datum.latitude_rad), 2);
  const Eigen::Vector3d gravity(
      0.0, 0.0, 9.780327 * (1.0 + 0.0053024 * sine2 - 0.0000058 * sine2_double));
  const Eigen::Vector3d earth =
      Deg2Rad(15.041067 / 3600.0) * Eigen::Vector3d(std::cos(vehicle.datum.latitude_rad),
                                                    0.0,
                                                    -std::sin(vehicle.datum.latitude_rad));

  const auto imu_pose = [&](double t) {
    return Eigen::Isometry3d(trajectory_->PoseAt(t) * vehicle.T_vehicle_imu);
  };
  const TrueState start = trajectory_->StateAt(0.0);
  const Eigen::Vector3d arm = vehicle.T_vehicle_imu.translation();
  Eigen::Matrix3d R = imu_pose(0.0).linear();
  Eigen::Vector3d p = imu_pose(0.0).translation();
  Eigen::Vector3d v =
      start.v_map_mps + start.T_map_vehicle.linear() * start.rate_vehicle_radps.cross(arm);
  constexpr double kDt = 1.0 / 400.0;
  constexpr int kSteps = 90 * 400;  // a line, and the turn after it
  ImuSample last = imu.SampleAt(0.0);
  for (int i = 1; i <= kSteps; ++i) {
    const ImuSample next = imu.SampleAt(i * kDt);
    const Eigen::Vector3d w =
        0.5 * (last.angular_rate_radps + next.angular_rate_radps) - R.transpose() * earth;
    const Eigen::Matrix3d R_next =
        R * Eigen::AngleAxisd(w.norm() * kDt, w.normalized()).toRotationMatrix();
    const Eigen::Vector3d a =
        0.5 * (R * last.specific_force_mps2 + R_next * next.specific_force_mps2) + gravity -
        2.0 * earth.cross(v);
    p += v * kDt + 0.5 * a * kDt * kDt;
    v += a * kDt;
    R = R_next;
    last = next;
  }
  const Eigen::Isometry3d truth = imu_pose(kSteps * kDt);
  EXPECT_LT((p - truth.translation()).norm(), 0.05);
  EXPECT_LT(Eigen::AngleAxisd(Eigen::Matrix3d(R.transpose() * truth.linear())).angle(), 2e-6);
}

}  // namespace
}  // namespace seastitch::bench
