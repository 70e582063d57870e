#include "mapper/mapper_config.hpp"

#include <cmath>

#include "common/runtime/vehicle_config.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

fs::path Beside(const std::string& file, const fs::path& path) {
  return (fs::absolute(file).parent_path() / path).lexically_normal();
}

}  // namespace

MapperConfig LoadMapperConfig(const std::string& path) {
  MapperConfig config;
  TableOf(&config).Load(path);
  config.vehicle_file = Beside(path, config.vehicle_file);
  config.vehicle = LoadVehicle(config.vehicle_file.string());
  ResolveDivesDir(path, &config.dive);
  if (config.sound_velocity_profile->depth_m.empty()) config.sound_velocity_profile.reset();
  config.mounting.dvl_yaw_rad =
      std::hypot(config.navigation.dvl_mounting_rad.sigma, config.sonar_mounting_yaw_rad);
  config.loop_closer.expected_overlap = config.submap.expected_overlap;
  return config;
}

std::string PrintConfig(const MapperConfig& config) { return PrintWithDefaults(config, {}); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const MapperConfig& config) {
  MapperConfig mapper = config;
  mapper.vehicle_file = "vehicle.yaml";
  return {{"mapper.yaml", PrintConfig(mapper)}, {"vehicle.yaml", PrintConfig(config.vehicle)}};
}

std::string ConfigurationOf(const MapperConfig& config) {
  std::string text;
  for (const auto& [name, content] : ConfigFiles(config)) text += name + "\n" + content;
  return text;
}

}  // namespace seastitch
