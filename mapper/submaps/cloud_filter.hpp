#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/submap.hpp"
#include "mapper/submaps/voxel_grid.hpp"

// Which soundings are seabed. A gate that needs nothing but the vehicle drops what no sonar can
// have seen, sounding by sounding; the outlier filter looks at the finished, voxelled submap.
namespace seastitch {

struct CloudFilterParams {
  // From the vehicle's reference point. Below the minimum is the sonar's own ringing; beyond the
  // maximum no sonar of ours finds the bottom.
  double min_range_m = 0.5;
  double max_range_m = 300.0;

  // Size of a voxel: about the footprint of a beam at survey altitude.
  double voxel_m = 0.25;

  // A point is a spike where it is further from the local seabed than min_spike_m and than
  // spike_sigmas times the local scatter, and nearly alone there. The minimum is a few sigma of
  // a usual sonar's noise: closer in, an outlier does the map no harm.
  double min_spike_m = 0.3;
  double spike_sigmas = 5.0;
  // Not alone, so a pipeline, a boulder or the edge of a wreck: at least so many other soundings,
  // and so large a part of all soundings around, lie at the same height; not all from one ping,
  // where two came there (one may miss by the same range over a whole run of beams).
  int min_support = 3;
  double min_support_fraction = 0.04;
  // Fewer other soundings than this around a point: it hangs in empty space.
  int min_neighbours = 3;
  // Mean soundings a column that the local seabed is judged by: columns grow until they hold them.
  double soundings_per_column = 6.0;
};

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
                                     const CloudFilterParams& params);

}  // namespace seastitch
