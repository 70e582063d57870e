// Parameter table of config/mapper.yaml: its own keys, and the sections that the parts of the
// mapper declare beside their parameters.

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/survey_noise.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "mapper/calibration/calibration_limits.hpp"
#include "mapper/geometry/sound_ray.hpp"
#include "mapper/mapper_config.hpp"

namespace seastitch {
namespace {

void DeclareFiles(MapperConfig* c, ParameterTable* table) {
  DeclareVehicleFile(&c->vehicle_file, table);
  table
      ->Add("water_level",
            &c->water_level_file,
            "Water-level file: CSV of UTC and height of the water line above the map's zero of "
            "depth in metres, positive up, from a tide gauge or a prediction; linear between "
            "entries (docs/survey-files.md). Empty: depths count from the water line.")
      .DataSheet();
  table
      ->Add("vertical_datum",
            &c->vertical_datum_epsg,
            Unit::kNone,
            Range::Within(0.0, 999999.0),
            "EPSG code of the vertical reference system of heights (positive up) whose zero "
            "water_level or ellipsoid_heights state, for the map files. 0: not known.")
      .DataSheet();
  DeclareDive(&c->dive, table);
  table->Add("map_resume_within_s",
             &c->map_resume_within_s,
             Unit::kSecond,
             Range::AtLeast(0.0),
             "Longest pause after which a restarted mapper continues the dive's map: from the last "
             "checkpoint to the first sample of the inertial unit (or INS), by their stamps. After "
             "a longer one it begins a second map beside the first.");
  table->AddRemoved("survey_dir", "submaps go into a folder of each dive: name dives_dir");
}

void DeclareHeights(MapperConfig* c, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "ellipsoid_heights",
      "Heights above the WGS 84 ellipsoid (of the INS, an SBET, a survey file) in place of a water "
      "level: the water line is where depth and height agree, the median of a minute.");
  VerticalReferenceParams* const p = &c->vertical;
  section
      .Add("use",
           &p->by_heights,
           "True: depths count from the zero that the next two keys state, by heights. Until the "
           "first height there is no depth.")
      .DataSheet();
  section
      .Add(
          "separation_m",
          &p->separation_m,
          Unit::kMetre,
          Range::Within(-1000.0, 1000.0),
          "Height of the zero of depth (chart datum, or a geoid) above the ellipsoid, positive up. "
          "0: depths count from the ellipsoid.")
      .DataSheet();
  section
      .Add("separation_grid",
           &c->separation_file,
           "The same by place, in place of separation_m: ESRI ASCII grid in degrees of longitude "
           "and latitude. Empty: none.")
      .DataSheet();
}

void DeclareMounting(MapperConfig* c, ParameterTable* table) {
  table
      ->Add("sonar_mounting_sigma_m",
            &c->mounting.sonar_m,
            Unit::kMetre,
            Range::Within(0.0, 10.0),
            "Uncertainty of the sonar's lever arm in vehicle.yaml, forward and to starboard, 1 "
            "sigma: 0.3 before a patch test, 0.1 after one, 0 for exact. Include what an unknown "
            "latency (times speed) and pitch angle (times altitude) displace: the pose graph "
            "estimates their sum where swaths overlap.")
      .DataSheet();
  table
      ->Add("sonar_mounting_sigma_deg",
            &c->sonar_mounting_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::AtLeast(0.0).Below(180.0),
            "Uncertainty of the sonar's mounting angle about the vertical, 1 sigma. The pose graph "
            "estimates the angle between sonar and Doppler log; its prior is the root sum of "
            "squares of this and navigation.dvl_mounting_deg.")
      .DataSheet();
}

void DeclareLimits(MapperConfig* c, ParameterTable* table) {
  table->Add("max_cached_mb",
             &c->max_cached_mb,
             Unit::kMegabyte,
             Range::Within(0.0, 1e6),
             "Memory for submaps that registration may need again: 64 MB hold about 40 submaps of "
             "100,000 points.");
  table->Add("max_unsaved_mb",
             &c->max_unsaved_mb,
             Unit::kMegabyte,
             Range::Within(0.0, 1e6),
             "Memory for submaps that wait while the disk cannot be written. Beyond this the "
             "oldest are lost.");
  table
      ->Add(SonarTimingEstimate::kKey,
            &c->sonar_time_offset_s,
            Unit::kSecond,
            Range::Within(-1.0, 1.0),
            "Added to the stamp of every ping of MBES_PING: negative where stamps are late. The "
            "report of a replay estimates the value. Not added to MBES_SOUNDINGS: their source has "
            "placed them.")
      .DataSheet();
  table->Add("nav_rate_hz",
             &c->nav_rate_hz,
             Unit::kHertz,
             Range::Above(0.0).AtMost(1000.0),
             "Rate of NAV messages, counted in the samples' own time.");
  table->Add("max_waiting_pings",
             &c->max_waiting_pings,
             Unit::kNone,
             Range::Within(1, 10'000),
             "Maximum number of pings that wait for navigation, 28 kB each at most: 600 are 10 s "
             "of the fastest sonar. Beyond this the oldest are dropped and counted.");
  table->Add("max_waiting_submaps",
             &c->max_waiting_submaps,
             Unit::kNone,
             Range::Within(1, 1000),
             "Maximum number of submaps that wait for registration. Beyond this a submap joins the "
             "graph unregistered, and its pairs are registered later. Beyond four times as many, "
             "the points of a waiting submap are on disk only.");
}

void DeclareCalibration(MapperConfig* c, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "calibration",
      "Corrections of how soundings are placed, as a replay of an earlier survey suggests them "
      "(docs/self-calibration.md). Each is added to what sonar and navigation state.");
  section.Add("by_survey",
              &c->calibrate,
              "True: a replay estimates these values from the overlaps of the survey itself, and "
              "maps again with those that are clear. False: it uses them as they stand.");
  struct Key {
    CalibrationKey key;
    Unit unit;
    const char* meaning;
  };
  const Key keys[] = {
      {CalibrationKey::kRoll,
       Unit::kDegreeFromRadian,
       "Roll of the sonar beyond its mounting in vehicle.yaml: positive is deeper to starboard."},
      {CalibrationKey::kSecondHeadRoll,
       Unit::kDegreeFromRadian,
       "The same for the second head of a sonar with two; roll_deg is then that of the first."},
      {CalibrationKey::kSmile,
       Unit::kMetrePerSecond,
       "Steering error, as an error of the sound speed at the transducer: the sine of a beam's "
       "angle grows by so much of 1500 m/s. The depth at nadir stays."},
      {CalibrationKey::kSmileByWater,
       Unit::kMetrePerSecond,
       "The part of the smile that the water causes, and not the sonar: it stretches the swath "
       "too."},
      {CalibrationKey::kAttitudeLatency,
       Unit::kMillisecond,
       "Attitude is taken so much later than the sounding: positive where its stamps are late."},
      {CalibrationKey::kDepthLatency, Unit::kMillisecond, "The same for the vehicle's depth."},
      {CalibrationKey::kRollScale,
       Unit::kNone,
       "Roll is larger by so many percent than navigation states."},
      {CalibrationKey::kHeaveScale,
       Unit::kNone,
       "Changes of depth that are faster than 20 s are larger by so many percent. With another "
       "value than 0 pings wait 10 s longer: max_waiting_pings has to hold them."},
  };
  for (const auto& [key, unit, meaning] : keys) {
    const CalibrationName& of = kCalibrationNames[static_cast<std::size_t>(key)];
    const double largest = kLargestCalibration[static_cast<std::size_t>(key)];
    section
        .Add(of.name, &(c->calibration.*of.value), unit, Range::Within(-largest, largest), meaning)
        .DataSheet();
  }
}

void DeclareProfile(MapperConfig* c, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "sound_velocity_profile",
      "Sound-speed profile used until the first one arrives on SVP, from the sonar or a CTD; from "
      "then on each ping uses the profile nearest to it in time. Without any profile, rays are "
      "straight, at the sound speed that the sonar measures, and HEALTH reports it.");
  if (!c->sound_velocity_profile) c->sound_velocity_profile.emplace();
  SoundVelocityProfile* p = &*c->sound_velocity_profile;
  const Parameter& depth =
      section.Add("depth_m",
                  &p->depth_m,
                  Unit::kMetre,
                  Range::Any(),
                  "Depths below the water line, increasing, such as [0, 10, 50].");
  const Parameter& speed = section.Add("speed_mps",
                                       &p->speed_mps,
                                       Unit::kMetrePerSecond,
                                       Range::Within(kMinSoundSpeedMps, kMaxSoundSpeedMps),
                                       "Sound speed at each depth, such as [1502, 1498, 1491].");
  section.AddRule(speed, "as many numbers as depth_m", [p] {
    return p->depth_m.size() == p->speed_mps.size();
  });
  section.AddRule(depth, "rising", [p] { return p->depth_m.empty() || RayTracer::Make(*p); });
}

void DeclareSource(MapperParams* params, ParameterTable* table) {
  table
      ->AddChoice<NavigationSource>(
          "navigation_source",
          &params->navigation_source,
          {{"dead_reckoning", NavigationSource::kDeadReckoning},
           {"given", NavigationSource::kGiven}},
          "dead_reckoning: poses are computed here from IMU, DVL and DEPTH. given: poses are taken "
          "from channel INS, computed by an inertial navigation system or read from survey files.")
      .DataSheet();
}

}  // namespace

ParameterTable TableOf(MapperConfig* c) {
  ParameterTable table;
  DeclareFiles(c, &table);
  DeclareHeights(c, &table);
  DeclareMounting(c, &table);
  DeclareNavigation(&c->navigation, &table);
  DeclareSource(c, &table);
  DeclareInsNavigation(&c->given_navigation, &table);
  DeclareLimits(c, &table);
  DeclareCalibration(c, &table);
  DeclareProfile(c, &table);
  DeclareSubmap(&c->submap, &table);
  DeclareFilter(&c->filter, &table);
  DeclareOverlap(&c->loop_closer.overlap, &table);
  DeclareRegistration(&c->loop_closer, &table);
  table.AddRule(table.Find("navigation.history_s"), "at least 2 x submap.max_duration_s", [c] {
    return c->navigation.window_s >= 2.0 * c->submap.max_duration_s;
  });
  return table;
}

}  // namespace seastitch
