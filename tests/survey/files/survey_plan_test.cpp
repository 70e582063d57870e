// Which sensors, files and installation a replay of survey files uses, and what it does with files
// that it cannot use.
#include "survey/plan/survey_plan.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/file_clocks.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_config.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/message_types.hpp"
#include "survey/read/survey_stream.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/runtime/temporary_dir.hpp"
#include "tests/survey/files/read_all.hpp"
#include "tests/survey/files/small_kmall.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

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
  std::ifstream in(kmall, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
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
      sample.position = GivenPosition{Deg2Rad(57.0), Deg2Rad(5.0)};
      sample.velocity = GivenVelocity{{speed_mps, 0.0, 0.0}};
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

// --- files ---------------------------------------------------------------------------------------

TEST(SurveyInputs, LargeFirstDatagramsDoNotHideThePositions) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0).Ping(0.5);
  for (int i = 0; i < 20; ++i) kmall.Foreign("#MWC", 1'000'000);
  for (int i = 0; i < 3; ++i) kmall.Motion(i).Position(i);
  const SurveyPlan plan = MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(plan.position_source, "#SPO0");
  EXPECT_FALSE(plan.Problem());
}

TEST(SurveyInputs, DayIsThatOfTheFirstPingWhateverTheDayOfTheCast) {
  TemporaryDir dir;
  constexpr double kDayS = 86'400.0;
  const auto survey = [](double from_s, double cast_s) {
    Kmall kmall;
    kmall.Profile(cast_s).Motion(from_s).Position(from_s).Ping(from_s + 0.5);
    return kmall.bytes();
  };
  // Two files of one day with casts of two days, and one of the next day with the first cast.
  const std::vector<DiveInput> dives =
      DivesAmong({dir.Write("a.kmall", survey(0.0, -2 * kDayS)),
                  dir.Write("b.kmall", survey(3600.0, -kDayS)),
                  dir.Write("c.kmall", survey(kDayS, -2 * kDayS))});
  ASSERT_EQ(dives.size(), 2u);
  EXPECT_EQ(dives[0].name, "2026-05-02");
  EXPECT_EQ(dives[0].files.size(), 2u);
  EXPECT_EQ(dives[1].name, "2026-05-03");
}

constexpr char kFnv[] =
    "2026 05 02 12 00 00.5 1777723200.5 5.0 57.0 90.0 2.0 0 0 0 0 5 57 5 57\n"
    "2026 05 02 12 00 04.5 1777723204.5 5.0 57.0 90.0 2.0 0 0 0 0 5 57 5 57\n";

TEST(SurveyInputs, NavigationBesideAFolderIsThatOfTheFolder) {
  TemporaryDir dir;
  fs::create_directories(dir.path() / "DAY");
  dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const fs::path beside = dir.Write("adjusted.fnv", kFnv);
  const std::vector<DiveInput> dives = DivesAmong({dir.path() / "DAY", beside});
  ASSERT_EQ(dives.size(), 1u);
  EXPECT_THAT(dives[0].files, ElementsAre(dir.path() / "DAY" / "a.kmall", beside));
  EXPECT_EQ(MakeSurveyPlan(dives[0].files).position_source, "fnv");
  fs::create_directories(dir.path() / "submaps");
  EXPECT_THAT(
      [&] {
        DivesAmong({dir.path() / "submaps", beside});
      },
      ThrowsMessage<UsageError>(HasSubstr("adjusted.fnv: navigation beside survey files")));
}

TEST(SurveyInputs, AFileGivenTwiceIsRefused) {
  TemporaryDir dir;
  fs::create_directories(dir.path() / "DAY");
  const fs::path line = dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const CommandResult result =
      Replay((dir.path() / "DAY").string() + " " + line.string(), dir.path() / "map");
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_EQ(result.output, "seastitch: replay: " + line.string() + ": given twice\n");
}

TEST(SurveyInputs, PingsOfACopyAreUsedOnce) {
  TemporaryDir dir;
  const std::string bytes = Kmall().Survey().bytes();
  const Played played({dir.Write("a.kmall", bytes), dir.Write("copy.kmall", bytes)});
  EXPECT_EQ(played.samples.at("mbes_ping"), 5);
  EXPECT_EQ(played.Count("survey_pings_repeated"), 5);
}

// Two pings of one time are no copies if their numbers differ.
TEST(SurveyInputs, PingsOfOneTimeAreKept) {
  TemporaryDir dir;
  const std::string bytes = Kmall().Survey().Ping(2.0, 7).Ping(2.0, 8).bytes();
  const Played played({dir.Write("a.kmall", bytes)});
  EXPECT_EQ(played.Count("survey_pings"), 7);
  EXPECT_EQ(played.Count("survey_pings_repeated"), 0);
}

// The two swaths of a dual swath have the time and the number of their ping.
TEST(SurveyInputs, BothSwathsOfAPingAreMapped) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 60; ++i)
    kmall.Motion(i).Position(i).Ping(i + 0.5, 1).Ping(i + 0.5, 1, 0.021f);
  const CommandResult result =
      Replay(dir.Write("a.kmall", kmall.bytes()) + " --soundings xyz", dir.path() / "map");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::ifstream soundings(dir.path() / "map/export/soundings.xyz");
  int lines = 0;
  for (std::string line; std::getline(soundings, line);) lines += line.empty() || line[0] != '#';
  EXPECT_EQ(lines, 2 * 60 * 50);
}

// A profile is used from its place in the file on, whenever it was cast; the first one from the
// start. The clock of a profiler may be hours fast.
TEST(SurveyInputs, AProfileIsUsedFromItsPlaceInTheFile) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(8 * 3600.0, 1500.0);
  for (int i = 0; i < 60; ++i) {
    if (i == 40) kmall.Profile(-1800.0, 1490.0);
    kmall.Motion(i).Position(i).Ping(i + 0.5);
  }
  SurveyFiles survey(PlanSurvey({dir.Write("a.kmall", kmall.bytes())}));
  std::string order;
  int pings = 0;
  ReadAll(
      &survey,
      [&](const SoundVelocityProfile& profile) {
        order += " speed " + std::to_string(static_cast<int>(profile.speed_mps.at(0)));
        if (profile.speed_mps.at(0) == 1490.0) {
          EXPECT_NEAR(ToSeconds(profile.time - Kmall::At(0.0)), 40.0, 1.0);
        }
      },
      [&](const MbesPing&) {
        if (++pings == 1 || pings == 39 || pings == 42) order += " ping " + std::to_string(pings);
      });
  EXPECT_EQ(order, " speed 1500 ping 1 ping 39 speed 1490 ping 42");
}

TEST(SurveyInputs, MoreFilesThanAProcessMayOpen) {
  TemporaryDir dir;
  std::string files;
  for (int i = 0; i < 60; ++i)
    files += " " + dir.Write("l" + std::to_string(i) + ".kmall", Kmall().Survey(6.0 * i).bytes());
  const CommandResult result =
      RunCommand("ulimit -n 40; " + Program("seastitch") + " import --quiet" + files + " --log " +
                 (dir.path() / "a.lcmlog").string());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("pings: 300\n"));
}

TEST(SurveyInputs, NavigationWithoutARecordIsRefused) {
  TemporaryDir dir;
  const std::string kmall = dir.Write("a.kmall", Kmall().Survey().bytes());
  const std::string empty = dir.Write("b.fnv", "## no line of numbers in this file at all\n");
  const CommandResult result = Replay(kmall + " " + empty, dir.path() / "map");
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_EQ(result.output,
            "seastitch: " + empty + ": no line or record of navigation that can be read\n");
}

// Byte 4 of an SBET can be '#'.
TEST(SurveyInputs, AnSbetIsNoKmallWhateverItsBytes) {
  TemporaryDir dir;
  std::string sbet(3 * 136, '\0');
  for (std::size_t i = 0; i < 3; ++i) {
    const double second = 302'400.0 + static_cast<double>(i);
    std::memcpy(sbet.data() + 136 * i, &second, sizeof second);
  }
  sbet[4] = '#';
  EXPECT_NE(dynamic_cast<SbetFileReader*>(ReaderFor(dir.Write("a.sbet", sbet)).get()), nullptr);
  EXPECT_EQ(ReaderFor(dir.Write("a.dat", sbet)), nullptr);
}

TEST(SurveyInputs, AFileWithoutItsBeginningIsRead) {
  TemporaryDir dir;
  const std::string whole = Kmall().Survey().bytes();
  const std::string zeros(512, '\0');
  for (const std::string& bytes : {whole.substr(7), zeros + whole}) {
    const Played played({dir.Write("a.kmall", bytes)});
    EXPECT_EQ(played.Count("survey_pings"), 5);
    EXPECT_GT(played.Count("damaged_bytes"), 0);
  }
  for (const char* const name : {"em710_g.all", "gsf_v3_08.gsf", "r2sonic2026.xtf"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    std::ifstream in(file, std::ios::binary);
    std::string bytes(200'000, '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    EXPECT_NE(ReaderFor(dir.Write(name, bytes.substr(100))), nullptr) << name;
  }
  EXPECT_EQ(ReaderFor(dir.Write("b.kmall", std::string(100'000, 'x'))), nullptr);
}

TEST(SurveyInputs, AnSbetThatEndsWithinARecordIsRead) {
  TemporaryDir dir;
  const std::string sbet(3 * 136 - 50, '\0');
  EXPECT_NE(dynamic_cast<SbetFileReader*>(ReaderFor(dir.Write("a.sbet", sbet)).get()), nullptr);
  EXPECT_EQ(ReaderFor(dir.Write("a.out", sbet)), nullptr);
}

TEST(SurveyInputs, AFileOfAnotherKindIsNamedAndIsNoData) {
  TemporaryDir dir;
  for (const auto& [name, bytes] :
       {std::pair{"empty.all", std::string()}, std::pair{"foreign.all", std::string(500, 'x')}}) {
    const std::string file = dir.Write(name, bytes);
    const CommandResult result = Replay(file, dir.path() / "map");
    EXPECT_EQ(result.exit_code, 65) << result.output;
    EXPECT_EQ(result.output,
              "seastitch: " + file +
                  (bytes.empty() ? ": empty\n"
                                 : ": neither a log nor a survey file of a known "
                                   "format\n"));
  }
  fs::create_directories(dir.path() / "DAY");
  dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const std::string lost = dir.Write("DAY/b.all", "");
  EXPECT_THAT(Replay((dir.path() / "DAY").string(), dir.path() / "map").output,
              HasSubstr("not used: " + lost + ": empty\n"));
}

TEST(SurveyInputs, CandumpLogsAreNotImportedTogetherWithSurveyFilesOfNavigation) {
  const fs::path file = Shared("data/mbes/em710_g.all");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const CommandResult result = RunCommand(Program("seastitch") + " import " + file.string() + " " +
                                          dir.Write("b.candump", "(1.0) can0 123#00\n") +
                                          " --log " + (dir.path() / "l").string());
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_THAT(result.output, HasSubstr("not imported together with candump logs"));
}

TEST(SurveyInputs, AFileWithoutSoundingsSaysWhatItHolds) {
  TemporaryDir dir;
  std::string xtf(1024, '\0');
  xtf[0] = 123;
  const auto packet = [](char type) {
    std::string bytes(256, '\0');
    bytes[0] = '\xCE';
    bytes[1] = '\xFA';
    bytes[2] = type;
    bytes[11] = 1;  // 256 bytes
    return bytes;
  };
  for (int i = 0; i < 9; ++i) xtf += packet(0);
  xtf += packet(1);
  const std::string file = dir.Write("side.xtf", xtf);
  const CommandResult result = Replay(file, dir.path() / "map");
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_EQ(result.output,
            "seastitch: " + file + ": no sounding in it; not read: 9 xtf_sonar, 1 xtf_notes\n");
}

TEST(SurveyInputs, AnotherInstallationIsNamed) {
  TemporaryDir dir;
  const SurveyPlan plan =
      MakeSurveyPlan({dir.Write("a.kmall", Kmall().Survey().bytes()),
                      dir.Write("b.kmall",
                                Kmall()
                                    .Installation()
                                    .Replace("TRAI_TX1:X=0.000000", "TRAI_TX1:X=0.100000")
                                    .Motion(9.0)
                                    .bytes()),
                      dir.Write("c.kmall", Kmall().Survey(20.0).bytes())});
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_EQ(plan.warnings[0].code, WarningCode::kOtherInstallation);
  EXPECT_THAT(plan.warnings[0].text, StartsWith("b.kmall: "));
}

// Soundings of a GSF beside raw pings: counted and named.
TEST(SurveyInputs, PlacedSoundingsBesideRawPingsAreNamed) {
  const fs::path gsf = Shared("data/mbes/gsf_v3_08.gsf");
  SKIP_WITHOUT(gsf);
  TemporaryDir dir;
  const Played played({dir.Write("a.kmall", Kmall().Survey().bytes()), gsf});
  ASSERT_EQ(played.survey.plan().warnings.size(), 1u);
  EXPECT_EQ(played.survey.plan().warnings[0].code, WarningCode::kSoundingsNotUsed);
  EXPECT_EQ(played.Count("survey_pings_not_used"), 8);
}

// --- the vehicle ---------------------------------------------------------------------------------

TEST(SurveyVehicle, WithoutInstallationInTheFilesTheGivenOneIsKept) {
  SurveyPlan plan;
  plan.raw_pings = true;
  plan.position_source = "xtf_position";
  plan.vehicle.datum_latitude_rad = 0.5;
  MapperConfig config;
  config.vehicle.T_vehicle_mbes.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  config.vehicle.T_vehicle_imu.translation() = Eigen::Vector3d(4.0, 5.0, 6.0);
  const MapperConfig given = config;
  UseSurvey(plan, true, &config);
  EXPECT_EQ(config.vehicle.datum_latitude_rad, 0.5);
  EXPECT_TRUE(config.vehicle.T_vehicle_mbes.isApprox(given.vehicle.T_vehicle_mbes));
  EXPECT_TRUE(config.vehicle.T_vehicle_imu.isApprox(given.vehicle.T_vehicle_imu));
  plan.position_source = "sbet";  // of the reference point
  UseSurvey(plan, true, &config);
  EXPECT_TRUE(config.vehicle.T_vehicle_imu.translation().isZero());
  for (const bool has_installation : {true, false}) {
    config = given;
    plan.has_installation = has_installation;
    UseSurvey(plan, has_installation, &config);
    EXPECT_TRUE(config.vehicle.T_vehicle_mbes.translation().isZero());
  }
}

// Outer beams in 8.6 km of water are 17 km long and come back after 23 s.
TEST(SurveyVehicle, SoundingsOfTheDeepestWaterAreKept) {
  SurveyPlan plan;
  plan.max_range_m = 17'000.0;
  MapperConfig config;
  UseSurvey(plan, false, &config);
  EXPECT_EQ(config.filter.max_range_m, 25'500.0);
  plan.max_range_m = 25'000.0;
  UseSurvey(plan, false, &config);
  EXPECT_EQ(config.filter.max_range_m, 30'000.0);
  MbesBeam beam;
  beam.twtt_s = 23.0f;
  EXPECT_TRUE(IsPlausible(beam));
  beam.twtt_s = 41.0f;
  EXPECT_FALSE(IsPlausible(beam));
}

}  // namespace
}  // namespace seastitch
