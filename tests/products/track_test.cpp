#include "products/track/track.hpp"

#include <gmock/gmock.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <sstream>

#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

Time At(double s) { return FromUtime(1'000'000'000'000) + FromSeconds(s); }

// The dead-reckoned path: a wide circle at 1.5 m/s, far from the map's origin.
Pose2 PathAt(double s) {
  const double radius = 60.0, angle = 1.5 * s / radius;
  return {4000.0 + radius * std::sin(angle), -radius * std::cos(angle), WrapAngle(angle)};
}

const std::vector<double> kFrameTimes = {10, 40, 75, 160};

struct Bent {
  Survey survey;
  std::vector<Pose2> corrected;
  std::vector<std::optional<Eigen::Vector3d>> sigmas;

  Bent() {
    const std::vector<Pose2> corrections = {
        {0, 0, 0}, {0.5, -0.2, 0.01}, {1.5, 0.8, -0.02}, {-2.0, 0.1, 0.015}};
    for (std::size_t i = 0; i < kFrameTimes.size(); ++i) {
      SurveySubmap s;
      s.id.value = static_cast<int>(i);
      s.frame_time = At(kFrameTimes[i]);
      const Pose2 p = PathAt(kFrameTimes[i]);
      s.T_map_submap = MakePose({p.x, p.y, 20.0}, RotationFromRpy(0.02, -0.03, p.yaw));
      survey.submaps.push_back(s);
      const Pose2& c = corrections[i];
      corrected.push_back({p.x + c.x, p.y + c.y, WrapAngle(p.yaw + c.yaw)});
      sigmas.push_back(Eigen::Vector3d(0.1 * static_cast<double>(i), 0.2, 0.001));
    }
  }
  TrackCorrection Correction() const { return {survey, {corrected, {}}, sigmas}; }
};

TEST(TrackCorrection, PassesThroughEveryCorrectedFrame) {
  const Bent bent;
  const TrackCorrection correction = bent.Correction();
  for (std::size_t i = 0; i < kFrameTimes.size(); ++i) {
    const Pose2 got = correction(At(kFrameTimes[i]), PathAt(kFrameTimes[i]));
    EXPECT_NEAR(got.x, bent.corrected[i].x, 1e-9);
    EXPECT_NEAR(got.y, bent.corrected[i].y, 1e-9);
    EXPECT_NEAR(WrapAngle(got.yaw - bent.corrected[i].yaw), 0.0, 1e-12);
  }
}

TEST(TrackCorrection, IsOfTheVehicleAndNotOfItsSoundings) {
  const Bent bent;
  MountingErrors mounting;
  mounting.sonar_m = {0.5, -0.2};
  mounting.dvl_yaw_rad = 0.01;
  const TrackCorrection correction(
      bent.survey, {bent.corrected, std::vector(bent.corrected.size(), mounting)}, bent.sigmas);
  const Pose2 at_frame = correction(At(kFrameTimes[0]), PathAt(kFrameTimes[0]));
  const Pose2& soundings = bent.corrected[0];
  const Eigen::Vector2d sonar = at_frame * mounting.sonar_m;
  EXPECT_LT((sonar - soundings.Translation()).norm(), 1e-9);
  // Before the first frame by dead reckoning alone, along what the DVL measured turned with it.
  const Pose2 before = correction(At(0.0), PathAt(0.0));
  const Pose2 told = Inverse(PathAt(kFrameTimes[0])) * PathAt(0.0);
  const Pose2 went = Inverse(at_frame) * before;
  EXPECT_NEAR(std::atan2(went.y, went.x) - std::atan2(told.y, told.x), 0.01, 1e-9);
  EXPECT_NEAR(went.Translation().norm(), told.Translation().norm(), 1e-9);
  EXPECT_NEAR(went.yaw, told.yaw, 1e-9);
}

TEST(TrackCorrection, KeepsPositionAndVelocityContinuousAtFrames) {
  const Bent bent;
  const TrackCorrection correction = bent.Correction();
  const auto at = [&](double s) { return correction(At(s), PathAt(s)).Vector(); };
  const double h = 0.01;
  for (const double frame : kFrameTimes) {
    const Eigen::Vector3d left = (at(frame) - at(frame - h)) / h;
    const Eigen::Vector3d right = (at(frame + h) - at(frame)) / h;
    EXPECT_LT((right - left).norm(), 2e-3) << frame;
    EXPECT_LT((at(frame + 1e-6) - at(frame - 1e-6)).norm(), 1e-5) << frame;
  }
}

TEST(TrackCorrection, TurnsTheTrackWithItsSubmapAtAFrame) {
  const Bent bent;
  const TrackCorrection correction = bent.Correction();
  const double h = 0.01;
  const Pose2 a = correction(At(40 - h), PathAt(40 - h)),
              b = correction(At(40 + h), PathAt(40 + h));
  const double course = std::atan2(b.y - a.y, b.x - a.x);
  EXPECT_NEAR(course, bent.corrected[1].yaw, 1e-4);
}

TEST(TrackCorrection, FollowsTheNearestSubmapOutsideOfAllFrames) {
  const Bent bent;
  const TrackCorrection correction = bent.Correction();
  const Pose2 start = correction(At(0), PathAt(0));
  EXPECT_NEAR((start.Translation() - PathAt(0).Translation()).norm(), 0.0, 1e-9);
  const Pose2 end = correction(At(200), PathAt(200));
  const Pose2 expected = bent.corrected[3] * (Inverse(PathAt(kFrameTimes[3])) * PathAt(200));
  EXPECT_NEAR((end.Translation() - expected.Translation()).norm(), 0.0, 1e-9);
}

TEST(TrackCorrection, NeverLeavesTheRangeOfTheTwoRigidMotions) {
  const Bent bent;
  const TrackCorrection correction = bent.Correction();
  for (double s = 40; s < 75; s += 0.5) {
    const auto moved = [&](std::size_t i) {
      return (bent.corrected[i] * (Inverse(PathAt(kFrameTimes[i])) * PathAt(s))).Translation();
    };
    const Eigen::Vector2d a = moved(1), b = moved(2);
    const Eigen::Vector2d p = correction(At(s), PathAt(s)).Translation();
    EXPECT_NEAR((p - a).norm() + (b - p).norm(), (b - a).norm(), 1e-6) << s;
  }
}

TEST(TrackCorrection, BlendsHeadingTheShortWayRound) {
  Survey survey;
  std::vector<Pose2> corrected;
  for (int i = 0; i < 2; ++i) {
    SurveySubmap s;
    s.id.value = i;
    s.frame_time = At(10 * i);
    s.T_map_submap = MakePose({0, 0, 0}, RotationFromRpy(0, 0, 3.13));
    survey.submaps.push_back(s);
    corrected.push_back({0, 0, i == 0 ? 3.13 : -3.13});
  }
  const TrackCorrection correction(survey, {corrected, {}}, {std::nullopt, std::nullopt});
  EXPECT_NEAR(std::abs(correction(At(5), {0, 0, 3.13}).yaw), kPi, 1e-9);
}

TEST(TrackCorrection, CountsFramesOfOneTimeOnce) {
  Bent bent;
  for (SurveySubmap& s : bent.survey.submaps) s.frame_time = At(10);
  const TrackCorrection correction = bent.Correction();
  EXPECT_TRUE(correction(At(11), PathAt(11)).Vector().allFinite());
}

// Navigation moved its estimate by 2 m and a degree at 55 s, and knows later that it was off
// before.
TEST(TrackCorrection, HasNoStepWhereNavigationMovedItsEstimate) {
  Bent bent;
  const Pose2 step{2.0, -1.0, Deg2Rad(1.0)};
  const auto given_at = [&](double s) { return s < 55.0 ? step * PathAt(s) : PathAt(s); };
  std::vector<SmoothedPose> smoothed;
  const auto velocity_at = [](double s) {
    return Eigen::Vector2d(1.5 * std::cos(PathAt(s).yaw), 1.5 * std::sin(PathAt(s).yaw));
  };
  for (int s = 0; s <= 200; ++s)
    smoothed.push_back({At(s), given_at(s), PathAt(s), velocity_at(s)});
  for (int i = 0; i <= 2000; ++i) {
    const Pose2 p = given_at(0.1 * i);
    bent.survey.track.push_back({At(0.1 * i), {p.x, p.y, 20.0}, {0.0, 0.0, p.yaw}});
  }
  for (std::size_t i = 0; i < kFrameTimes.size(); ++i) {
    const Pose2 p = given_at(kFrameTimes[i]);
    bent.survey.submaps[i].T_map_submap =
        MakePose({p.x, p.y, 20.0}, RotationFromRpy(0.0, 0.0, p.yaw));
  }
  const auto largest_step_m = [](const std::vector<CorrectedState>& track) {
    double largest_m = 0.0;
    for (std::size_t i = 1; i < track.size(); ++i)
      largest_m = std::max(
          largest_m,
          (track[i].corrected.Translation() - track[i - 1].corrected.Translation()).norm());
    return largest_m;
  };
  EXPECT_GT(largest_step_m(CorrectTrack(bent.survey, bent.Correction())), 2.0);
  Smooth(smoothed, 0, &bent.survey.track);
  const std::vector<CorrectedState> track = CorrectTrack(bent.survey, bent.Correction());
  EXPECT_LT(largest_step_m(track), 0.1 * 1.5 + 0.03);
  for (std::size_t i = 0; i < kFrameTimes.size(); ++i) {
    const auto at = static_cast<std::size_t>(std::lround(10.0 * kFrameTimes[i]));
    EXPECT_LT((track[at].corrected.Vector() - bent.corrected[i].Vector()).norm(), 1e-3) << i;
  }
}

// States before the first smoothed pose and after the last move rigidly; between them they are as
// the cubic has them.
TEST(Smooth, MovesTheStatesOfOneDive) {
  std::vector<TrackState> track;
  for (const double s : {0.0, 10.0, 20.0})
    track.push_back({At(s), {PathAt(s).x, PathAt(s).y, 20.0}, {0.0, 0.0, PathAt(s).yaw}});
  track.push_back({At(10.0), {1.0, 2.0, 3.0}, {0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), 1});
  const Pose2 by{3.0, 4.0, 0.1};
  const auto pose_at = [&](double s) {
    const double yaw = PathAt(s).yaw + by.yaw;
    return SmoothedPose{
        At(s), PathAt(s), by * PathAt(s), {1.5 * std::cos(yaw), 1.5 * std::sin(yaw)}};
  };
  Smooth({pose_at(5.0), pose_at(15.0)}, 0, &track);
  for (const std::size_t i : {0u, 2u})
    EXPECT_LT((track[i].smoothed->Vector() - (by * track[i].Level()).Vector()).norm(), 1e-9) << i;
  EXPECT_LT((track[1].smoothed->Vector() - (by * track[1].Level()).Vector()).norm(), 1e-3);
  EXPECT_FALSE(track[3].smoothed);
}

TEST(TrackCsv, HasAHeaderWithUnitsAndTheLatitudeOfTheCorrectedPosition) {
  const Bent bent;
  Survey survey = bent.survey;
  survey.track.push_back(
      {At(40), {PathAt(40).x, PathAt(40).y, 20.0}, {0.02, -0.03, PathAt(40).yaw}});
  const std::vector<CorrectedState> track = CorrectTrack(survey, bent.Correction());
  const Datum datum{57.0, 11.0};
  std::istringstream csv(TrackCsv(track, datum));
  std::string header, line, more;
  std::getline(csv, header);
  std::getline(csv, line);
  EXPECT_FALSE(std::getline(csv, more));
  EXPECT_EQ(header,
            "utime_us,dr_x_m,dr_y_m,dr_z_m,dr_roll_deg,dr_pitch_deg,dr_yaw_deg,x_m,y_m,z_m,yaw_deg,"
            "sigma_x_m,sigma_y_m,sigma_yaw_deg,latitude_deg,longitude_deg");
  std::vector<double> v;
  std::istringstream fields(line);
  for (std::string field; std::getline(fields, field, ',');) v.push_back(std::stod(field));
  ASSERT_EQ(v.size(), 16u);
  EXPECT_NEAR(v[4], Rad2Deg(0.02), 1e-5);
  EXPECT_NEAR(v[7], bent.corrected[1].x, 1e-4);
  EXPECT_NEAR(v[9], 20.0, 1e-9);
  EXPECT_NEAR(v[11], 0.1, 1e-9);
  const GeographicLib::LocalCartesian local(57.0, 11.0);
  double east = 0, north = 0, up = 0;
  local.Forward(v[14], v[15], 0.0, east, north, up);
  EXPECT_NEAR(north, bent.corrected[1].x, 0.02);
  EXPECT_NEAR(east, bent.corrected[1].y, 0.02);
}

TEST(CorrectTrack, OfASurveyWithoutATrackIsItsSubmapFrames) {
  const Bent bent;
  const std::vector<CorrectedState> track = CorrectTrack(bent.survey, bent.Correction());
  ASSERT_EQ(track.size(), kFrameTimes.size());
  EXPECT_NEAR(track[2].corrected.x, bent.corrected[2].x, 1e-9);
}

}  // namespace
}  // namespace seastitch
