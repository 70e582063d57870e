// Parameter table of config/mapper.yaml, except its section on navigation. Longer than other files
// because every key has its unit, range and sentence here, once, and nothing else is in it.

#include "common/core/pose.hpp"
#include "common/core/sound_speed.hpp"
#include "mapper/geometry/sound_ray.hpp"
#include "mapper/mapper_config.hpp"

namespace seastitch {
namespace {

void DeclareFiles(MapperConfig* c, ParameterTable* table) {
  table
      ->Add("vehicle",
            &c->vehicle_file,
            "File with the vehicle's lever arms, mounting angles and datum.")
      .DataSheet()
      .Required();
  table
      ->Add("water_level",
            &c->water_level_file,
            "Water-level file: CSV of UTC and height of the water line above the map's zero of "
            "depth in metres, positive up, from a tide gauge or a prediction; linear between "
            "entries (docs/survey-files.md). Empty: depths count from the water line.")
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
      .DataSheet()
      .WasCalled("sonar_mounting_m");
  table
      ->Add("sonar_mounting_sigma_deg",
            &c->sonar_mounting_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::AtLeast(0.0).Below(180.0),
            "Uncertainty of the sonar's mounting angle about the vertical, 1 sigma. The pose graph "
            "estimates the angle between sonar and Doppler log; its prior is the root sum of "
            "squares of this and navigation.dvl_mounting_deg.")
      .DataSheet()
      .WasCalled("sonar_mounting_deg");
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
      ->Add("sonar_time_offset_s",
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

void DeclareSubmap(SubmapParams* p, ParameterTable* table) {
  ParameterTable& section =
      table->AddSection("submap", "Where one submap ends and the next begins.");
  section.Add("min_length_m",
              &p->min_length_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "Shortest submap along the track. Shorter ones overlap too little for a reliable "
              "loop closure.");
  const Parameter& max_length = section.Add(
      "max_length_m",
      &p->max_length_m,
      Unit::kMetre,
      Range::Above(0.0),
      "Longest submap along the track. Longer ones are distorted by the drift of dead reckoning.");
  section.AddRule(
      max_length, "above min_length_m", [p] { return p->max_length_m > p->min_length_m; });
  section.Add("max_duration_s",
              &p->max_duration_s,
              Unit::kSecond,
              Range::Above(0.0),
              "Longest submap in time, for a vehicle that hovers. navigation.history_s is at least "
              "twice this.");
  section.Add("max_drift_m",
              &p->max_drift_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Drift of dead reckoning inside a submap that closes it, 1 sigma in the worst "
              "horizontal direction, checked beyond min_length_m. Usually reached only while the "
              "Doppler log has no bottom lock.");
  section.Add("max_soundings",
              &p->max_soundings,
              Unit::kNone,
              Range::AtLeast(1000),
              "Maximum number of soundings of a submap, a bound on memory.");
  section.Add("min_points",
              &p->min_points,
              Unit::kNone,
              Range::AtLeast(3),
              "Smallest number of points of a submap after the filter. One with fewer is dropped.");
  section.Add("expected_overlap",
              &p->expected_overlap,
              Unit::kNone,
              Range::Above(0.0).AtMost(1.0),
              "Fraction of a submap's area that a later registration is assumed to use. A submap "
              "closes after min_length_m as soon as the predicted registration of this fraction "
              "would locate it better than dead reckoning does, with respect to the nearest submap "
              "of an earlier line. A smaller fraction makes longer submaps.");
  section.Add("sounding_sigma_m",
              &p->sounding_sigma_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Lower bound of a sounding's noise, 1 sigma: used where the sonar states none or a "
              "smaller one.");
  section.Add("turn_deg",
              &p->turn_rad,
              Unit::kDegreeFromRadian,
              Range::Above(0.0).Below(180.0),
              "Change of heading since the submap's first ping that ends a line, if it lasts for "
              "turn_sustain_m.");
  section.Add("turn_sustain_m",
              &p->turn_sustain_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "Track length for which the heading must differ by turn_deg before the line ends: "
              "longer than one swing of a vehicle that yaws on a straight line.");
  section.Add("turn_settle_m",
              &p->turn_settle_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Track length with a steady heading, within half of turn_deg, after which a turn is "
              "over and the next line begins.");
  section.Add("keep_turns",
              &p->keep_turns,
              "True: turns are mapped too; they tie lines together, but heading errors distort "
              "them more. False: soundings in turns are left out.");
  section.Add("max_gap_s",
              &p->max_gap_s,
              Unit::kSecond,
              Range::Above(0.0),
              "Longest time between two pings of one submap. A longer one closes the submap.");
  section.Add("max_gap_m",
              &p->max_gap_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Longest distance between two pings of one submap. A longer one closes the submap.");
}

void DeclareFilter(CloudFilterParams* p, ParameterTable* table) {
  ParameterTable& section = table->AddSection("filter", "Which soundings are seabed.");
  section.Add("min_range_m",
              &p->min_range_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "Nearer soundings are dropped: ringing of the sonar.");
  const Parameter& max_range = section.Add("max_range_m",
                                           &p->max_range_m,
                                           Unit::kMetre,
                                           Range::Above(0.0).AtMost(kLargestRangeM),
                                           "Farther soundings are dropped.");
  section.AddRule(max_range, "above min_range_m", [p] { return p->max_range_m > p->min_range_m; });
  section.Add("voxel_m",
              &p->voxel_m,
              Unit::kMetre,
              Range::Within(0.01, 10.0),
              "Edge of a voxel: about the footprint of a beam at survey altitude.");
  section.Add(
      "min_spike_m",
      &p->min_spike_m,
      Unit::kMetre,
      Range::Above(0.0),
      "Smallest spike. A sounding nearer to the local seabed than this is never an outlier.");
  section.Add("spike_sigmas",
              &p->spike_sigmas,
              Unit::kNone,
              Range::Above(0.0),
              "A sounding is a spike where it is farther from the local seabed than this many "
              "sigma of the local scatter, and farther than min_spike_m.");
  section.Add("min_support",
              &p->min_support,
              Unit::kNone,
              Range::AtLeast(1),
              "Smallest number of other soundings at a spike's height for which the spike is kept "
              "as a feature, together with min_support_fraction.");
  section
      .Add(
          "min_support_fraction",
          &p->min_support_fraction,
          Unit::kNone,
          Range::AtLeast(0.0).Below(1.0),
          "Smallest fraction of all soundings around a spike that must lie at its height, from two "
          "pings at least, to keep it.")
      .WasCalled("min_support_part");
  section.Add(
      "min_neighbours",
      &p->min_neighbours,
      Unit::kNone,
      Range::AtLeast(0),
      "Smallest number of soundings around a point. A point with fewer is isolated, and dropped.");
  section.Add("soundings_per_column",
              &p->soundings_per_column,
              Unit::kNone,
              Range::AtLeast(1.0),
              "Mean number of soundings per column of the grid from which the filter estimates the "
              "local seabed. It sets the width of the columns.");
}

void DeclareOverlap(OverlapParams* p, ParameterTable* table) {
  ParameterTable& section =
      table->AddSection("overlap", "Which pairs of submaps are worth a registration.");
  section.Add("min_overlap_m2",
              &p->min_overlap_m2,
              Unit::kSquareMetre,
              Range::Above(0.0),
              "Smallest expected overlap of a pair, averaged over the uncertainty of their "
              "relative pose.");
  section
      .Add("min_overlap_fraction",
           &p->min_overlap_fraction,
           Unit::kNone,
           Range::AtLeast(0.0).Below(1.0),
           "Smallest expected overlap as a fraction of the smaller footprint. Above 0, since "
           "successive submaps of a line touch without a common sounding.")
      .WasCalled("min_overlap_part");
  // A graph update has room for 200 edges, and one of them is the dead-reckoning edge.
  section.Add("max_pairs",
              &p->max_pairs,
              Unit::kNone,
              Range::Within(0, 199),
              "Maximum number of registrations per submap; pairs with the highest predicted "
              "information come first. Unused budget is spent on retries of pairs that a later "
              "solution moved or made more certain.");
}

void DeclareSearch(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_cell_m",
               &p->min_cell_m,
               Unit::kMetre,
               Range::Above(0.0),
               "Lower bound of the finest cell. A beam's footprint is about 0.02 times its range, "
               "0.12 m at 6 m: lower it only for a vehicle that flies lower.");
  section->Add("cell_per_spacing",
               &p->cell_per_spacing,
               Unit::kNone,
               Range::Above(0.0),
               "Edge of the finest cell divided by the mean spacing of points, before it is "
               "rounded up to a power of two metres.");
  section->Add("num_levels",
               &p->num_levels,
               Unit::kNone,
               Range::Within(2, 10),
               "Number of grid levels, with cells of 1, 2, 4, 8, ... times the finest.");
  section->Add("max_cells",
               &p->max_cells,
               Unit::kNone,
               Range::Within(1000, 100'000'000),
               "Maximum number of cells of a grid, a bound on memory: larger clouds are cropped to "
               "where most points are.");
  section->Add("window_sigma",
               &p->window_sigma,
               Unit::kNone,
               Range::Above(0.0),
               "Half-width of the search window in sigma of the prior, along each axis. 3 contains "
               "the true pose in 99 % of cases.");
  section->Add(
      "max_modes",
      &p->max_modes,
      Unit::kNone,
      Range::Within(2, 100),
      "Maximum number of modes (local maxima of the search, those of highest prominence) that are "
      "refined.");
  section->Add("max_search_cells",
               &p->max_search_cells,
               Unit::kNone,
               Range::AtLeast(1),
               "Maximum number of cells times yaw hypotheses of one search. A larger window is "
               "searched on coarser cells.");
}

void DeclareErrorModel(RegistrationParams* p, bool* estimate_noise, ParameterTable* section) {
  section->Add("min_sounding_sigma_m",
               &p->min_sounding_sigma_m,
               Unit::kMetre,
               Range::Above(0.0),
               "Lower bound of the sounding noise that is estimated from the data, 1 sigma.");
  section
      ->Add("estimate_noise",
            estimate_noise,
            "True: the noise of the survey is estimated from its own overlaps "
            "(docs/noise-from-overlaps.md). False: it stays as configured here.")
      .WasCalled("learn_noise");
  section
      ->Add("correlated_error_ratio",
            &p->noise.correlated_error_ratio,
            Unit::kNone,
            Range::AtLeast(0.0),
            "Height error that neighbouring soundings share (roll, sound speed), 1 sigma, divided "
            "by the altitude. With estimate_noise it is the prior.")
      .WasCalled("shared_error_ratio");
  for (const char* key : {"error_correlation_length_m", "shared_error_length_m"})
    section->AddIgnored(key, "overlaps show no more of that length than that it is long");
  section->Add("min_position_sigma_m",
               &p->min_position_sigma_m,
               Unit::kMetre,
               Range::AtLeast(0.0),
               "Position error added in quadrature to every loop closure, each axis, 1 sigma: "
               "gridding, lever arms, and 20 ms of latency at 1 m/s.");
}

void DeclareGates(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_overlap_m2",
               &p->min_overlap_m2,
               Unit::kSquareMetre,
               Range::Above(0.0),
               "Smallest overlap at the registered pose. Below it the verdict is little_overlap.");
  section->Add("min_patches",
               &p->min_patches,
               Unit::kNone,
               Range::Above(0.0),
               "Smallest number of patches (independent measurements) in the overlap. A fit has "
               "four parameters, and its statistics need a few more patches.");
  section
      ->Add(
          "min_evidence_nats",
          &p->min_evidence_nats,
          Unit::kNat,
          Range::Above(0.0),
          "Smallest evidence: log-likelihood ratio of the best hypothesis against chance. Below it "
          "the verdict is degenerate. A rival of half as much evidence makes the verdict ambiguous "
          "if evidence (compared per patch) plus log prior comes this near.")
      .WasCalled("ambiguity_floor");
  section
      ->Add(
          "ambiguity_margin_nats_per_patch",
          &p->ambiguity_margin_nats_per_patch,
          Unit::kNatPerPatch,
          Range::AtLeast(0.0),
          "Margin per patch within which a rival makes the verdict ambiguous. Times the number of "
          "patches it applies where it is larger than min_evidence_nats.")
      .WasCalled("ambiguity_per_patch");
  section
      ->Add("max_residual_ratio",
            &p->max_residual_ratio,
            Unit::kNone,
            Range::Above(0.0),
            "Largest ratio of the residual heights' sigma to its expectation from sounding noise "
            "and shared errors. Above it the verdict is poor_fit.")
      .WasCalled("max_misfit");
  section->Add("min_slope_significance",
               &p->min_slope_significance,
               Unit::kNone,
               Range::Above(0.0),
               "Smallest significance of a known direction: its information from the slopes of "
               "both submaps, in standard deviations of what noise alone would make.");
  section->Add("max_prior_chi2",
               &p->max_prior_chi2,
               Unit::kNone,
               Range::Above(0.0),
               "Largest chi-square of the result against the prior, 3 degrees of freedom: one true "
               "result in a thousand exceeds 16.3. Above it the verdict is outside_window.");
}

void DeclareRegistration(LoopCloserParams* p, ParameterTable* table) {
  ParameterTable& section =
      table->AddSection("registration",
                        "Registration of one submap on another. The values suit any seabed: change "
                        "them only where verdicts in the report are often wrong.");
  section.AddChoice<RegistrationMethod>(
      "method",
      &p->method,
      {{"grid", RegistrationMethod::kGrid}, {"gicp", RegistrationMethod::kGicp}},
      "grid: search and alignment of height grids. gicp: generalized ICP in x, y, yaw, the method "
      "of the paper in docs/design.md, a baseline; it does not search, and accepts a seabed "
      "without features too.");
  section.Add("gicp_voxel_m",
              &p->gicp.voxel_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Edge of the voxels that thin the points of gicp.");
  section.Add(
      "z_sigma_m",
      &p->z_sigma_m,
      Unit::kMetre,
      Range::Above(0.0),
      "Height offset between two passes over the same seabed, 1 sigma: tide, draft, sound speed.");
  DeclareSearch(&p->registration, &section);
  DeclareErrorModel(&p->registration, &p->estimate_noise, &section);
  DeclareGates(&p->registration, &section);
}

}  // namespace

ParameterTable TableOf(MapperConfig* c) {
  ParameterTable table;
  DeclareFiles(c, &table);
  DeclareHeights(c, &table);
  DeclareMounting(c, &table);
  DeclareNavigation(&c->navigation, &table);
  DeclareGivenNavigation(c, &table);
  DeclareLimits(c, &table);
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
