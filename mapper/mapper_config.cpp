#include "mapper/mapper_config.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>

#include "common/core/pose.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/runtime/files/whole_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

fs::path Beside(const std::string& file, const fs::path& path) {
  return (fs::absolute(file).parent_path() / path).lexically_normal();
}

// Reads a text file and parses it.
template <class T>
T Parsed(const fs::path& file) {
  const std::optional<std::string> text = ReadWholeFile(file);
  if (!text) throw ConfigError(file.string() + ": cannot be read");
  try {
    return T::Parse(*text, file.string());
  } catch (const std::runtime_error& e) {
    throw ConfigError(e.what());
  }
}

void LoadSeparation(const fs::path& file, MapperConfig* config) {
  config->vertical.separation = Parsed<DatumHeight>(file);
  config->separation_file = file;
}

}  // namespace

MapperConfig LoadMapperConfig(const std::string& path) {
  MapperConfig config;
  LoadParameters(path, TableOf(&config));
  config.vehicle = LoadVehicleBeside(path, &config.vehicle_file);
  if (!config.water_level_file.empty())
    LoadWaterLevel(Beside(path, config.water_level_file), &config);
  if (!config.separation_file.empty())
    LoadSeparation(Beside(path, config.separation_file), &config);
  ResolveDivesDir(path, &config.dive);
  if (config.sound_velocity_profile->depth_m.empty()) config.sound_velocity_profile.reset();
  config.mounting.dvl_yaw_rad =
      Hypotenuse(config.navigation.dvl_mounting_rad.sigma, config.sonar_mounting_yaw_rad);
  config.loop_closer.expected_overlap = config.submap.expected_overlap;
  return config;
}

void LoadWaterLevel(const fs::path& file, MapperConfig* config) {
  if (config->vertical.by_heights)
    throw ConfigError(file.string() + ": a water level beside ellipsoid_heights: one of the two");
  config->vertical.water_level = Parsed<WaterLevel>(file);
  config->water_level_file = file;
}

std::string PrintConfig(const MapperConfig& config) { return PrintWithDefaults(config, {}); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const MapperConfig& config) {
  MapperConfig mapper = config;
  mapper.vehicle_file = "vehicle.yaml";
  if (!config.vertical.water_level.empty()) mapper.water_level_file = kWaterLevelFile;
  const DatumHeight& separation = config.vertical.separation;
  if (!separation.empty()) mapper.separation_file = kSeparationFile;
  std::vector<std::pair<std::string, std::string>> files{
      {"mapper.yaml", PrintConfig(mapper)}, {"vehicle.yaml", PrintConfig(config.vehicle)}};
  if (!config.vertical.water_level.empty())
    files.emplace_back(kWaterLevelFile, config.vertical.water_level.text());
  if (!separation.empty()) files.emplace_back(kSeparationFile, separation.text());
  return files;
}

std::string ConfigurationOf(const MapperConfig& config) {
  std::string text;
  for (const auto& [name, content] : ConfigFiles(config)) text += name + "\n" + content;
  return text;
}

}  // namespace seastitch
