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
  table
      ->Add(
          "water_level",
          &c->water_level_file,
          "CSV of UTC and metres, of a tide gauge or predicted: how far the water line lies above "
          "the map's zero of depth, positive up. Empty: depths count from the water line.")
      .DataSheet();
  DeclareDive(&c->dive, table);
  table->Add("map_resume_within_s",
             &c->map_resume_within_s,
             Unit::kSecond,
             Range::AtLeast(0.0),
             "After a restart the mapper continues the dive's map if the first sample of the "
             "inertial unit (or INS) is at most this long after the last checkpoint, by the "
             "samples' own time. Else it begins another map beside it.");
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
            "Uncertainty of the sonar's position in vehicle.yaml, 1 sigma: 0.3 before a patch "
            "test, 0.1 after one, 0 for exact. The pose graph estimates the error where "
            "swaths overlap, together with that of a latency (times speed) and a pitch angle "
            "(times altitude).")
      .DataSheet()
      .WasCalled("sonar_mounting_m");
  table
      ->Add("sonar_mounting_sigma_deg",
            &c->sonar_mounting_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::AtLeast(0.0).Below(180.0),
            "Uncertainty of the sonar's angle about the vertical, 1 sigma. It adds to that of "
            "the Doppler log's angle.")
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
             "Submaps kept in memory while the disk cannot be written. Beyond this the oldest "
             "are lost.");
  table
      ->Add("sonar_time_offset_s",
            &c->sonar_time_offset_s,
            Unit::kSecond,
            Range::Within(-1.0, 1.0),
            "Added to the stamp of every ping. The report of a replay estimates the value.")
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
             "Pings that may wait for navigation, 28 kB each at most: 600 are 10 s of the "
             "fastest sonar. Beyond this the oldest are dropped and counted.");
  table->Add("max_waiting_submaps",
             &c->max_waiting_submaps,
             Unit::kNone,
             Range::Within(1, 1000),
             "Submaps that may wait for registration. Beyond this a submap joins the graph "
             "unregistered, and its pairs are registered later. Beyond four times as many its "
             "points are not stored.");
}

void DeclareProfile(MapperConfig* c, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "sound_velocity_profile",
      "Sound-speed profile used until one arrives on SVP, from the sonar or a CTD; from "
      "then on the nearest in time is used. Without any, rays are straight, at the "
      "sound speed that the sonar measures, and HEALTH reports it.");
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
              "Shortest submap along the track. Shorter ones overlap too little for a sure "
              "closure.");
  const Parameter& max_length =
      section.Add("max_length_m",
                  &p->max_length_m,
                  Unit::kMetre,
                  Range::Above(0.0),
                  "Longest submap along the track. Dead reckoning bends longer ones.");
  section.AddRule(
      max_length, "above min_length_m", [p] { return p->max_length_m > p->min_length_m; });
  section.Add("max_duration_s",
              &p->max_duration_s,
              Unit::kSecond,
              Range::Above(0.0),
              "Longest submap in time, for a vehicle that hovers.");
  section.Add("max_drift_m",
              &p->max_drift_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Largest drift of dead reckoning inside a submap, 1 sigma, beyond min_length_m. "
              "It is reached where the Doppler log has no bottom lock.");
  section.Add("max_soundings",
              &p->max_soundings,
              Unit::kNone,
              Range::AtLeast(1000),
              "Most soundings of a submap. Bounds memory.");
  section.Add("min_points",
              &p->min_points,
              Unit::kNone,
              Range::AtLeast(3),
              "Fewest points of a submap after the filter. With fewer it is dropped.");
  section.Add("expected_overlap",
              &p->expected_overlap,
              Unit::kNone,
              Range::Above(0.0).AtMost(1.0),
              "Fraction of a submap that another may overlap. A submap closes after "
              "min_length_m as soon as the predicted registration of this fraction would locate "
              "it better than dead reckoning does, seen from the nearest submap of an earlier "
              "line.");
  section.Add("sounding_sigma_m",
              &p->sounding_sigma_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Noise of a sounding, 1 sigma, where the sonar states none or a smaller one.");
  section.Add("turn_deg",
              &p->turn_rad,
              Unit::kDegreeFromRadian,
              Range::Above(0.0).Below(180.0),
              "Turn that ends a line: the heading against that of the submap's first ping.");
  section.Add("turn_sustain_m",
              &p->turn_sustain_m,
              Unit::kMetre,
              Range::AtLeast(0.0),
              "Track length for which the heading must differ by that. Yawing is shorter.");
  section.Add("turn_settle_m",
              &p->turn_settle_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Track length with a steady heading after which the next line begins.");
  section.Add("keep_turns",
              &p->keep_turns,
              "True: turns are mapped too. False: soundings in turns are left out.");
  section.Add("max_gap_s",
              &p->max_gap_s,
              Unit::kSecond,
              Range::Above(0.0),
              "Longest pause between two pings of one submap.");
  section.Add("max_gap_m",
              &p->max_gap_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Longest way between two pings of one submap.");
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
                                           Range::Above(0.0).AtMost(10'000.0),
                                           "Farther soundings are dropped.");
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
              "A sounding nearer than this to the local seabed is no outlier.");
  section.Add("spike_sigmas",
              &p->spike_sigmas,
              Unit::kNone,
              Range::Above(0.0),
              "A sounding farther from the local seabed than this many sigma of the local "
              "scatter is a spike.");
  section.Add("min_support",
              &p->min_support,
              Unit::kNone,
              Range::AtLeast(1),
              "A spike is kept as a feature if at least this many other soundings are at its "
              "height ...");
  section
      .Add("min_support_fraction",
           &p->min_support_fraction,
           Unit::kNone,
           Range::AtLeast(0.0).Below(1.0),
           "... and if these are at least this fraction of all soundings around it, from "
           "more than one ping.")
      .WasCalled("min_support_part");
  section.Add("min_neighbours",
              &p->min_neighbours,
              Unit::kNone,
              Range::AtLeast(0),
              "Fewest soundings around a point. With fewer it is isolated, and dropped.");
  section.Add("soundings_per_column",
              &p->soundings_per_column,
              Unit::kNone,
              Range::AtLeast(1.0),
              "Mean number of soundings of a column of the grid from which the local seabed is "
              "estimated.");
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
           "The same as a fraction of the smaller footprint. Neighbours on a line touch "
           "without a common sounding.")
      .WasCalled("min_overlap_part");
  // 200 edges fit into one graph update, one of them dead reckoning's.
  section.Add("max_pairs",
              &p->max_pairs,
              Unit::kNone,
              Range::Within(0, 199),
              "Registrations of a submap at most, pairs with the highest predicted information "
              "first. Unused budget is spent on retries of pairs that a later solution brought "
              "nearer or made more certain.");
}

void DeclareSearch(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_cell_m",
               &p->min_cell_m,
               Unit::kMetre,
               Range::Above(0.0),
               "Smallest cell. The footprint of a sounding is about 0.02 x its range.");
  section->Add("cell_per_spacing",
               &p->cell_per_spacing,
               Unit::kNone,
               Range::Above(0.0),
               "Edge of the finest cell over the mean spacing of points.");
  section->Add("num_levels",
               &p->num_levels,
               Unit::kNone,
               Range::Within(2, 10),
               "Levels of the grid, with cells of 1, 2, 4, 8 x the finest.");
  section->Add("max_cells",
               &p->max_cells,
               Unit::kNone,
               Range::Within(1000, 100'000'000),
               "Most cells of a grid. Bounds memory: larger clouds are cropped to where most "
               "points are.");
  section->Add("window_sigma",
               &p->window_sigma,
               Unit::kNone,
               Range::Above(0.0),
               "Half-width of the search window in sigma of the prior. 3 contains the truth in "
               "99 % of cases.");
  section->Add("max_modes",
               &p->max_modes,
               Unit::kNone,
               Range::Within(2, 100),
               "Modes (best local maxima of the search) that are refined.");
  section->Add("max_search_cells",
               &p->max_search_cells,
               Unit::kNone,
               Range::AtLeast(1),
               "Most cells x yaw hypotheses of one search. A larger window is searched on "
               "coarser cells.");
}

void DeclareErrorModel(RegistrationParams* p, bool* learn_noise, ParameterTable* section) {
  section->Add("min_sounding_sigma_m",
               &p->min_sounding_sigma_m,
               Unit::kMetre,
               Range::Above(0.0),
               "Lower bound of the noise of a sounding, which is estimated from the data.");
  section->Add("learn_noise",
               learn_noise,
               "True: the noise of the survey is estimated from its own overlaps "
               "(docs/noise-from-overlaps.md). False: it stays as configured here.");
  section
      ->Add("correlated_error_ratio",
            &p->noise.correlated_error_ratio,
            Unit::kNone,
            Range::AtLeast(0.0),
            "Height error that neighbouring soundings share (roll, sound speed), 1 sigma, "
            "over the altitude.")
      .WasCalled("shared_error_ratio");
  for (const char* key : {"error_correlation_length_m", "shared_error_length_m"})
    section->AddIgnored(key, "overlaps show no more of that length than that it is long");
  section->Add("min_position_sigma_m",
               &p->min_position_sigma_m,
               Unit::kMetre,
               Range::AtLeast(0.0),
               "Position error added to every loop closure, 1 sigma: gridding, latency, lever "
               "arms.");
}

void DeclareGates(RegistrationParams* p, ParameterTable* section) {
  section->Add("min_overlap_m2",
               &p->min_overlap_m2,
               Unit::kSquareMetre,
               Range::Above(0.0),
               "Smallest overlap at the registered pose.");
  section->Add("min_patches",
               &p->min_patches,
               Unit::kNone,
               Range::Above(0.0),
               "Fewest independent patches in the overlap. Statistics need some.");
  section
      ->Add("min_evidence_nats",
            &p->min_evidence_nats,
            Unit::kNat,
            Range::Above(0.0),
            "Smallest log-likelihood ratio of the best placement against chance. A second "
            "placement makes the result ambiguous if its ratio comes this near ...")
      .WasCalled("ambiguity_floor");
  section
      ->Add("ambiguity_margin_nats_per_patch",
            &p->ambiguity_margin_nats_per_patch,
            Unit::kNatPerPatch,
            Range::AtLeast(0.0),
            "... or this near times the number of independent patches.")
      .WasCalled("ambiguity_per_patch");
  section
      ->Add("max_residual_ratio",
            &p->max_residual_ratio,
            Unit::kNone,
            Range::Above(0.0),
            "Largest residual sigma over the noise of soundings. Above it the fit is poor.")
      .WasCalled("max_misfit");
  section->Add("min_slope_significance",
               &p->min_slope_significance,
               Unit::kNone,
               Range::Above(0.0),
               "A direction counts as known where the slopes of both submaps agree by this many "
               "sigma.");
  section->Add("max_prior_chi2",
               &p->max_prior_chi2,
               Unit::kNone,
               Range::Above(0.0),
               "Largest chi-square of the result against the prior, 3 degrees of freedom. One "
               "true result in a thousand exceeds 16.3.");
}

void DeclareRegistration(LoopCloserParams* p, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "registration", "Where one submap lies on another. The values hold for any seabed.");
  section.AddChoice<RegistrationMethod>(
      "method",
      &p->method,
      {{"grid", RegistrationMethod::kGrid}, {"gicp", RegistrationMethod::kGicp}},
      "grid: search and alignment of height grids. gicp: the paper's own method in x, "
      "y, yaw, a baseline; it does not search and accepts every seabed.");
  section.Add("gicp_voxel_m",
              &p->gicp.voxel_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Edge of the voxels that thin gicp's points.");
  section.Add("z_sigma_m",
              &p->z_sigma_m,
              Unit::kMetre,
              Range::Above(0.0),
              "Height difference of two passes over the same seabed, 1 sigma: tide, draft, "
              "sound speed.");
  DeclareSearch(&p->registration, &section);
  DeclareErrorModel(&p->registration, &p->learn_noise, &section);
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
