#include "tests/mapper/submaps/builder_fixtures.hpp"

namespace seastitch {
namespace {

TEST(SubmapBuilder, SharesNoSoundingBetweenSubmapsAndLosesNone) {
  Drive drive;
  drive.swath.seabed = BumpySeabed;
  drive.swath.outlier_part = 0.01;
  drive.Straight(150.0);
  drive.Finish();
  std::uint64_t read = 0;
  std::uint64_t used = 0;
  for (std::size_t i = 0; i < drive.closed.size(); ++i) {
    const Submap& submap = drive.closed[i];
    if (i > 0) {
      EXPECT_GT(submap.start, drive.closed[i - 1].end);
    }
    EXPECT_LE(submap.start, submap.frame_time);
    EXPECT_LE(submap.frame_time, submap.end);
    read += submap.soundings_read;
    used += submap.soundings_used;
    double behind = 0.0;
    for (const float n : submap.cloud.soundings) behind += static_cast<double>(n);
    EXPECT_EQ(static_cast<std::uint64_t>(behind), submap.soundings_used);
  }
  EXPECT_EQ(read, 128u * drive.swath.is_outlier.size());
  EXPECT_EQ(read - used,
            static_cast<std::uint64_t>(drive.builder.counters().at("soundings_outliers")));
}

TEST(SubmapBuilder, PutsPointsOnTheSeabedInTheFrameOfTheMiddlePing) {
  Drive drive;
  drive.swath.seabed = BumpySeabed;
  drive.swath.sigma_m = 0.0;
  drive.yaw = 0.7;
  drive.Straight(35.0);
  drive.Finish();
  const Submap& submap = drive.closed.at(0);
  double sum = 0.0;
  for (const Eigen::Vector3f& p : submap.cloud.points) {
    const Eigen::Vector3d p_map = submap.T_map_submap * p.cast<double>();
    const double off = p_map.z() - BumpySeabed(p_map.x(), p_map.y());
    EXPECT_LT(std::abs(off), 0.1);  // a voxel's centroid lies off a curved seabed
    sum += off;
  }
  EXPECT_NEAR(sum / static_cast<double>(submap.cloud.size()), 0.0, 0.005);
}

TEST(SubmapBuilder, DropsNearlyAllOutliersOfASwath) {
  Drive drive;
  drive.swath.seabed = BumpySeabed;
  drive.swath.outlier_part = 0.01;
  drive.Straight(150.0);
  drive.Finish();
  double off_seabed = 0.0;
  double all = 0.0;
  for (const Submap& submap : drive.closed) {
    for (std::size_t i = 0; i < submap.cloud.size(); ++i) {
      const Eigen::Vector3d p = submap.T_map_submap * submap.cloud.points[i].cast<double>();
      const bool off = std::abs(p.z() - BumpySeabed(p.x(), p.y())) > 0.9;
      off_seabed += off ? static_cast<double>(submap.cloud.soundings[i]) : 0.0;
      all += static_cast<double>(submap.cloud.soundings[i]);
    }
  }
  EXPECT_LT(off_seabed / all, 0.0001);  // of 0.01
  EXPECT_GT(all / (128.0 * static_cast<double>(drive.swath.is_outlier.size())), 0.98);
}

// Corrections of heading and position during the track: the transform from the true map to the map
// as dead reckoning knows it at `t`.
Pose2 LearnedAt(Time t) {
  const double s = ToSeconds(t.time_since_epoch()) - 1.7e9;
  return {0.1 * s, -0.15 * s, Deg2Rad(0.2) * s};
}
GeoreferencedPing AsBelieved(GeoreferencedPing ping) {
  const Pose2 T = LearnedAt(ping.time);
  const Eigen::Isometry3d T_believed_map =
      MakePose({T.x, T.y, 0.0}, RotationFromRpy(0.0, 0.0, T.yaw));
  ping.T_map_vehicle = T_believed_map * ping.T_map_vehicle;
  for (Sounding& s : ping.soundings) s.p_map = T_believed_map * s.p_map;
  return ping;
}

TEST(SubmapBuilder, DoesNotBendWhereDeadReckoningLearns) {
  const auto Drive = [](const auto& see, SubmapBuilder::Hindsight hindsight) {
    SubmapBuilder builder({}, {}, Loses(0.1, 0.1, Deg2Rad(0.2)), std::move(hindsight));
    SwathMaker swath;
    swath.sigma_m = 0.0;
    swath.seabed = [](double x, double y) { return 20.0 + std::sin(0.3 * x) * std::cos(0.2 * y); };
    for (int i = 0; i < 100; ++i)
      builder.Add(see(swath.At(FromUtime(1'700'000'000'000'000 + 200'000 * i), 0.3 * i, 0.0, 0.0)));
    return *builder.Finish();
  };
  const Submap straight = Drive([](const auto& ping) { return ping; }, NothingLearned);
  const Submap learned = Drive(
      AsBelieved, [](Time anchor, Time t) { return LearnedAt(anchor) * Inverse(LearnedAt(t)); });
  const Submap bent = Drive(AsBelieved, NothingLearned);

  // Voxels move with the frame: every point of one submap has points of the other near it, at its
  // height.
  const auto height_apart = [&](const Submap& other) {
    double worst = 0.0;
    for (std::size_t i = 0; i < straight.cloud.size(); i += 50) {
      const Eigen::Vector3f& p = straight.cloud.points[i];
      double nearest = 1e9;
      double apart = 0.0;
      for (const Eigen::Vector3f& q : other.cloud.points) {
        const double d = (q - p).head<2>().norm();
        if (d < nearest) {
          nearest = d;
          apart = std::abs(q.z() - p.z());
        }
      }
      worst = std::max(worst, apart);
    }
    return worst;
  };
  EXPECT_LT(height_apart(learned), 0.06);
  EXPECT_GT(height_apart(bent), 0.3);
  // The frame remains the published pose.
  EXPECT_TRUE(learned.T_map_submap.isApprox(bent.T_map_submap));
}

// What stands on a flat seabed, by height above it; 0: nothing.
struct Feature {
  const char* name;
  double (*height)(double x_m, double y_m);
};
class FeatureOnTheSeabed : public testing::TestWithParam<Feature> {};

TEST_P(FeatureOnTheSeabed, IsKeptWhileOutliersGo) {
  const auto height = GetParam().height;
  SubmapBuilder builder({}, {}, Loses(0.1, 0.1, Deg2Rad(0.2)), NothingLearned);
  SwathMaker swath;
  swath.beams = 256;
  swath.sigma_m = 0.03;
  swath.outlier_part = 0.01;
  swath.seabed = [&](double x, double y) { return 20.0 - height(x, y); };
  std::vector<Submap> submaps;
  double outliers = 0.0;
  double on_feature = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double x = 0.15 * i;
    const GeoreferencedPing ping =
        swath.At(FromUtime(1'700'000'000'000'000) + FromSeconds(0.1 * i), x, 0.0, 0.0);
    for (const Sounding& s : ping.soundings) {
      const bool outlier = swath.is_outlier.back()[static_cast<std::size_t>(s.beam)] != 0;
      outliers += outlier ? 1.0 : 0.0;
      on_feature += !outlier && height(s.p_map.x(), s.p_map.y()) > 0.1 ? 1.0 : 0.0;
    }
    if (auto submap = builder.Add(ping)) submaps.push_back(*submap);
  }
  if (auto submap = builder.Finish()) submaps.push_back(*submap);

  double outliers_kept = 0.0;
  double feature_kept = 0.0;
  for (const Submap& submap : submaps) {
    for (std::size_t i = 0; i < submap.cloud.size(); ++i) {
      const Eigen::Vector3d p = submap.T_map_submap * submap.cloud.points[i].cast<double>();
      const double n = submap.cloud.soundings[i];
      double off = 1e9;  // from the surface within a voxel
      for (const double dx : {-0.25, 0.0, 0.25})
        for (const double dy : {-0.25, 0.0, 0.25})
          off = std::min(off, std::abs(p.z() - swath.seabed(p.x() + dx, p.y() + dy)));
      if (off > 0.8)
        outliers_kept += n;
      else if (p.z() < 19.9)
        feature_kept += n;
    }
  }
  RecordProperty("outliers_kept_percent", std::to_string(100.0 * outliers_kept / outliers));
  RecordProperty("feature_kept_percent", std::to_string(100.0 * feature_kept / on_feature));
  ASSERT_GT(on_feature, 200.0);
  EXPECT_LE(outliers_kept, 0.01 * outliers);
  EXPECT_GE(feature_kept, 0.95 * on_feature);
}

INSTANTIATE_TEST_SUITE_P(
    SubmapBuilder,
    FeatureOnTheSeabed,
    testing::Values(Feature{"PipelineAlong",
                            [](double, double y) {
                              const double off = std::abs(y - 4.1);
                              return off < 0.25 ? 0.25 + std::sqrt(0.0625 - off * off) : 0.0;
                            }},
                    Feature{"PipelineAcross",
                            [](double x, double) {
                              const double off = std::abs(x - 31.7);
                              return off < 0.25 ? 0.25 + std::sqrt(0.0625 - off * off) : 0.0;
                            }},
                    Feature{"WreckEdge", [](double x, double) { return x > 40.0 ? 4.0 : 0.0; }},
                    Feature{"Boulders",
                            [](double x, double y) {
                              const double r =
                                  std::hypot(std::remainder(x, 6.0), std::remainder(y, 6.0));
                              return r < 0.5 ? std::sqrt(0.25 - r * r) + 0.2 : 0.0;
                            }}),
    [](const auto& test) { return test.param.name; });

TEST(SubmapBuilder, DropsARunOfBeamsOfOnePing) {
  SubmapBuilder builder({}, {}, Loses(0.1, 0.1, Deg2Rad(0.2)), NothingLearned);
  SwathMaker swath;
  for (int i = 0; i < 100; ++i) {
    GeoreferencedPing ping =
        swath.At(FromUtime(1'700'000'000'000'000) + FromSeconds(0.1 * i), 0.3 * i, 0.0, 0.0);
    if (i % 10 == 5)
      for (std::size_t beam = 60; beam < 68; ++beam) ping.soundings[beam].p_map.z() -= 6.0;
    EXPECT_FALSE(builder.Add(ping));
  }
  const auto submap = builder.Finish();
  ASSERT_TRUE(submap);
  for (const Eigen::Vector3f& p : submap->cloud.points)
    EXPECT_GT((submap->T_map_submap * p.cast<double>()).z(), 19.0);
}

TEST(SubmapBuilder, WeighsSoundingsByWhatTheSonarSaysOfThem) {
  GeoreferencedPing ping;
  ping.time = FromUtime(1'700'000'000'000'000);
  ping.T_map_vehicle = MakePose({0.0, 0.0, 10.0}, Eigen::Matrix3d::Identity());
  for (int i = 0; i < 100; ++i) {  // two soundings per voxel; the upper one has twice the sigma
    const double x = 0.125 + 0.25 * (i % 10);
    const double y = 0.125 + 0.25 * (i / 10);
    ping.soundings.push_back({{x, y, 20.05}, 2 * i, 0.2f});
    ping.soundings.push_back({{x, y, 20.20}, 2 * i + 1, 0.1f});
  }
  SubmapBuilder builder({}, {}, Loses(0.1, 0.1, Deg2Rad(0.2)), NothingLearned);
  builder.Add(ping);
  const auto submap = builder.Finish();
  ASSERT_TRUE(submap);
  ASSERT_EQ(submap->cloud.size(), 100u);
  for (const Eigen::Vector3f& p : submap->cloud.points) EXPECT_NEAR(p.z(), 10.17f, 1e-5f);
  EXPECT_EQ(submap->soundings_used, 200u);
}

TEST(SubmapBuilder, BoundsASubmapOfAVehicleThatHovers) {
  SubmapParams params;
  params.max_soundings = 20'000;
  Drive drive(params);
  for (int i = 0; i < 400; ++i) {
    drive.time += FromSeconds(0.1);
    if (auto s = drive.builder.Add(drive.swath.At(drive.time, 0.0, 0.0, 0.0)))
      drive.closed.push_back(*s);
  }
  ASSERT_EQ(drive.closed.size(), 2u);
  EXPECT_EQ(drive.closed[0].trigger, SubmapTrigger::kLength);
  EXPECT_LT(drive.closed[0].soundings_read, 20'200u);
}

TEST(SubmapBuilder, TakesPingsOfTwoHeadsAtOneTime) {
  Drive drive;
  drive.Straight(5.0);
  GeoreferencedPing other = drive.swath.At(drive.time, drive.x, drive.y, 0.0);
  other.head = 1;
  const std::optional<Submap> one_head = SubmapBuilder(drive.builder).Finish();
  drive.builder.Add(other);
  EXPECT_EQ(drive.builder.counters().count("pings_out_of_order"), 0U);
  drive.builder.Add(other);
  EXPECT_EQ(drive.builder.counters().at("pings_out_of_order"), 1);
  // Also not after a ping that came late.
  drive.builder.Add(drive.swath.At(drive.time - FromSeconds(1.0), drive.x, drive.y, 0.0));
  drive.builder.Add(other);
  EXPECT_EQ(drive.builder.counters().at("pings_out_of_order"), 3);
  const std::optional<Submap> both = drive.builder.Finish();
  ASSERT_TRUE(one_head && both);
  EXPECT_EQ(both->soundings_read, one_head->soundings_read + other.beams_read);
}

// KMALL gives the two swaths of a dual swath the time of their first pulse.
TEST(SubmapBuilder, TakesSwathsOfOneHeadAtOneTime) {
  Drive drive;
  drive.Straight(5.0);
  const std::optional<Submap> one = SubmapBuilder(drive.builder).Finish();
  const GeoreferencedPing fore = drive.swath.At(drive.time, drive.x + 0.4, drive.y, 0.0);
  drive.builder.Add(fore);
  EXPECT_EQ(drive.builder.counters().count("pings_out_of_order"), 0U);
  drive.builder.Add(fore);
  EXPECT_EQ(drive.builder.counters().at("pings_out_of_order"), 1);
  const std::optional<Submap> both = drive.builder.Finish();
  ASSERT_TRUE(one && both);
  EXPECT_EQ(both->soundings_read, one->soundings_read + fore.beams_read);
}

TEST(SubmapBuilder, RefusesPingsOfAClockThatStandsStill) {
  Drive drive;
  drive.Straight(5.0);
  for (int i = 1; i <= 100; ++i)
    drive.builder.Add(drive.swath.At(drive.time, drive.x + 0.1 * i, drive.y, 0.0));
  EXPECT_GE(drive.builder.counters().at("pings_out_of_order"), 97);
}

TEST(SubmapBuilder, RefusesPingsThatCannotBe) {
  Drive drive;
  drive.Straight(5.0);
  drive.time += FromSeconds(0.05);
  const GeoreferencedPing again = drive.swath.At(drive.time, drive.x, drive.y, 0.0);
  EXPECT_FALSE(drive.builder.Add(again));
  EXPECT_FALSE(drive.builder.Add(again));
  GeoreferencedPing bad = drive.swath.At(drive.time + FromSeconds(0.1), 0.0, 0.0, 0.0);
  bad.T_map_vehicle.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(drive.builder.Add(bad));
  GeoreferencedPing wild = drive.swath.At(drive.time + FromSeconds(0.2), drive.x, drive.y, 0.0);
  for (Sounding& s : wild.soundings) s.p_map.y() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(drive.builder.Add(wild));
  EXPECT_EQ(drive.builder.counters().at("pings_out_of_order"), 1);
  EXPECT_EQ(drive.builder.counters().at("pings_not_finite"), 1);
  EXPECT_EQ(drive.builder.counters().at("soundings_not_finite"), 128);
}

// Runs nothing before it has to.
struct LateJobs : JobQueue {
  void Add(std::function<void()> job) override { waiting.push_back(std::move(job)); }
  void Finish() override {
    for (const auto& job : std::exchange(waiting, {})) job();
  }
  std::vector<std::function<void()>> waiting;
};

// A line with bumps, a turn, a gap, and two swaths of each ping on the way back, of which one is
// repeated.
std::vector<GeoreferencedPing> PingsOfALineAndBack() {
  SwathMaker swath;
  swath.seabed = BumpySeabed;
  swath.outlier_part = 0.01;
  std::vector<GeoreferencedPing> pings;
  Time time = FromUtime(1'700'000'000'000'000);
  for (int i = 0; i < 600; ++i) {
    time += FromSeconds(i == 450 ? 20.0 : kStepM / kSpeedMps);
    const double out = kStepM * std::min(i, 300), back = kStepM * std::max(0, i - 300);
    pings.push_back(swath.At(time, out - back, i < 300 ? 0.0 : 25.0, i < 300 ? 0.0 : kPi));
    if (i < 300) continue;
    pings.push_back(swath.At(time, out - back - 0.4, 25.0, kPi));
    pings.push_back(pings.back());
  }
  return pings;
}

TEST(SubmapBuilder, MakesTheSameSubmapsWhereSoundingsComeLate) {
  SubmapParams params;
  params.max_soundings = 70'000;
  const auto build = [&](JobQueue* jobs) {
    SubmapBuilder builder(params, {}, Loses(0.1, 0.1, Deg2Rad(0.2)), NothingLearned);
    builder.KeepSoundings();
    builder.UseThreads(ForEachInTurn, jobs);
    std::vector<Submap> closed;
    std::vector<SubmapSoundings> soundings;
    for (const GeoreferencedPing& ping : PingsOfALineAndBack()) {
      const auto placed = std::make_shared<GeoreferencedPing>(ping);
      placed->soundings.clear();
      jobs->Add([placed, ping] { placed->soundings = ping.soundings; });
      if (auto submap = builder.Add(std::shared_ptr<const GeoreferencedPing>(placed))) {
        closed.push_back(*std::move(submap));
        soundings.push_back(builder.TakeSoundings());
      }
    }
    closed.push_back(builder.Finish().value());
    soundings.push_back(builder.TakeSoundings());
    return std::tuple(std::move(closed), std::move(soundings), builder.counters());
  };
  LateJobs late_jobs;
  const auto [at_once, soundings_at_once, counters_at_once] = build(JobsInTurn());
  const auto [late, soundings_late, counters_late] = build(&late_jobs);
  EXPECT_EQ(counters_late, counters_at_once);
  EXPECT_EQ(counters_late.at("pings_out_of_order"), 300);
  ASSERT_GE(at_once.size(), 4u);
  ASSERT_EQ(late.size(), at_once.size());
  for (std::size_t i = 0; i < late.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(late[i].trigger, at_once[i].trigger);
    EXPECT_EQ(late[i].start, at_once[i].start);
    EXPECT_EQ(late[i].end, at_once[i].end);
    EXPECT_EQ(late[i].cloud.points, at_once[i].cloud.points);
    EXPECT_EQ(late[i].cloud.soundings, at_once[i].cloud.soundings);
    EXPECT_EQ(late[i].predicted_information, at_once[i].predicted_information);
    ASSERT_EQ(soundings_late[i].soundings.size(), soundings_at_once[i].soundings.size());
    for (std::size_t k = 0; k < soundings_late[i].soundings.size(); ++k) {
      const auto& a = soundings_late[i].soundings[k];
      const auto& b = soundings_at_once[i].soundings[k];
      ASSERT_TRUE(a.p_submap_m == b.p_submap_m && a.ping == b.ping && a.used == b.used) << k;
    }
  }
}

TEST(SubmapBuilder, MakesNoSubmapOfNearlyNothing) {
  Drive drive;
  drive.swath.beams = 4;
  drive.Straight(0.5);
  drive.Finish();
  EXPECT_TRUE(drive.closed.empty());
  EXPECT_EQ(drive.builder.counters().at("submaps_too_small"), 1);
}

TEST(SubmapBuilder, GivesTheSameBytesTwice) {
  Drive a;
  Drive b;
  for (Drive* drive : {&a, &b}) {
    drive->swath.seabed = BumpySeabed;
    drive->Straight(40.0);
    drive->Finish();
  }
  ASSERT_EQ(a.closed.size(), b.closed.size());
  for (std::size_t i = 0; i < a.closed.size(); ++i) {
    EXPECT_EQ(a.closed[i].cloud.points, b.closed[i].cloud.points);
    EXPECT_EQ(a.closed[i].footprint, b.closed[i].footprint);
    EXPECT_EQ(a.closed[i].predicted_information, b.closed[i].predicted_information);
  }
}

TEST(SubmapBuilder, KeepsEverySoundingWhereItIsAskedTo) {
  Drive drive;
  drive.builder.KeepSoundings();
  std::vector<SubmapSoundings> kept;
  for (int i = 0; i < 2; ++i) {
    while (drive.closed.size() == kept.size()) drive.Step(0.0);
    kept.push_back(drive.builder.TakeSoundings());
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Submap& submap = drive.closed[i];
    const std::vector<SubmapSoundings::Sounding>& soundings = kept[i].soundings;
    EXPECT_EQ(soundings.size(), submap.soundings_read);
    EXPECT_EQ(static_cast<std::uint64_t>(std::count_if(
                  soundings.begin(), soundings.end(), [](const auto& s) { return s.used; })),
              submap.soundings_used);
    EXPECT_EQ(kept[i].pings.front().time, submap.start);
    EXPECT_EQ(kept[i].pings.back().time, submap.end);
    // In the submap's own frame: near the middle of its cloud.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), of_cloud = Eigen::Vector3d::Zero();
    for (const auto& s : soundings)
      if (s.used) mean += s.p_submap_m.cast<double>() / static_cast<double>(submap.soundings_used);
    for (std::size_t k = 0; k < submap.cloud.size(); ++k)
      of_cloud += submap.cloud.points[k].cast<double>() *
                  (double{submap.cloud.soundings[k]} / static_cast<double>(submap.soundings_used));
    EXPECT_LT((mean - of_cloud).norm(), 1e-3);
  }
  EXPECT_TRUE(drive.builder.TakeSoundings().soundings.empty());
}

}  // namespace
}  // namespace seastitch
