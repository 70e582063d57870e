// The section `registration` of config/mapper.yaml.

#include "mapper/loops/loop_closer.hpp"

namespace seastitch {
namespace {

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
  section->Add("estimate_noise",
               estimate_noise,
               "True: the noise of the survey is estimated from its own overlaps "
               "(docs/noise-from-overlaps.md). False: it stays as configured here.");
  section->Add(
      "correlated_error_ratio",
      &p->noise.correlated_error_ratio,
      Unit::kNone,
      Range::AtLeast(0.0),
      "Height error that neighbouring soundings share (roll, sound speed), 1 sigma, divided "
      "by the altitude. With estimate_noise it is the prior.");
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
  section->Add(
      "min_evidence_nats",
      &p->min_evidence_nats,
      Unit::kNat,
      Range::Above(0.0),
      "Smallest evidence: log-likelihood ratio of the best hypothesis against chance. Below it "
      "the verdict is degenerate. A rival of half as much evidence makes the verdict ambiguous "
      "if evidence (compared per patch) plus log prior comes this near.");
  section->Add(
      "ambiguity_margin_nats_per_patch",
      &p->ambiguity_margin_nats_per_patch,
      Unit::kNatPerPatch,
      Range::AtLeast(0.0),
      "Margin per patch within which a rival makes the verdict ambiguous. Times the number of "
      "patches it applies where it is larger than min_evidence_nats.");
  section->Add(
      "max_residual_ratio",
      &p->max_residual_ratio,
      Unit::kNone,
      Range::Above(0.0),
      "Largest ratio of the residual heights' sigma to its expectation from sounding noise "
      "and shared errors. Above it the verdict is poor_fit.");
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

}  // namespace

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

}  // namespace seastitch
