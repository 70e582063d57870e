// Which sensors, files and installation a replay of survey files uses, and what it does with files
// that it cannot use.

#include "tests/support/files.hpp"
#include "tests/survey/files/plan_fixtures.hpp"

namespace seastitch {
namespace {

// --- depth and geometry of real files ------------------------------------------------------------

// Depth of a point of the vehicle less the depth that the sonar states, for every ping.
std::vector<double> DepthErrorsM(const SurveyPlan& plan, const Eigen::Vector3d& p_vehicle_m) {
  SurveyFiles survey(plan);
  InsNavigation navigation({}, {}, plan.vehicle);
  std::map<Time, double> stated_m;
  survey.OnPlacedPing([&](const PlacedPing& ping) { stated_m[ping.time] = *ping.origin_depth_m; });
  ReadAll(
      &survey,
      [&](const NavigationSample& sample) { navigation.Add(sample); },
      [&](const DepthSample& sample) { navigation.Add(sample); });
  navigation.Finish();
  std::vector<double> errors_m;
  for (const auto& [time, depth_m] : stated_m)
    if (const auto state = navigation.StateAt(time))
      errors_m.push_back((state->T_map_vehicle * p_vehicle_m).z() - depth_m);
  return errors_m;
}

// Heave of `.all` is that of the transmitter, which is 12 m before the reference point of em710_g.
// The stated depth is that of the first part of a transmitter with several. The ship of em710_g
// heaves by about the unit of heave, 1 cm; in the others heave changes steadily.
TEST(SurveyGeometry, TransducerIsAtTheDepthThatTheSonarStates) {
  for (const auto& [name, bound_m] : {std::pair{"em710_g.all", 0.006},
                                      std::pair{"em2040_ac.all", 0.001},
                                      std::pair{"em2040c_ay.all", 0.0005}}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    const SurveyPlan plan = MakeSurveyPlan({file});
    const std::vector<Eigen::Vector3d>& parts_m = plan.vehicle.p_tx_parts_m;
    const Eigen::Vector3d first_m = parts_m.empty() ? Eigen::Vector3d(0, 0, 0) : parts_m.front();
    const std::vector<double> errors_m = DepthErrorsM(plan, plan.vehicle.T_mbes_tx * first_m);
    ASSERT_GT(errors_m.size(), 4u) << name;
    for (const double error_m : errors_m) EXPECT_NEAR(error_m, 0.0, bound_m) << name;
  }
}

// `.kmall` states the depth of the reference point: heave less the water line, whatever roll and
// pitch.
TEST(SurveyGeometry, ReferencePointIsAtTheDepthThatTheSonarStates) {
  for (const char* const name : {"em2040_OS01.kmall", "em2040_eg.kmall"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    const std::vector<double> errors_m =
        DepthErrorsM(MakeSurveyPlan({file}), Eigen::Vector3d::Zero());
    ASSERT_GE(errors_m.size(), 4u) << name;
    for (const double error_m : errors_m) EXPECT_NEAR(error_m, 0.0, 0.0002) << name;
  }
}

void PrintByAngle(const char* title, const SoundingComparison& result) {
  const auto print = [](const char* label, const Eigen::Vector3d& rms) {
    std::printf("%s: %.4f %.4f %.4f\n", label, rms.x(), rms.y(), rms.z());
  };
  std::printf("%s, %d pings, %d beams, RMS in %% of depth\n", title, result.pings, result.beams());
  print("  all", result.RmsPercent());
  for (int from = -75; from < 75; from += 15) {
    const Eigen::Vector3d rms = result.RmsPercent(from, from + 15);
    const std::string label = "  " + std::to_string(from) + " to " + std::to_string(from + 15);
    if (!rms.isZero()) print(label.c_str(), rms);
  }
}

// Raw times and angles through the replay's own navigation and geometry. The software behind `.all`
// leaves out how far the ship moves between sending and receiving; the one behind `.kmall` does
// not. So each agrees with one of the two comparisons, as well as the best independent computation
// from the same files (survey-formats.md, A8): but em2040_ac, whose receivers are tilted by 35
// degrees. A drift of the ship of 0.3 m/s looks there like an error of their roll of 0.02 degrees.
// With R as the inclination of the across axis the map's own geometry, where the ship moves, fits
// best, as in two other files of tilted receivers.
TEST(SurveyGeometry, ReplayedSoundingsAreWhereTheSonarPutsThem) {
  struct Case {
    const char* name;
    int pings, beams;
    Eigen::Vector3d moves_percent, held_percent;  // by PositionInPing
  };
  for (const Case& c : {
           Case{"em710_g.all", 7, 2800, {0.0026, 0.0276, 0.0086}, {0.0019, 0.0031, 0.0033}},
           Case{"em2040_ac.all", 8, 3191, {0.0100, 0.0396, 0.0135}, {0.0041, 0.0430, 0.0395}},
           Case{"em2040c_ay.all", 27, 10461, {0.0023, 0.0110, 0.0028}, {0.0023, 0.0036, 0.0016}},
           Case{"em2040_OS01.kmall", 4, 1919, {0.0022, 0.0127, 0.0037}, {0.0019, 0.0180, 0.0039}},
           Case{"em2040_eg.kmall", 23, 10536, {0.0116, 0.0267, 0.0062}, {0.0117, 0.1069, 0.0245}},
       }) {
    const fs::path file = Shared(std::string("data/mbes/") + c.name);
    SKIP_WITHOUT(file);
    const SurveyPlan plan = PlanSurvey({file});
    for (const auto& [position, percent] : {std::pair{PositionInPing::kMoves, c.moves_percent},
                                            std::pair{PositionInPing::kHeld, c.held_percent}}) {
      const SoundingComparison result = CompareWithMaker(plan, 1000, position);
      const bool held = position == PositionInPing::kHeld;
      PrintByAngle((c.name + std::string(held ? ", position held" : "")).c_str(), result);
      EXPECT_EQ(result.pings, c.pings) << c.name;
      EXPECT_EQ(result.beams(), c.beams) << c.name;
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_LT(result.RmsPercent()(axis), 1.1 * percent(axis)) << c.name << " axis " << axis;
    }
  }
}

// Change of the slope of a flat bed across the track from ping to ping, with the attitude of each
// echo's time, later by the sonar's time_offset_s.
double SlopeChangeRmsDeg(const fs::path& file, double later_s) {
  SurveyFiles survey(PlanSurvey({file}));
  InsNavigation navigation({}, {}, survey.plan().vehicle);
  std::vector<MbesPing> pings;
  ReadAll(
      &survey,
      [&](const NavigationSample& sample) { navigation.Add(sample); },
      [&](const DepthSample& sample) { navigation.Add(sample); },
      [&](const MbesPing& ping) { pings.push_back(ping); });
  navigation.Finish();
  std::vector<double> slopes;
  for (MbesPing& ping : pings) {
    ping.time += FromSeconds(later_s);
    const auto pose_at = [&](Time t) -> std::optional<Eigen::Isometry3d> {
      const auto state = navigation.StateAt(t);
      return state ? std::optional(state->T_map_vehicle) : std::nullopt;
    };
    const auto placed = Georeference(
        ping, pose_at, survey.plan().vehicle, RayTracer::Constant(ping.sound_speed_mps));
    if (!placed) continue;
    const Eigen::Isometry3d T_level_map =
        Eigen::Isometry3d(LevelFromBody(placed->T_map_vehicle)) * placed->T_map_vehicle.inverse();
    double n = 0.0, y = 0.0, z = 0.0, yy = 0.0, yz = 0.0;
    for (const Sounding& sounding : placed->soundings) {
      const Eigen::Vector3d p = T_level_map * sounding.p_map;
      n += 1.0, y += p.y(), z += p.z(), yy += p.y() * p.y(), yz += p.y() * p.z();
    }
    slopes.push_back(std::atan((n * yz - y * z) / (n * yy - y * y)));
  }
  EXPECT_GT(slopes.size(), 900u);
  double sum = 0.0;
  for (std::size_t i = 1; i < slopes.size(); ++i) sum += std::pow(slopes[i] - slopes[i - 1], 2);
  return Rad2Deg(std::sqrt(sum / static_cast<double>(slopes.size() - 1)));
}

// Replay uses the attitude of each echo's time. So the 22 ms by which one attitude per ping has to
// be late, the time of the echoes, are in it already.
TEST(SurveyGeometry, FlatBedKeepsItsSlopeFromPingToPing) {
  const fs::path file = Shared("data/mbes/r2sonic2026.xtf");
  SKIP_WITHOUT(file);
  for (const double later_s : {-0.022, 0.0, 0.022})
    std::printf("later by %.3f s: %.4f deg\n", later_s, SlopeChangeRmsDeg(file, later_s));
  EXPECT_LE(SlopeChangeRmsDeg(file, 0.0), 0.009);
  EXPECT_GT(SlopeChangeRmsDeg(file, 0.022), 0.012);
}

// One real file was traced with the profile alone, the others from the sound speed at the
// transducer.
TEST(SurveyGeometry, SoundSpeedIsTheOneThatTheSonarTracedWith) {
  for (const auto& [name, alone] : {std::pair{"em2040_eg.kmall", true},
                                    std::pair{"em2040_OS01.kmall", false},
                                    std::pair{"em710_g.all", false}}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    const SurveyPlan plan = PlanSurvey({file});
    EXPECT_EQ(plan.profile_alone, alone) << name;
    EXPECT_THAT(plan.Text(),
                HasSubstr(alone ? "sound speed: the profile alone" : "at the transducer"));
  }
}

// --- sensors -------------------------------------------------------------------------------------

TEST(SurveySensors, ActivePositionSystemIsUsedByItsNumber) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey();  // POSI_1 is active; its records have system 0
  for (int i = 0; i < 50; ++i) kmall.Position(0.1 * i, 1);
  EXPECT_EQ(MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())}).position_source, "#SPO0");
}

TEST(SurveySensors, InvalidPositionsAreNotUsed) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 5; ++i) kmall.Motion(i).Position(i, 0, i != 2).Ping(i + 0.5);
  const auto played = Played({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(played.samples.at("ins"), 5 * 20 + 4);
}

TEST(SurveySensors, ActiveMotionSensorIsUsedThoughAnotherIsFaster) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey();  // ATTI_1 is active; its records have system 0
  for (int i = 0; i < 5; ++i) kmall.Motion(i, 1, 100);
  EXPECT_EQ(MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())}).attitude_source, "#SKM0");
}

// Roll and pitch at 20 Hz, and a heading once per second but for a gap of ten.
TEST(SurveySensors, EachHeadOfAnS7kHasItsOwnMounting) {
  TemporaryDir dir;
  std::string bytes;
  for (const std::uint16_t head : {std::uint16_t{0}, std::uint16_t{1}}) {
    SonarInstallation installation;
    installation.time = Kmall::At(0.0);
    const Eigen::Isometry3d mounting =
        MakePose({0.0, 2.0 * head - 1.0, 0.0}, RotationFromRpy(0.6 - 1.2 * head, 0.0, 0.0));
    installation.transmitters.push_back({mounting});
    installation.receivers.push_back({mounting});
    const auto of_head_0 = EncodeS7k7030(installation);
    const auto record = ReadS7kRecord(of_head_0);
    ASSERT_TRUE(record);
    const auto one = EncodeS7kRecord(7030, {7125, head, 0, 0}, installation.time, record->data);
    bytes.append(one.begin(), one.end());
  }
  const SurveyPlan plan = MakeSurveyPlan({dir.Write("a.s7k", bytes)});
  EXPECT_EQ(plan.vehicle.T_mbes_rx.translation().y(), -1.0);
  ASSERT_EQ(plan.vehicle.more_heads.size(), 1u);
  const Eigen::Isometry3d& second = plan.vehicle.more_heads[0].T_mbes_rx;
  EXPECT_EQ(second.translation().y(), 1.0);
  EXPECT_NEAR(RpyFromRotation(second.linear()).x(), -0.6, 1e-6);
  EXPECT_FALSE(plan.files[0].is_installed_otherwise);
}

// A .kmall without the datagrams of these sensors.
std::string Without(const std::set<std::string>& types, const fs::path& kmall) {
  const std::string all = TextOf(kmall);
  std::string left;
  for (std::size_t at = 0; at + 20 <= all.size();) {
    std::uint32_t size = 0;
    std::memcpy(&size, all.data() + at, sizeof size);
    if (!types.contains(all.substr(at + 4, 4))) left += all.substr(at, size);
    at += size;
  }
  return left;
}

// The sonar's own soundings, with position and heading of each ping.
TEST(SurveySensors, AKmallWithoutNavigationIsMappedByWhatItsPingsState) {
  const fs::path file = Shared("data/mbes/em2040_eg.kmall");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const Played whole({file});
  EXPECT_TRUE(whole.survey.plan().raw_pings);
  EXPECT_THAT(whole.survey.plan().position_source, StartsWith("#SPO"));
  const Played without({dir.Write("a.kmall", Without({"#SKM", "#SPO"}, file))});
  const SurveyPlan& plan = without.survey.plan();
  EXPECT_EQ(plan.Problem(), std::nullopt);
  EXPECT_EQ(plan.position_source, "#MRZ");
  EXPECT_EQ(plan.attitude_source, "#MRZ");
  EXPECT_FALSE(plan.raw_pings);
  EXPECT_EQ(plan.depth, SurveyPlan::Depth::kPing);
  EXPECT_EQ(without.Count("survey_pings"), whole.Count("survey_pings"));
  EXPECT_EQ(without.Count("survey_pings_without_position"), 0);
  EXPECT_EQ(without.Count("survey_pings_without_attitude"), 0);
  EXPECT_EQ(without.samples.count("mbes_ping"), 0u);
  // Motion without positions: raw pings at the positions of the pings.
  const Played placed({dir.Write("b.kmall", Without({"#SPO"}, file))});
  EXPECT_EQ(placed.survey.plan().position_source, "#MRZ");
  EXPECT_TRUE(placed.survey.plan().raw_pings);
  EXPECT_EQ(placed.Count("survey_pings_without_position"), 0);
}

TEST(SurveySensors, HeadingIsNotInterpolatedOverAGap) {
  TemporaryDir dir;
  std::string bytes;
  const auto add = [&bytes](const std::vector<std::uint8_t>& d) {
    bytes.append(d.begin(), d.end());
  };
  SonarInstallation installation;
  installation.time = Kmall::At(0.0);
  installation.transmitters.resize(1);
  installation.receivers.resize(1);
  add(EncodeS7k7030(installation));
  const auto record = [](std::uint32_t type, double t_s, const std::vector<float>& values) {
    ByteWriter data;
    for (const float value : values) data.Le(value);
    return EncodeS7kRecord(type, S7kPingId{}, Kmall::At(t_s), data.bytes());
  };
  for (int i = 0; i < 400; ++i) {
    const double t_s = 0.05 * i;
    add(record(1012, t_s, {0.01f, 0.0f, 0.0f}));
    if (i % 20 == 0 && (t_s < 4.5 || t_s > 13.5)) add(record(1013, t_s, {1.0f}));
  }
  const auto played = Played({dir.Write("a.s7k", bytes)});
  EXPECT_GT(played.samples.at("ins"), 180);
  EXPECT_GE(played.Count("survey_attitude_without_heading"), 180);
  EXPECT_LE(played.Count("survey_attitude_without_heading"), 220);
}

// The vehicle turns on the spot; its INS, 5 m ahead of the reference point, moves at 0.5 m/s. The
// positions are of the reference point.
TEST(SurveySensors, VelocityIsThatOfThePointOfThePositions) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Replace("ATTI_1:X=0.000", "ATTI_1:X=5.000");
  for (int i = 0; i < 10; ++i) kmall.Turning(i, 5.0).Position(i + 0.95);
  SurveyFiles survey(PlanSurvey({dir.Write("a.kmall", kmall.bytes())}));
  int velocities = 0;
  ReadAll(&survey, [&](const NavigationSample& sample) {
    if (!sample.position || !sample.velocity) return;
    ++velocities;
    EXPECT_LT(sample.velocity->v_ned_mps.norm(), 0.03);
  });
  EXPECT_EQ(velocities, 9) << "nothing precedes the first position";
}

// Stamps of #SKM and #SPO are uncorrected; the installation states by how much they are late.
TEST(SurveySensors, DelaysOfSensorsAreSubtracted) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey()
      .Replace("D=0.000;U=ACTIVE,ATTI_1", "D=0.500;U=ACTIVE,ATTI_1")
      .Replace("D=0.000;U=ACTIVE", "D=0.025;U=ACTIVE");  // of ATTI_1
  SurveyFiles survey(PlanSurvey({dir.Write("a.kmall", kmall.bytes())}));
  EXPECT_THAT(survey.plan().Text(), HasSubstr("its stamps are late by 0.500 s: corrected"));
  EXPECT_THAT(survey.plan().Text(), HasSubstr("its stamps are late by 0.025 s: corrected"));
  std::optional<Time> attitude, position;
  ReadAll(&survey, [&](const NavigationSample& sample) {
    if (sample.attitude && !attitude) attitude = sample.time;
    if (sample.position && !position) position = sample.time;
  });
  EXPECT_EQ(attitude, Kmall::At(-0.025));
  EXPECT_EQ(position, Kmall::At(-0.5));
}

TEST(SurveySensors, AClockThatIsOffHasTheWayOfTheVehicleAsItsEffect) {
  EXPECT_EQ(EffectOf({.ahead_s = -18.0, .speed_mps = 1.5}), 27.0);
  EXPECT_EQ(EffectOf({.ahead_s = 18.0, .speed_mps = 0.0}), std::nullopt) << "not known";
}

// The sonar's own clock shows the offset of a sensor's: in the time of arrival of positions, and in
// the pings between which an attitude was recorded.
TEST(SurveySensors, AClockOffByWholeSecondsIsMovedOntoTheSonars) {
  struct Case {
    double motion_s;
    int positions_s;
    std::size_t warnings;
    bool as_if_right;
  };
  const auto times = [](const fs::path& file, std::size_t warnings) {
    SurveyFiles survey(PlanSurvey({file}));
    std::size_t of_clocks = 0;
    for (const MapWarning& warning : survey.plan().warnings)
      of_clocks += warning.code == WarningCode::kSensorClock ? 1 : 0;
    EXPECT_EQ(of_clocks, warnings);
    std::vector<Time> all;
    ReadAll(&survey, [&](const NavigationSample& sample) { all.push_back(sample.time); });
    return all;
  };
  TemporaryDir dir;
  const std::vector<Time> right = times(dir.Write("right.kmall", Kmall().Survey().bytes()), 0);
  ASSERT_GT(right.size(), 100U);
  for (const Case& c :
       {Case{18.0, 18, 2, true},
        Case{0.0, 18, 1, true},
        Case{-18.0, -18, 2, true},
        Case{0.0, -1, 1, true},
        Case{0.2, 0, 0, false},     // a latency
        Case{-0.8, 0, 0, false},    // a latency
        Case{1.7, 0, 1, false}}) {  // attitude alone: no whole number of seconds is shown
    const std::string bytes = Kmall().SensorsAhead(c.motion_s, c.positions_s).Survey().bytes();
    const std::vector<Time> all = times(dir.Write("off.kmall", bytes), c.warnings);
    EXPECT_EQ(all == right, c.as_if_right) << c.motion_s << " s, " << c.positions_s << " s";
  }
}

// A clock that sets the sonar's and a sensor's alike shows to the millisecond what pings show of an
// attitude to a second.
TEST(SurveySensors, ASensorSetByAClockThatIsOffIsMovedWithIt) {
  struct Case {
    double motion_s;
    double clock_s;
    std::optional<double> moved_s;
    std::size_t warnings;
  };
  TemporaryDir dir;
  for (const Case& c :
       {Case{18.0, 18.0, 18.0, 1},
        Case{18.0, 0.0, std::nullopt, 1},  // what else the attitude goes by is not known
        Case{0.0, 18.0, std::nullopt, 1},  // no sensor goes by the clock
        Case{0.0, 0.004, std::nullopt, 0},
        Case{18.0, 17.5, std::nullopt, 1}}) {  // no whole number of seconds
    Kmall kmall;
    for (int i = 0; i < 5; ++i) kmall.Clock(i, c.clock_s);
    kmall.SensorsAhead(c.motion_s, 0).Survey();
    const SurveyPlan plan = PlanSurvey({dir.Write("a.kmall", kmall.bytes())});
    SCOPED_TRACE(testing::Message()
                 << "motion " << c.motion_s << " s, clock " << c.clock_s << " s");
    EXPECT_EQ(plan.warnings.size(), c.warnings);
    const auto& moved = plan.files.at(0).params.clock_offsets_s;
    const std::map<std::string, double> expected =
        c.moved_s ? std::map<std::string, double>{{"#SKM0", *c.moved_s}}
                  : std::map<std::string, double>{};
    EXPECT_EQ(moved, expected);
  }
}

TEST(SurveySensors, DelaysOf7030AreNamed) {
  const fs::path file = Shared("vectors/survey/s7k/synthetic.s7k");
  SKIP_WITHOUT(file);
  const std::string text = MakeSurveyPlan({file}).Text();
  EXPECT_THAT(text, HasSubstr("its stamps are late by 0.120 s: not corrected"));
  EXPECT_THAT(text, HasSubstr("its stamps are late by 0.004 s: not corrected"));
}

// 7k Center writes 1003 and 1015 of one INS, once per second. Only 1015 has a velocity.
TEST(SurveySensors, PositionsOf1015AreUsedWithTheirVelocity) {
  TemporaryDir dir;
  for (const double speed_mps : {1.5, 0.0}) {  // 0: not filled in
    std::string bytes;
    for (int i = 0; i < 10; ++i) {
      NavigationRecord sample;
      sample.time = Kmall::At(i);
      sample.position = GeoPosition{Deg2Rad(57.0), Deg2Rad(5.0)};
      sample.velocity = GeoVelocity{{speed_mps, 0.0, 0.0}};
      sample.attitude = Attitude{};
      for (const auto& record :
           {EncodeS7k1003(sample), EncodeS7k1015(sample), EncodeS7k1016({sample})})
        bytes.append(record.begin(), record.end());
    }
    SurveyFiles survey(PlanSurvey({dir.Write("a.s7k", bytes)}));
    int positions = 0, velocities = 0;
    ReadAll(&survey, [&](const NavigationSample& sample) {
      positions += sample.position ? 1 : 0;
      velocities += sample.velocity ? 1 : 0;
    });
    EXPECT_EQ(survey.plan().position_source, speed_mps > 0.0 ? "1015" : "1003");
    EXPECT_EQ(positions, 10);
    EXPECT_EQ(velocities, speed_mps > 0.0 ? 10 : 0);
  }
}

}  // namespace
}  // namespace seastitch
