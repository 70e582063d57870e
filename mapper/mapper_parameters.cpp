// The table of config/mapper.yaml, but for its section on navigation.

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
            "File of lever arms, mounting angles and datum. Paths are relative to this file.")
      .DataSheet()
      .Required();
  DeclareDive(&c->dive, table);
  table->Add("map_resume_within_s",
             &c->map_resume_within_s,
             Unit::kSecond,
             Range::AtLeast(0.0),
             "A mapper that is started again goes on with the dive's map where the first sample of "
             "the inertial unit (or INS) lies within this time after the last checkpoint, by the "
             "samples' own time; else another begins beside it.");
  table->AddRemoved("survey_dir", "submaps go into a folder of each dive: name dives_dir");
}

void DeclareMounting(MapperConfig* c, ParameterTable* table) {
  table
      ->Add("sonar_mounting_sigma_m",
            &c->mounting.sonar_m,
            Unit::kMetre,
            Range::Within(0.0, 10.0),
            "How well vehicle.yaml knows where the sonar stands, 1 sigma: 0.3 before a patch test, "
            "0.1 after one; 0: exactly. Latency x speed and pitch x altitude act alike. The pose "
            "graph finds these errors where swaths overlap.")
      .DataSheet()
      .WasCalled("sonar_mounting_m");
  table
      ->Add("sonar_mounting_sigma_deg",
            &c->sonar_mounting_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::AtLeast(0.0).Below(180.0),
            "How well it knows the sonar's angle about the vertical, 1 sigma. Counts beside the "
            "Doppler log's.")
      .DataSheet()
      .WasCalled("sonar_mounting_deg");
}

void DeclareLimits(MapperConfig* c, ParameterTable* table) {
  table->Add("max_cached_mb",
             &c->max_cached_mb,
             Unit::kMegabyte,
             Range::Within(0.0, 1e6),
             "Submaps kept in memory for registration: 64 hold about 40 of 100,000 points.");
  table->Add("max_unsaved_mb",
             &c->max_unsaved_mb,
             Unit::kMegabyte,
             Range::Within(0.0, 1e6),
             "Kept in memory while the disk takes nothing; beyond, the oldest are lost.");
  table
      ->Add("sonar_time_offset_s",
            &c->sonar_time_offset_s,
            Unit::kSecond,
            Range::Within(-1.0, 1.0),
            "Added to the stamp of every ping. The report of a replay says what to write here.")
      .DataSheet();
  table->Add("nav_rate_hz",
             &c->nav_rate_hz,
             Unit::kHertz,
             Range::Above(0.0).AtMost(1000.0),
             "Rate of NAV, by the time of the messages.");
  table->Add("max_waiting_pings",
             &c->max_waiting_pings,
             Unit::kNone,
             Range::Within(1, 10'000),
             "Pings that wait for navigation, 28 kB each at most: 600 are 10 s of the fastest "
             "sonar. Beyond, the oldest are dropped and counted.");
  table->Add("max_waiting_submaps",
             &c->max_waiting_submaps,
             Unit::kNone,
             Range::Within(1, 1000),
             "Submaps that wait for registration. Beyond, a submap joins the graph unregistered "
             "(its pairs come later); beyond four times as many, its points are not stored.");
}

void DeclareProfile(MapperConfig* c, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "sound_velocity_profile",
      "Used until a profile comes on SVP (from the sonar or a CTD): the nearest in time is then "
      "taken. Without either, rays are straight, at the speed that the sonar measures, and HEALTH "
      "says so.");
  if (!c->sound_velocity_profile) c->sound_velocity_profile.emplace();
  SoundVelocityProfile* p = &*c->sound_velocity_profile;
  const Parameter& depth = section.Add("depth_m",
                                       &p->depth_m,
                                       Unit::kMetre,
                                       Range::Any(),
                                       "Below the water line, rising, such as [0, 10, 50].");
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
              "Length along the track. Shorter submaps overlap too little for a sure closure.");
  const Parameter& max_length =
      section.Add("max_length_m",
                  &p->max_length_m,
                  Unit::kMetre,
                  Range::Above(0.0),
                  "Length along the track. Dead reckoning bends longer submaps.");
  section.AddRule(
      max_length, "above min_length_m", [p] { return p->max_length_m > p->min_length_m; });
  section.Add("max_duration_s",
              &p->max_duration_s,
              Unit::kSecond,
              Range::Above(0.0),
              "The same for a vehicle that hovers.");
  section.Add("max_drift_m",
              &p->max_drift_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Drift of dead reckoning inside a submap, 1 sigma, beyond min_length_m: reached "
              "where the Doppler log has no bottom lock.");
  section.Add("max_soundings",
              &p->max_soundings,
              Unit::kNone,
              Range::AtLeast(1000),
              "Bounds memory whatever the sonar sends.");
  section.Add("min_points",
              &p->min_points,
              Unit::kNone,
              Range::AtLeast(3),
              "Points after the filter; fewer are no submap.");
  section.Add("expected_overlap",
              &p->expected_overlap,
              Unit::kNone,
              Range::Above(0.0).AtMost(1.0),
              "A submap closes after min_length_m as soon as a registration of this fraction of "
              "it, as predicted from slopes and noise, would place it better than dead reckoning "
              "does, seen from the nearest submap of an earlier line.");
  section.Add("sounding_sigma_m",
              &p->sounding_sigma_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Of a sounding, where the sonar states none or less.");
  section.Add("turn_deg",
              &p->turn_rad,
              Unit::kDegreeFromRadian,
              Range::Above(0.0).Below(180.0),
              "The line ends where the heading leaves that of the submap's first ping by this.");
  section.Add("turn_sustain_m",
              &p->turn_sustain_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "The heading must have left for this length of track: yawing does not last.");
  section.Add("turn_settle_m",
              &p->turn_settle_m,
              Unit::kMetre,
              Range::Above(0.0),
              "The next line begins where the heading has been steady for this length.");
  section.Add("keep_turns", &p->keep_turns, "False: soundings in turns are left out.");
  section.Add("max_gap_s",
              &p->max_gap_s,
              Unit::kSecond,
              Range::Above(0.0),
              "Without pings for longer, what follows is another piece of seabed.");
  section.Add("max_gap_m",
              &p->max_gap_m,
              Unit::kMetre,
              Range::Above(0.0),
              "The same for the way between two pings.");
}

void DeclareFilter(CloudFilterParams* p, ParameterTable* table) {
  ParameterTable& section = table->AddSection("filter", "Which soundings are seabed.");
  section.Add("min_range_m",
              &p->min_range_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "Nearer is the sonar's own ringing.");
  const Parameter& max_range = section.Add("max_range_m",
                                           &p->max_range_m,
                                           Unit::kMetre,
                                           Range::Above(0.0).AtMost(10'000.0),
                                           "No bottom is found beyond.");
  section.AddRule(max_range, "above min_range_m", [p] { return p->max_range_m > p->min_range_m; });
  section.Add("voxel_m",
              &p->voxel_m,
              Unit::kMetre,
              Range::Within(0.01, 10.0),
              "Edge of a voxel: about the footprint of a beam at survey altitude.");
  section.Add("min_spike_m",
              &p->min_spike_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Nearer to the local seabed nothing is an outlier.");
  section.Add("spike_sigmas",
              &p->spike_sigmas,
              Unit::kNone,
              Range::Above(0.0),
              "A spike is further off than this many sigma of the local scatter.");
  section.Add("min_support",
              &p->min_support,
              Unit::kNone,
              Range::AtLeast(1),
              "With this many other soundings at its height a spike is a feature ...");
  section
      .Add("min_support_fraction",
           &p->min_support_fraction,
           Unit::kNone,
           Range::AtLeast(0.0).Below(1.0),
           "... where they are this fraction of all around, and not all of one ping.")
      .WasCalled("min_support_part");
  section.Add("min_neighbours",
              &p->min_neighbours,
              Unit::kNone,
              Range::AtLeast(0),
              "With fewer soundings around it, a point hangs in empty space.");
  section.Add("soundings_per_column",
              &p->soundings_per_column,
              Unit::kNone,
              Range::AtLeast(1.0),
              "Mean soundings of a column that the local seabed is judged by.");
}

void DeclareOverlap(OverlapParams* p, ParameterTable* table) {
  ParameterTable& section =
      table->AddSection("overlap", "Which pairs of submaps are worth a registration.");
  section.Add("min_overlap_m2",
              &p->min_overlap_m2,
              Unit::kSquareMetre,
              Range::Above(0.0),
              "Expected overlap under the uncertainty between the two.");
  section
      .Add("min_overlap_fraction",
           &p->min_overlap_fraction,
           Unit::kNone,
           Range::AtLeast(0.0).Below(1.0),
           "Of the smaller footprint: neighbours touch without a common sounding.")
      .WasCalled("min_overlap_part");
  // 200 edges fit into one graph update, one of them dead reckoning's.
  section.Add("max_pairs",
              &p->max_pairs,
              Unit::kNone,
              Range::Within(0, 199),
              "Registrations a submap, those with the highest predicted information first. What "
              "lines without a neighbour leave is spent on pairs that a later solution brought "
              "nearer or knows better.");
}

void DeclareSearch(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_cell_m",
               &p->min_cell_m,
               Unit::kMetre,
               Range::Above(0.0),
               "Smallest cell: a sounding's footprint is about 0.02 x its range.");
  section->Add("cell_per_spacing",
               &p->cell_per_spacing,
               Unit::kNone,
               Range::Above(0.0),
               "Finest cell over the mean spacing of points.");
  section->Add("num_levels",
               &p->num_levels,
               Unit::kNone,
               Range::Within(2, 10),
               "Levels of the grid, with cells of 1, 2, 4, 8 x the finest.");
  section->Add("max_cells",
               &p->max_cells,
               Unit::kNone,
               Range::Within(1000, 100'000'000),
               "Bounds memory: larger clouds are cropped to where their points are.");
  section->Add("window_sigma",
               &p->window_sigma,
               Unit::kNone,
               Range::Above(0.0),
               "Search window in sigma of the prior: 3 holds the truth in 99 % of cases.");
  section->Add("max_modes",
               &p->max_modes,
               Unit::kNone,
               Range::Within(2, 100),
               "Modes of the search that are refined.");
  section->Add("max_search_cells",
               &p->max_search_cells,
               Unit::kNone,
               Range::AtLeast(1),
               "Cells x yaw hypotheses of one search; a larger window is searched coarser.");
}

void DeclareErrorModel(RegistrationParams* p, bool* learn_noise, ParameterTable* section) {
  section->Add("min_sounding_sigma_m",
               &p->min_sounding_sigma_m,
               Unit::kMetre,
               Range::Above(0.0),
               "The noise of soundings is estimated from the data, never below this.");
  section->Add("learn_noise",
               learn_noise,
               "How noisy the survey is, its own overlaps say (docs/noise-from-overlaps.md). "
               "false: it stays as it is told here.");
  section
      ->Add("correlated_error_ratio",
            &p->noise.correlated_error_ratio,
            Unit::kNone,
            Range::AtLeast(0.0),
            "Errors that neighbouring soundings share (roll, sound speed), over the altitude.")
      .WasCalled("shared_error_ratio");
  for (const char* key : {"error_correlation_length_m", "shared_error_length_m"})
    section->AddIgnored(key, "overlaps show no more of that length than that it is long");
  section->Add("min_position_sigma_m",
               &p->min_position_sigma_m,
               Unit::kMetre,
               Range::AtLeast(0.0),
               "Position error that stays whatever the relief: gridding, latency, lever arms.");
}

void DeclareGates(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_overlap_m2",
               &p->min_overlap_m2,
               Unit::kSquareMetre,
               Range::Above(0.0),
               "Overlap found, not expected.");
  section->Add("min_patches",
               &p->min_patches,
               Unit::kNone,
               Range::Above(0.0),
               "Independent patches that must overlap, for statistics to mean anything.");
  section
      ->Add("min_evidence_nats",
            &p->min_evidence_nats,
            Unit::kNat,
            Range::Above(0.0),
            "Log-likelihood ratio of the best place against chance; another place is ambiguous "
            "with it where it comes this near ...")
      .WasCalled("ambiguity_floor");
  section
      ->Add("ambiguity_margin_nats_per_patch",
            &p->ambiguity_margin_nats_per_patch,
            Unit::kNatPerPatch,
            Range::AtLeast(0.0),
            "... or this near for each independent patch.")
      .WasCalled("ambiguity_per_patch");
  section
      ->Add("max_residual_ratio",
            &p->max_residual_ratio,
            Unit::kNone,
            Range::Above(0.0),
            "Residual sigma over the noise of soundings.")
      .WasCalled("max_misfit");
  section->Add("min_slope_significance",
               &p->min_slope_significance,
               Unit::kNone,
               Range::Above(0.0),
               "A direction is known where the slopes of both agree by this many sigma.");
  section->Add("max_prior_chi2",
               &p->max_prior_chi2,
               Unit::kNone,
               Range::Above(0.0),
               "Chi-square of the result against the prior, 3 degrees of freedom: one true result "
               "in a thousand exceeds 16.3.");
}

void DeclareRegistration(LoopCloserParams* p, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "registration", "Where one submap lies on another. Nothing here is tuned to a seabed.");
  section.AddChoice<RegistrationMethod>(
      "method",
      &p->method,
      {{"grid", RegistrationMethod::kGrid}, {"gicp", RegistrationMethod::kGicp}},
      "gicp is the paper's own in x, y, yaw: a baseline without a search, which takes every seabed "
      "for a good one.");
  section.Add("gicp_voxel_m",
              &p->gicp.voxel_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Its points are thinned to one a voxel.");
  section.Add("z_sigma_m",
              &p->z_sigma_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Height between two passes, 1 sigma: tide, draft, sound speed.");
  DeclareSearch(&p->registration, &section);
  DeclareErrorModel(&p->registration, &p->learn_noise, &section);
  DeclareGates(&p->registration, &section);
}

}  // namespace

ParameterTable TableOf(MapperConfig* c) {
  ParameterTable table;
  DeclareFiles(c, &table);
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
