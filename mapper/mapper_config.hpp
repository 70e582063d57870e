#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/core/mounting.hpp"
#include "common/core/sensors.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/loop_closer.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "mapper/submaps/cloud_filter.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {

// Everything the mapper is told at its start: config/mapper.yaml says what each is and why.
struct MapperConfig {
  VehicleGeometry vehicle;
  NavigationParams navigation;
  SubmapParams submap;
  CloudFilterParams filter;
  LoopCloserParams loop_closer;
  std::optional<SoundVelocityProfile> sound_velocity_profile;
  std::filesystem::path survey_dir = "survey";
  std::int64_t max_cached_mb = 64;
  std::int64_t max_unsaved_mb = 128;
  double nav_rate_hz = 10.0;
  MountingSigmas mounting{0.3, 0.0};  // dvl_yaw_rad: from the file
  // Pings that wait for navigation to reach their last echo; the oldest are dropped beyond.
  int max_waiting_pings = 600;
  // Submaps that wait for the worker; beyond, they go into the graph without being registered.
  int max_waiting_submaps = 8;
};

// Paths in the file are relative to the file. Throws ConfigError.
MapperConfig LoadMapperConfig(const std::string& path);

}  // namespace seastitch
