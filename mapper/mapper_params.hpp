#pragma once

#include <cstdint>
#include <optional>

#include "common/core/calibration.hpp"
#include "common/core/mounting.hpp"
#include "common/core/sensors.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/input/vertical_reference.hpp"
#include "mapper/loops/loop_closer.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "mapper/submaps/cloud_filter.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {

// Source of the poses for the map.
enum class NavigationSource : std::uint8_t {
  kDeadReckoning,  // computed from IMU, DVL and depth
  kGiven,          // computed by an INS, from `INS`
};

// Parameters of a Mapper; config/mapper.yaml explains each.
struct MapperParams {
  VehicleGeometry vehicle;
  NavigationSource navigation_source = NavigationSource::kDeadReckoning;
  NavigationParams navigation;
  InsNavigationParams given_navigation;
  SubmapParams submap;
  CloudFilterParams filter;
  LoopCloserParams loop_closer;
  std::optional<SoundVelocityProfile> sound_velocity_profile;
  VerticalReferenceParams vertical;  // subtracted from every depth
  double sonar_time_offset_s = 0.0;  // added to the stamp of every MbesPing
  SonarCalibration calibration;
  double nav_rate_hz = 10.0;
  MountingSigmas mounting{0.3, 0.0};  // dvl_yaw_rad: from the configuration
  // Name of the graph. 0: the time of the first navigation state, so that a replay names it alike.
  std::int64_t graph_id = 0;
  // Limit of pings that wait for navigation to reach their last echo; beyond it the oldest are
  // dropped.
  int max_waiting_pings = 600;
  // Limit of submaps that wait to be registered; beyond it they join the graph without
  // registration.
  int max_waiting_submaps = 8;
};

}  // namespace seastitch
