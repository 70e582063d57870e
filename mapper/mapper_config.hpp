#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/parameters/parameters.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "mapper/mapper_params.hpp"

namespace seastitch {

// Configuration of the mapper's process: the parameters of the Mapper and the place of its files.
// TableOf() has each key with its meaning.
struct MapperConfig : MapperParams {
  // By default a vehicle's start position is unknown until a fix or the file states it. (Code that
  // sets MapperParams itself usually states it.)
  MapperConfig() { navigation.start_at_first_fix = true; }

  std::filesystem::path vehicle_file = "vehicle.yaml";  // of `vehicle`
  std::filesystem::path water_level_file;               // of `water_level`; empty: none
  std::filesystem::path separation_file;  // of `ellipsoid_heights.separation_grid`; empty: none
  std::int64_t vertical_datum_epsg = 0;   // of `vertical_datum`; 0: not stated
  double sonar_mounting_yaw_rad = Deg2Rad(0.1);
  // A replay applies what the survey's overlaps show of `calibration`.
  bool calibrate = true;
  DiveParams dive;
  std::filesystem::path map_dir;  // of submaps, in the dive's folder; no key of the file
  std::int64_t max_cached_mb = 64;
  std::int64_t max_unsaved_mb = 128;
  // Longest time from the last checkpoint to the first sample of the inertial unit (or INS), by
  // their stamps, for continuing the map.
  double map_resume_within_s = 1800.0;
};

// Name of the water-level file beside a recorded mapper.yaml.
inline constexpr char kWaterLevelFile[] = "water_level.csv";
inline constexpr char kSeparationFile[] = "separation.asc";

// Paths in the file are relative to the file. Throws ConfigError.
MapperConfig LoadMapperConfig(const std::string& path);

// The effective configuration as mapper.yaml.
std::string PrintConfig(const MapperConfig& config);

// Reads the table of water levels. Throws ConfigError.
void LoadWaterLevel(const std::filesystem::path& file, MapperConfig* config);

// mapper.yaml and the files that it names, for one folder: names and texts.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const MapperConfig& config);

// The same as one text, for comparing configurations.
std::string ConfigurationOf(const MapperConfig& config);

ParameterTable TableOf(MapperConfig* config);

}  // namespace seastitch
