#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/for_each.hpp"
#include "common/core/submap.hpp"
#include "common/parameters/parameters.hpp"
#include "mapper/submaps/voxel_grid.hpp"

// Outlier rejection of soundings, in two steps: a gate on the range of each sounding from the
// vehicle, and a filter on the finished, voxelled submap.
namespace seastitch {

// Upper limit of max_range_m: that of kMaxTravelTime_s.
constexpr double kLargestRangeM = 30'000.0;

struct CloudFilterParams {
  // Range from the vehicle's reference point. Below the minimum is ringing of the sonar; beyond the
  // maximum no supported sonar finds the bottom.
  double min_range_m = 0.5;
  double max_range_m = 300.0;  // at most kLargestRangeM

  // Size of a voxel: about the footprint of a beam at survey altitude.
  double voxel_m = 0.25;

  // A point is a spike where it is farther from the local seabed than min_spike_m and than
  // spike_sigmas times the local scatter. min_spike_m is a few sigma of a usual sonar's noise:
  // nearer to the seabed, an outlier does not harm the map.
  double min_spike_m = 0.3;
  double spike_sigmas = 5.0;
  // A spike is kept as a feature (pipeline, boulder, edge of a wreck) where at least so many other
  // soundings, and so large a fraction of all soundings around, lie at the same height. Where two
  // or more pings came there, they must be from more than one: one ping may have the same range
  // error in many neighbouring beams.
  int min_support = 3;
  double min_support_fraction = 0.04;
  // A point with fewer soundings around it is isolated, and dropped.
  int min_neighbours = 3;
  // Mean number of soundings per column, from which the local seabed is estimated: columns are made
  // as wide as that takes.
  double soundings_per_column = 6.0;
};
// Declares the section `filter` of config/mapper.yaml.
void DeclareFilter(CloudFilterParams* params, ParameterTable* table);

enum class SoundingGate : std::uint8_t { kPass, kNotFinite, kAboveVehicle, kTooNear, kTooFar };

// Map axes, z down.
SoundingGate CheckSounding(const Eigen::Vector3d& p_map,
                           const Eigen::Vector3d& p_map_vehicle,
                           const CloudFilterParams& params);

// For each point whether it stays (1) or is an outlier (0). Points in gravity-levelled axes; each
// must be finite. pings: behind each point. Around each column of the cloud a plane through robust
// column heights is the local seabed, so that a slope is not taken for spikes.
std::vector<std::uint8_t> FindSeabed(const PointCloud& cloud_level,
                                     const std::vector<PingSpan>& pings,
                                     const CloudFilterParams& params,
                                     const ForEach& for_each = ForEachInTurn);

}  // namespace seastitch
