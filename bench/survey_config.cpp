// Parameter table of config/bench/*.yaml. Longer than other files because every key has its unit,
// range and sentence here, once, and little else is in it.

#include "bench/survey_config.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <stdexcept>

#include "common/core/sensors.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch::bench {
namespace {

using enum Unit;

constexpr char kErrors[] = "errors";

void DeclareTerrain(SurveyConfig* config, ParameterTable* root) {
  ProceduralParams* p = &config->terrain;
  ParameterTable& table = root->AddSection("terrain", "The seabed.");
  table.Add(
      "depth_m", &p->depth_m, kMetre, Range::Within(0.0, 11'000.0), "Depth at the map's origin.");
  table.Add("slope_north",
            &p->slope_north,
            kNone,
            Range::Within(-1.0, 1.0),
            "Slope of the seabed: deeper by this much a metre.");
  table.Add("slope_east",
            &p->slope_east,
            kNone,
            Range::Within(-1.0, 1.0),
            "Slope of the seabed: deeper by this much a metre.");

  ParameterTable& raster = table.AddSection("raster", "A surveyed seabed.");
  raster.Add("file",
             &config->raster.file,
             "File that GDAL reads, relative to this one. Empty: the seabed is procedural.");
  raster.Add("overlay",
             &config->raster.overlay,
             "True: the procedural relief, waves and pipeline are added to it.");
  raster.Add("positive_down",
             &config->raster.positive_down,
             "True: values are depths. False: elevations, negative below the datum.");
  raster.Add("depth_offset_m",
             &config->raster.depth_offset_m,
             kMetre,
             Range::Within(-11'000.0, 11'000.0),
             "Added to every depth, for tide or for water to dive in.");
  raster.Add("fill_m",
             &config->raster.fill_m,
             kMetre,
             Range::Within(0.0, 1000.0),
             "Largest distance from known cells up to which holes are filled.");

  ParameterTable& relief = table.AddSection("relief", "Self-similar relief.");
  relief.Add("rms_m",
             &p->relief.rms_m,
             kMetre,
             Range::Within(0.0, 1000.0),
             "Height of the relief, RMS; 0: no relief.");
  const Parameter& longest = relief.Add("longest_m",
                                        &p->relief.longest_m,
                                        kMetre,
                                        Range::Above(0.0).AtMost(1e5),
                                        "Longest wavelength of the relief.");
  relief.Add("shortest_m",
             &p->relief.shortest_m,
             kMetre,
             Range::AtLeast(0.1),
             "Shortest wavelength of the relief.");
  relief.Add("hurst",
             &p->relief.hurst,
             kNone,
             Range::Above(0.0).AtMost(2.0),
             "Exponent of the amplitude over the wavelength; natural seabeds have 0.7 to 1.");
  relief.AddRule(
      longest, "at least shortest_m", [p] { return p->relief.longest_m >= p->relief.shortest_m; });

  ParameterTable& waves = table.AddSection("sand_waves", "Crests that bend and swell.");
  waves.Add("height_m",
            &p->sand_waves.height_m,
            kMetre,
            Range::Within(0.0, 50.0),
            "Height from trough to crest; 0: no waves.");
  waves.Add("length_m",
            &p->sand_waves.length_m,
            kMetre,
            Range::AtLeast(0.5),
            "Length from crest to crest.");
  waves.Add("heading_deg",
            &p->sand_waves.heading_deg,
            kDegree,
            Range::Any(),
            "Direction in which the waves follow each other, clockwise from north.");

  ParameterTable& pipe = table.AddSection("pipeline", "A pipe that follows the seabed.");
  pipe.Add("diameter_m",
           &p->pipeline.diameter_m,
           kMetre,
           Range::Within(0.0, 5.0),
           "Diameter of the pipe; 0: no pipe.");
  pipe.Add("north_m",
           &p->pipeline.north_m,
           kMetre,
           Range::Any(),
           "North coordinate of a point of the pipe.");
  pipe.Add("east_m",
           &p->pipeline.east_m,
           kMetre,
           Range::Any(),
           "East coordinate of a point of the pipe.");
  pipe.Add(
      "heading_deg", &p->pipeline.heading_deg, kDegree, Range::Any(), "Direction of the pipe.");

  ParameterTable& flat = table.AddSection("flat_strip", "A strip without relief and waves.");
  flat.Add("from_north_m", &p->flat_strip.from_north_m, kMetre, Range::Any(), "South end.");
  flat.Add("to_north_m",
           &p->flat_strip.to_north_m,
           kMetre,
           Range::Any(),
           "North end of the strip. Not above the south end: no strip.");
}

void DeclarePlan(PlanParams* p, ParameterTable* root) {
  ParameterTable& table = root->AddSection("plan", "A lawn-mower survey from the map's origin.");
  table.Add("lines", &p->lines, kNone, Range::Within(1, 1000), "Number of survey lines.");
  table.Add("line_length_m",
            &p->line_length_m,
            kMetre,
            Range::Within(1.0, 100000.0),
            "Length of each line.");
  table.Add("spacing_m",
            &p->spacing_m,
            kMetre,
            Range::Within(0.0, 10000.0),
            "Distance between two lines.");
  table.Add("heading_deg", &p->heading_deg, kDegree, Range::Any(), "Heading of the first line.");
  table.Add("turn_radius_m",
            &p->turn_radius_m,
            kMetre,
            Range::Within(1.0, 1000.0),
            "Radius of turns. Lines closer than 2.6 radii are joined by loops.");
  table.Add("crosslines",
            &p->crosslines,
            kNone,
            Range::Within(0, 100),
            "Crosslines, at right angles, evenly spaced along the lines.");
  table.Add("lead_in_m",
            &p->lead_in_m,
            kMetre,
            Range::Within(0.0, 1000.0),
            "Straight way before and after every line.");
  table.Add(
      "speed_mps", &p->speed_mps, kMetrePerSecond, Range::Within(0.1, 10.0), "Speed over ground.");
  table.Add("altitude_m",
            &p->altitude_m,
            kMetre,
            Range::Within(0.0, 1000.0),
            "Altitude above the smoothed seabed; 0: the vehicle keeps depth_m.");
  table.Add("depth_m",
            &p->depth_m,
            kMetre,
            Range::Within(0.0, 11'000.0),
            "Depth of the vehicle if altitude_m is 0.");
  table.Add("min_depth_m",
            &p->min_depth_m,
            kMetre,
            Range::AtLeast(0.0),
            "Smallest depth of the vehicle during the survey.");
  table.Add("surface_s",
            &p->surface_s,
            kSecond,
            Range::AtLeast(0.0),
            "Time at the surface before and after the survey, with the sonar off; 0: none.");
  table.Add("dive_s",
            &p->dive_s,
            kSecond,
            Range::Above(0.0),
            "Duration of the descent, and of the ascent, with the sonar off; used if surface_s is "
            "above 0.");
}

void DeclareMotion(MotionParams* p, ParameterTable* root) {
  ParameterTable& table =
      root->AddSection("motion", "Motion of the vehicle about its course, RMS.");
  table.Add("roll_rms_deg", &p->roll_rms_deg, kDegree, Range::Within(0.0, 15.0), "Roll, RMS.");
  table.Add("pitch_rms_deg", &p->pitch_rms_deg, kDegree, Range::Within(0.0, 15.0), "Pitch, RMS.");
  table.Add("heading_rms_deg",
            &p->heading_rms_deg,
            kDegree,
            Range::Within(0.0, 15.0),
            "Heading off the course (crab), RMS.");
  table.Add("heave_rms_m", &p->heave_rms_m, kMetre, Range::Within(0.0, 5.0), "Heave, RMS.");
  table.Add("period_s",
            &p->period_s,
            kSecond,
            Range::Within(1.0, 60.0),
            "Middle period of the motion; periods are half to twice it.");
}

void DeclareWater(SurveyConfig* config, ParameterTable* root) {
  WaterParams* p = &config->water;
  ParameterTable& table = root->AddSection("water", "Speed of sound, linear between the depths.");
  const Parameter& depth = table.Add(
      "depth_m", &p->depth_m, kMetre, Range::Any(), "Depths of the profile, at least one, rising.");
  const Parameter& speed = table.Add("speed_mps",
                                     &p->speed_mps,
                                     kMetrePerSecond,
                                     Range::Within(kMinSoundSpeedMps, kMaxSoundSpeedMps),
                                     "Sound speed at each depth.");
  table.AddRule(depth, "of 1 to 2000 rising depths", [p] {
    return !p->depth_m.empty() && p->depth_m.size() <= 2000 &&
           std::is_sorted(p->depth_m.begin(), p->depth_m.end(), std::less_equal<>());
  });
  table.AddRule(
      speed, "as long as depth_m", [p] { return p->depth_m.size() == p->speed_mps.size(); });
  table.Add("profile_speed_error_mps",
            &config->profile_speed_error_mps,
            kMetrePerSecond,
            Range::Within(-50.0, 50.0),
            "Error of the sonar's own profile, the same at every depth.");
}

void DeclareClass(SurveyConfig* config, ParameterTable* table) {
  table->AddChoice("class",
                   &config->error_class,
                   SensorErrors::Classes(),
                   "Class of sensors: sets the defaults of all keys below.");
}

void DeclareErrors(SurveyConfig* config, ParameterTable* root) {
  SensorErrors* p = &config->errors;
  ParameterTable& table = root->AddSection(kErrors, "Errors of the navigation sensors, 1 sigma.");
  DeclareClass(config, &table);
  table.Add("gyro_noise_radps_rthz",
            &p->gyro_noise_radps_rthz,
            kRadianPerSecondRootHertz,
            Range::Within(0.0, 100.0),
            "White noise of a gyro as a density.");
  table.Add("gyro_bias_radps",
            &p->gyro_bias_radps,
            kRadianPerSecond,
            Range::Within(0.0, 100.0),
            "Constant bias, each axis.");
  table.Add("accel_noise_mps2_rthz",
            &p->accel_noise_mps2_rthz,
            kMetrePerSecond2RootHertz,
            Range::Within(0.0, 100.0),
            "White noise of an accelerometer as a density.");
  table.Add("accel_bias_mps2",
            &p->accel_bias_mps2,
            kMetrePerSecond2,
            Range::Within(0.0, 100.0),
            "Constant bias, each axis.");
  table.Add("roll_pitch_wander_deg",
            &p->roll_pitch_wander_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Gauss-Markov error of roll and of pitch.");
  table.Add("roll_pitch_wander_tau_s",
            &p->roll_pitch_wander_tau_s,
            kSecond,
            Range::Above(0.0),
            "Correlation time of roll_pitch_wander_deg.");
  table.Add("heading_bias_deg",
            &p->heading_bias_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Constant error of the heading.");
  table.Add("heading_deviation_deg",
            &p->heading_deviation_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Heading error with the sine and cosine of the heading: the rest of hard iron.");
  table.Add("heading_wander_deg",
            &p->heading_wander_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Gauss-Markov error of heading.");
  table.Add("heading_wander_tau_s",
            &p->heading_wander_tau_s,
            kSecond,
            Range::Above(0.0),
            "Correlation time of heading_wander_deg.");
  table.Add("attitude_white_deg",
            &p->attitude_white_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Noise of each sample, each axis.");
  table.Add("dvl_noise_mps",
            &p->dvl_noise_mps,
            kMetrePerSecond,
            Range::Within(0.0, 100.0),
            "Noise of each ensemble, x and y.");
  table.Add("dvl_scale",
            &p->dvl_scale,
            kNone,
            Range::Within(0.0, 100.0),
            "Constant scale error of the velocity.");
  table.Add("dvl_misalignment_deg",
            &p->dvl_misalignment_deg,
            kDegree,
            Range::Within(0.0, 100.0),
            "Constant mounting error about each axis.");
  table.Add("dvl_range_noise_m",
            &p->dvl_range_noise_m,
            kMetre,
            Range::Within(0.0, 100.0),
            "Noise of the range of each beam.");
  table.Add("depth_noise_m",
            &p->depth_noise_m,
            kMetre,
            Range::Within(0.0, 100.0),
            "Noise of each sample.");
  table.Add("depth_bias_m",
            &p->depth_bias_m,
            kMetre,
            Range::Within(0.0, 100.0),
            "Constant error of the depth.");
}

void DeclareImu(ImuParams* p, ParameterTable* root) {
  ParameterTable& table = root->AddSection("imu", "Inertial unit.");
  table.Add("rate_hz", &p->rate_hz, kHertz, Range::Within(1.0, 1000.0), "Rate of the samples.");
  table.Add("latency_s",
            &p->latency_s,
            kSecond,
            Range::Within(0.0, 1.0),
            "Delay from the sample to its last frame.");
}

void DeclareDvl(DvlParams* p, ParameterTable* root) {
  ParameterTable& table = root->AddSection("dvl", "Doppler log.");
  table.Add("rate_hz", &p->rate_hz, kHertz, Range::Within(0.1, 30.0), "Rate of the ensembles.");
  table.Add("beam_angle_deg",
            &p->beam_angle_deg,
            kDegree,
            Range::Within(5.0, 60.0),
            "Angle of the beams from the z axis of the log.");
  table.Add("min_range_m",
            &p->min_range_m,
            kMetre,
            Range::AtLeast(0.0),
            "Smallest altitude with bottom lock.");
  const Parameter& max_range = table.Add("max_range_m",
                                         &p->max_range_m,
                                         kMetre,
                                         Range::Above(0.0).AtMost(1000.0),
                                         "Largest altitude with bottom lock.");
  table.Add("beam_loss_rate",
            &p->beam_loss_rate,
            kNone,
            Range::Within(0.0, 1.0),
            "Probability that a beam has no detection, for each beam of each ensemble.");
  table.Add("latency_s",
            &p->latency_s,
            kSecond,
            Range::Within(0.0, 1.0),
            "Delay from the ping to the last frame.");
  table.AddRule(max_range, "above min_range_m", [p] { return p->max_range_m > p->min_range_m; });
}

void DeclareMbesErrors(MbesErrors* p, ParameterTable* parent) {
  ParameterTable& table = parent->AddSection(
      "errors", "Errors that the sonar's software and vehicle.yaml do not know.");
  table.Add("mounting_roll_deg",
            &p->roll_deg,
            kDegree,
            Range::Within(-10.0, 10.0),
            "Mounting beyond vehicle.yaml, starboard down.");
  table.Add("steering_mps",
            &p->steering_mps,
            kMetrePerSecond,
            Range::Within(-50.0, 50.0),
            "Sound speed at the transducer less that with which angles are computed.");
  table.Add(
      "stamp_s", &p->stamp_s, kSecond, Range::Within(-1.0, 1.0), "Stamps are so much too early.");
  table.Add("roll_percent",
            &p->roll_percent,
            kNone,
            Range::Within(-50.0, 50.0),
            "The sonar rolls so much more than the vehicle.");
  table.Add("heave_percent",
            &p->heave_percent,
            kNone,
            Range::Within(-50.0, 50.0),
            "The sonar heaves so much more than the vehicle.");
  table.Add("beam_bias_percent",
            &p->beam_bias_percent,
            kNone,
            Range::Within(0.0, 10.0),
            "Bias of the range, constant for each beam, 1 sigma over the beams.");
}

void DeclareMbes(MbesParams* p, ParameterTable* root) {
  ParameterTable& table = root->AddSection("mbes", "Sonar.");
  table.Add("beams", &p->beams, kNone, Range::Within(2, 1024), "Beams across the swath.");
  table.Add("swath_deg",
            &p->swath_deg,
            kDegree,
            Range::Within(1.0, 160.0),
            "Full opening angle of the swath.");
  table.Add("equidistant",
            &p->equidistant,
            "True: beams are spaced evenly across the seabed. False: evenly in angle.");
  table.Add("ping_rate_hz",
            &p->ping_rate_hz,
            kHertz,
            Range::Within(0.0, 100.0),
            "Ping rate; 0: as fast as the range allows, up to max_ping_rate_hz.");
  table.Add("max_ping_rate_hz",
            &p->max_ping_rate_hz,
            kHertz,
            Range::Within(0.1, 100.0),
            "Highest ping rate.");
  table.Add("max_range_m",
            &p->max_range_m,
            kMetre,
            Range::Within(1.0, 1000.0),
            "Longest range with an echo.");
  table.Add("roll_stabilised", &p->roll_stabilised, "True: the swath is stabilised against roll.");
  const Parameter& tilt = table.Add("sector_tilt_deg",
                                    &p->sector_tilt_deg,
                                    kDegree,
                                    Range::Within(-30.0, 30.0),
                                    "Tilt of each transmit sector, from port to starboard.");
  const Parameter& delay = table.Add("sector_delay_s",
                                     &p->sector_delay_s,
                                     kSecond,
                                     Range::Within(0.0, 0.1),
                                     "Delay of each transmit sector after the first pulse.");
  table.Add("range_noise_m",
            &p->range_noise_m,
            kMetre,
            Range::Within(0.0, 10.0),
            "Noise of the range of a detection.");
  table.Add("range_noise_ratio",
            &p->range_noise_ratio,
            kNone,
            Range::Within(0.0, 0.1),
            "Noise of the range of a detection, over the range.");
  table.Add("angle_noise_deg",
            &p->angle_noise_deg,
            kDegree,
            Range::Within(0.0, 10.0),
            "Noise of the angle of a detection at nadir; it grows with 1 / cos.");
  table.Add("outlier_rate",
            &p->outlier_rate,
            kNone,
            Range::Within(0.0, 1.0),
            "Fraction of lone beams at a wrong range.");
  table.Add("drop_rate",
            &p->drop_rate,
            kNone,
            Range::Within(0.0, 1.0),
            "Fraction of beams without a detection.");
  table.Add("misdetection_rate",
            &p->misdetection_rate,
            kNone,
            Range::Within(0.0, 1.0),
            "Fraction of pings with a run of beams at the nearest range (side lobes).");
  table.Add(
      "latency_s", &p->latency_s, kSecond, Range::Within(0.0, 1.0), "Delay after the last echo.");
  DeclareMbesErrors(&p->errors, &table);
  table.AddRule(tilt, "1 to 9 sectors", [p] {
    return !p->sector_tilt_deg.empty() && p->sector_tilt_deg.size() <= 9;
  });
  table.AddRule(delay, "as long as sector_tilt_deg", [p] {
    return p->sector_delay_s.size() == p->sector_tilt_deg.size();
  });
}

void DeclareFixes(FixParams* p, ParameterTable* root) {
  ParameterTable& table = root->AddSection("position_fixes", "GPS or USBL.");
  table.Add("interval_s",
            &p->interval_s,
            kSecond,
            Range::AtLeast(0.1).OrZero(),
            "Time between two fixes; 0: no fixes.");
  table.Add("gps",
            &p->gps,
            "True: GPS, only while the vehicle is at the surface. False: USBL, all the time.");
  table.Add(
      "sigma_m", &p->sigma_m, kMetre, Range::Above(0.0), "Noise of north and east of each fix.");
  table.Add(
      "wander_m",
      &p->wander_m,
      kMetre,
      Range::AtLeast(0.0),
      "Error of north and east that wanders (Gauss-Markov). A fix states sigma_m and wander_m "
      "together.");
  table.Add("wander_s", &p->wander_s, kSecond, Range::AtLeast(1.0), "Its correlation time.");
  table.Add("wrong_rate",
            &p->wrong_rate,
            kNone,
            Range::Within(0.0, 1.0),
            "Fraction of fixes that are off and do not state it.");
  table.Add("wrong_m", &p->wrong_m, kMetre, Range::Any(), "Error of these fixes.");
}

void DeclareFault(Fault* p, ParameterTable* table) {
  table
      ->AddChoice<FaultKind>(
          "kind",
          &p->kind,
          {{"dvl_dropout", FaultKind::kDvlDropout}, {"packet_loss", FaultKind::kPacketLoss}},
          "No bottom lock, or packets lost between device and driver.")
      .Required();
  table->AddChoice<Device>("device",
                           &p->device,
                           {{"imu", Device::kImu}, {"dvl", Device::kDvl}, {"mbes", Device::kMbes}},
                           "Device whose packets are lost, for packet_loss.");
  table->Add("from_s",
             &p->from_s,
             kSecond,
             Range::AtLeast(0.0),
             "Start of the fault since the start of the survey.");
  const Parameter& to = table->Add("to_s",
                                   &p->to_s,
                                   kSecond,
                                   Range::Above(0.0),
                                   "End of the fault; left out: the end of the survey.");
  table->AddRule(to, "above from_s", [p] { return p->to_s > p->from_s; });
  table->Add("rate",
             &p->rate,
             kNone,
             Range::Within(0.0, 1.0),
             "Fraction of packets lost, for packet_loss.");
}

// The class of errors that a file names; it sets the defaults of the single errors.
std::string ClassIn(const std::string& path) {
  SurveyConfig config;
  ParameterTable table;
  DeclareClass(&config, &table.AddSection(kErrors, ""));
  PeekParameters(path, table);
  return config.error_class;
}

SurveyConfig DefaultsOf(const std::string& error_class) {
  SurveyConfig config;
  config.error_class = error_class;
  config.errors = SensorErrors::OfClass(error_class);
  return config;
}

}  // namespace

ParameterTable TableOf(SurveyConfig* config) {
  ParameterTable table;
  table.Add("seed", &config->seed, kNone, Range::AtLeast(0.0), "Seed of everything random.");
  DeclareTerrain(config, &table);
  DeclarePlan(&config->plan, &table);
  DeclareMotion(&config->motion, &table);
  DeclareWater(config, &table);
  DeclareErrors(config, &table);
  DeclareImu(&config->imu, &table);
  DeclareDvl(&config->dvl, &table);
  DeclareMbes(&config->mbes, &table);
  DeclareFixes(&config->fixes, &table);
  table.AddList<Fault>(
      "faults", &config->faults, DeclareFault, "Faults during a part of the survey.");
  return table;
}

SurveyConfig LoadSurvey(const std::string& path) {
  SurveyConfig config = DefaultsOf(ClassIn(path));
  LoadParameters(path, TableOf(&config));
  std::string& file = config.raster.file;
  if (!file.empty() && std::filesystem::path(file).is_relative())
    file = (std::filesystem::path(path).parent_path() / file).string();
  return config;
}

std::string PrintConfig(const SurveyConfig& config) {
  return PrintWithDefaults(config, DefaultsOf(config.error_class));
}

Fault ParseFault(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string yaml = "{kind: " + text.substr(0, colon);
  if (colon != std::string::npos)
    for (const char c : "," + text.substr(colon + 1)) yaml += c == '=' ? ": " : std::string(1, c);
  Fault fault;
  ParameterTable table;
  DeclareFault(&fault, &table);
  try {
    ParseParameters(yaml + "}", "fault '" + text + "'", table);
  } catch (const ConfigError& e) {
    throw std::invalid_argument(e.what());
  }
  return fault;
}

}  // namespace seastitch::bench
