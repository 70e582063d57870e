#include "survey/plan/survey_config.hpp"

#include <algorithm>

#include "survey/read/sbet_beside.hpp"

namespace seastitch {
namespace {

// Scales the shipped configuration, made for some tens of metres of water, to the depth below the
// sonar: a ship's footprints, line spacing and ping intervals grow with the depth.
void ScaleToDepth(const SurveyPlan& plan, MapperConfig* config) {
  const auto at_least = [](double value, double* key) { *key = std::max(*key, value); };
  at_least(1.5 * plan.max_range_m, &config->filter.max_range_m);
  config->filter.max_range_m = std::min(config->filter.max_range_m, kLargestRangeM);
  at_least(std::min(0.01 * plan.depth_m, 10.0), &config->filter.voxel_m);
  at_least(0.01 * plan.depth_m, &config->filter.min_spike_m);
  at_least(1.0 * plan.depth_m, &config->submap.min_length_m);
  at_least(3.0 * config->submap.min_length_m, &config->submap.max_length_m);
  constexpr double kShipMps = 8.0;
  at_least(4.0 * plan.ping_interval_s, &config->submap.max_gap_s);
  at_least(4.0 * plan.ping_interval_s * kShipMps, &config->submap.max_gap_m);
}

// The vehicle's own mounting, with what the files state: the map origin and the point whose depth
// they give. Processed navigation is that of the reference point and in the vehicle's axes.
VehicleGeometry WithSurvey(VehicleGeometry own, const SurveyPlan& plan) {
  own.datum.latitude_rad = plan.vehicle.datum.latitude_rad;
  own.datum.longitude_rad = plan.vehicle.datum.longitude_rad;
  own.p_vehicle_depth_m = plan.vehicle.p_vehicle_depth_m;
  if (IsExternal(plan.position_source)) own.T_vehicle_imu.translation().setZero();
  if (IsExternal(plan.attitude_source)) own.T_vehicle_imu.linear().setIdentity();
  return own;
}

}  // namespace

void UseSurvey(const SurveyPlan& plan, bool given_vehicle, MapperConfig* config) {
  config->navigation_source = NavigationSource::kGiven;
  const bool own = given_vehicle && !plan.has_installation && plan.raw_pings;
  config->vehicle = own ? WithSurvey(config->vehicle, plan) : plan.vehicle;
  ScaleToDepth(plan, config);
}

SurveyConfigFiles SurveyConfigFilesFor(const std::filesystem::path& log) {
  return {log.string() + ".vehicle.yaml", log.string() + ".mapper.yaml"};
}

}  // namespace seastitch
