#include "common/core/mounting.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "common/core/graph.hpp"

namespace seastitch {
namespace {

// First order in angles of a mrad at distances of 100 m.
constexpr double kSecondOrder_m = 3e-4;

Pose2 Turned(double rad) { return {0.0, 0.0, rad}; }

MountingErrors Wrong() {
  MountingErrors errors;
  errors.sonar_m = {0.6, -0.25};
  errors.dvl_yaw_rad = 1.2e-3;
  return errors;
}

// A vehicle on a straight line that knows its heading, told wrong how its sensors are mounted.
class Line {
 public:
  Line(const Pose2& T_map_frame, const MountingErrors& errors)
      : T_map_frame_(T_map_frame), errors_(errors) {}

  // A sounding at `place`, which the vehicle saw abeam of its sonar: where it was told to be in the
  // level frame of the submap.
  Eigen::Vector2d Told(const Eigen::Vector2d& place) const {
    const Eigen::Vector2d from_frame = Inverse(T_map_frame_) * place;
    const Eigen::Vector2d travelled(from_frame.x() - errors_.sonar_m.x(), 0.0);
    const Eigen::Vector2d from_vehicle = from_frame - travelled;
    const Eigen::Vector2d told_travelled = Turned(-errors_.dvl_yaw_rad) * travelled;
    return told_travelled + from_vehicle - errors_.sonar_m;
  }

 private:
  Pose2 T_map_frame_;
  MountingErrors errors_;
};

struct Draw {
  std::mt19937 random{7};

  double Within(double most) { return std::uniform_real_distribution<double>(-most, most)(random); }
  Pose2 Pose() { return {Within(1000.0), Within(1000.0), Within(kPi)}; }
  // Within reach of a submap there.
  Eigen::Vector2d Near(const Pose2& T) { return T * Eigen::Vector2d(Within(50.0), Within(40.0)); }
};

TEST(Mounting, SoundingsBelongWhereTheyWereOnceTheyAreShearedAndTheirFrameIsShifted) {
  Draw draw;
  const MountingErrors errors = Wrong();
  for (int i = 0; i < 100; ++i) {
    const Pose2 T_map_vehicle = draw.Pose();
    const Eigen::Vector2d place = draw.Near(T_map_vehicle);
    const Eigen::Vector2d told = Line(T_map_vehicle, errors).Told(place);
    const Eigen::Vector2d put =
        SoundingPose(T_map_vehicle, errors) * (told + Shear(told, errors.dvl_yaw_rad));
    EXPECT_LT((put - place).norm(), 1e-3);  // what is left of the shear along the sonar's own shift
    EXPECT_GT((T_map_vehicle * told - place).norm(), 0.5);
  }
}

TEST(Mounting, ASubmapIsStraightenedByTheShearInItsLevelFrame) {
  const Eigen::Isometry3d T_map_submap = MakePose({5.0, 6.0, 7.0}, RotationFromRpy(0.1, -0.2, 0.7));
  const Eigen::Vector3d p(20.0, -30.0, 15.0);
  const Eigen::Vector3d level = LevelFromBody(T_map_submap) * p;
  const Eigen::Vector3d straight = StraightFromBody(T_map_submap, 0.01) * p;
  EXPECT_NEAR(
      (straight.head<2>() - level.head<2>() - Shear(level.head<2>(), 0.01)).norm(), 0.0, 1e-12);
  EXPECT_EQ(straight.z(), level.z());
}

TEST(Mounting, ALoopClosureMeasuresWhereTheSoundingsOfBothBelong) {
  Draw draw;
  const MountingErrors errors = Wrong();
  for (int i = 0; i < 100; ++i) {
    const Pose2 from = draw.Pose();
    const Eigen::Vector2d place = draw.Near(from);
    const Pose2 to{place.x() + draw.Within(40.0), place.y() + draw.Within(40.0), draw.Within(kPi)};
    const double yaw = WrapAngle(to.yaw - from.yaw);
    const Eigen::Vector2d in_from = Line(from, errors).Told(place);
    const Eigen::Vector2d t = in_from - Turned(yaw) * Line(to, errors).Told(place);
    const Pose2 measured{t.x(), t.y(), yaw};
    const Eigen::Vector3d expected =
        (Inverse(SoundingPose(from, errors)) * SoundingPose(to, errors)).Vector();
    const Eigen::Vector3d corrected =
        measured.Vector() + LoopClosureByMounting(measured, in_from) * errors.Vector();
    EXPECT_LT((corrected - expected).head<2>().norm(), 2e-3);
    EXPECT_NEAR(WrapAngle(corrected.z() - expected.z()), 0.0, 1e-12);
  }
}

// Of two vehicles, each told wrong in its own way. The closure is the rigid motion that fits the
// soundings of a circle best.
TEST(Mounting, ALoopClosureOfTwoVehiclesDependsOnTheErrorsOfBoth) {
  Draw draw;
  const MountingErrors of_from = Wrong();
  MountingErrors of_to;
  of_to.sonar_m = {-0.4, 0.5};
  of_to.dvl_yaw_rad = -0.9e-3;
  for (int i = 0; i < 100; ++i) {
    const Pose2 from = draw.Pose();
    const Eigen::Vector2d place = draw.Near(from);
    const Pose2 to{place.x() + draw.Within(40.0), place.y() + draw.Within(40.0), draw.Within(kPi)};
    Eigen::Matrix<double, 2, 12> in_from, in_to;
    for (int k = 0; k < 12; ++k) {
      const Eigen::Vector2d on_circle = place + Turned(kPi / 6.0 * k) * Eigen::Vector2d(10.0, 0.0);
      in_from.col(k) = Line(from, of_from).Told(on_circle);
      in_to.col(k) = Line(to, of_to).Told(on_circle);
    }
    const Eigen::Matrix3d fit = Eigen::umeyama(in_to, in_from, false);
    GraphEdge edge;
    edge.kind = EdgeKind::kLoopClosure;
    edge.to.value = 1;
    edge.T_from_to = {fit(0, 2), fit(1, 2), std::atan2(fit(1, 0), fit(0, 0))};
    edge.overlap_center_m = in_from.rowwise().mean();
    const Eigen::Vector3d expected =
        (Inverse(SoundingPose(from, of_from)) * SoundingPose(to, of_to)).Vector();
    const Eigen::Vector3d corrected =
        edge.T_from_to.Vector() + MountingCorrection(ByMounting(edge, false), of_from, of_to);
    EXPECT_LT((corrected - expected).head<2>().norm(), 2e-3);
    EXPECT_NEAR(WrapAngle(corrected.z() - expected.z()), 0.0, 1e-5);
    EXPECT_GT(std::abs(WrapAngle(edge.T_from_to.yaw - expected.z())), 1e-3);  // without
    const EdgeByMounting by = ByMounting(edge, false);
    EXPECT_LT((by.of_from + by.of_to - ByMounting(edge, true).of_to).norm(), 1e-9);
  }
}

TEST(Mounting, ADeadReckonedStepIsTurnedWithTheDvl) {
  Draw draw;
  const MountingErrors errors = Wrong();
  for (int i = 0; i < 100; ++i) {
    const Pose2 from = draw.Pose();
    const Pose2 step{draw.Within(100.0), draw.Within(100.0), draw.Within(kPi)};
    const Pose2 to = from * step;
    const Eigen::Vector2d t = Turned(-errors.dvl_yaw_rad) * step.Translation();
    const Pose2 told{t.x(), t.y(), step.yaw};
    const Pose2 travelled = TravelledPose(told, errors);
    EXPECT_LT((travelled.Vector() - step.Vector()).norm(), 1e-9);
    const Eigen::Vector3d expected =
        (Inverse(SoundingPose(from, errors)) * SoundingPose(to, errors)).Vector();
    const Eigen::Vector3d corrected =
        told.Vector() + DeadReckoningByMounting(told) * errors.Vector();
    EXPECT_LT((corrected - expected).head<2>().norm(), kSecondOrder_m);
    EXPECT_NEAR(WrapAngle(corrected.z() - expected.z()), 0.0, 1e-9);
  }
}

TEST(Mounting, APositionIsThatOfTheVehicle) {
  Draw draw;
  const MountingErrors errors = Wrong();
  const Pose2 vehicle = draw.Pose();
  const Eigen::Vector3d corrected =
      vehicle.Vector() + PositionByMounting(vehicle.yaw) * errors.Vector();
  EXPECT_LT((corrected - SoundingPose(vehicle, errors).Vector()).norm(), 1e-9);
  const Pose2 back = VehiclePose(SoundingPose(vehicle, errors), errors);
  EXPECT_LT((back.Vector() - vehicle.Vector()).norm(), 1e-9);
}

}  // namespace
}  // namespace seastitch
