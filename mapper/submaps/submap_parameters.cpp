// The sections `submap`, `filter` and `overlap` of config/mapper.yaml.

#include "mapper/submaps/cloud_filter.hpp"
#include "mapper/submaps/overlap.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {

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
  section.Add(
      "min_support_fraction",
      &p->min_support_fraction,
      Unit::kNone,
      Range::AtLeast(0.0).Below(1.0),
      "Smallest fraction of all soundings around a spike that must lie at its height, from two "
      "pings at least, to keep it.");
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
  section.Add("min_overlap_fraction",
              &p->min_overlap_fraction,
              Unit::kNone,
              Range::AtLeast(0.0).Below(1.0),
              "Smallest expected overlap as a fraction of the smaller footprint. Above 0, since "
              "successive submaps of a line touch without a common sounding.");
  // A graph update has room for 200 edges, and one of them is the dead-reckoning edge.
  section.Add("max_pairs",
              &p->max_pairs,
              Unit::kNone,
              Range::Within(0, 199),
              "Maximum number of registrations per submap; pairs with the highest predicted "
              "information come first. Unused budget is spent on retries of pairs that a later "
              "solution moved or made more certain.");
}

}  // namespace seastitch
