#include "mapper/mapper_config.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "bench/sensor_errors.hpp"
#include "common/runtime/config/config.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
const fs::path kConfigDir = SourceDir() / "config";

// The line that LoadMapperConfig() throws for a file with this text; empty where it does not throw.
std::string ErrorOf(const std::string& text) {
  const fs::path dir =
      fs::path(testing::TempDir()) / ("seastitch_mapper_config_" + std::to_string(::getpid()));
  fs::create_directories(dir);
  fs::copy_file(
      kConfigDir / "vehicle.yaml", dir / "vehicle.yaml", fs::copy_options::overwrite_existing);
  std::ofstream(dir / "mapper.yaml") << text;
  std::string what;
  try {
    LoadMapperConfig((dir / "mapper.yaml").string());
  } catch (const ConfigError& e) {
    what = e.what();
  }
  fs::remove_all(dir);
  return what;
}

TEST(MapperConfig, ShippedFileLoads) {
  const MapperConfig config = LoadMapperConfig((kConfigDir / "mapper.yaml").string());
  EXPECT_EQ(config.dive.dives_dir, SourceDir() / "dives");
  EXPECT_NEAR(Rad2Deg(config.vehicle.datum.latitude_rad), 43.07, 1e-9);
}

TEST(MapperConfig, TurnsOfDvlAndSonarAddUpAsTheirSquares) {
  const MapperConfig shipped = LoadMapperConfig((kConfigDir / "mapper.yaml").string());
  EXPECT_NEAR(Rad2Deg(shipped.mounting.dvl_yaw_rad), std::sqrt(0.2 * 0.2 + 0.1 * 0.1), 1e-9);
}

void ExpectTheFileOfAClassToSayWhatTheBenchSimulates(const std::string& name) {
  SCOPED_TRACE(name);
  const NavigationParams p =
      LoadMapperConfig((kConfigDir / ("mapper_" + name + ".yaml")).string()).navigation;
  const auto errors = bench::SensorErrors::OfClass(name);
  EXPECT_DOUBLE_EQ(p.gyro_noise_radps_rthz, errors.gyro_noise_radps_rthz);
  EXPECT_DOUBLE_EQ(p.gyro_bias_radps.sigma, errors.gyro_bias_radps);
  EXPECT_DOUBLE_EQ(p.accel_noise_mps2_rthz, errors.accel_noise_mps2_rthz);
  EXPECT_DOUBLE_EQ(p.accel_bias_mps2.sigma, errors.accel_bias_mps2);
  EXPECT_NEAR(Rad2Deg(p.attitude_roll_pitch_rad.sigma.x()), errors.roll_pitch_wander_deg, 1e-12);
  EXPECT_EQ(p.attitude_roll_pitch_rad.tau_s, errors.roll_pitch_wander_tau_s);
  EXPECT_NEAR(Rad2Deg(p.attitude_heading_rad.sigma), errors.heading_bias_deg, 1e-12);
  EXPECT_NEAR(Rad2Deg(p.attitude_heading_wander_rad.sigma), errors.heading_wander_deg, 1e-12);
  EXPECT_EQ(p.attitude_heading_wander_rad.tau_s, errors.heading_wander_tau_s);
  EXPECT_NEAR(Rad2Deg(p.attitude_deviation_rad), errors.heading_deviation_deg, 1e-12);
  EXPECT_DOUBLE_EQ(p.dvl_sigma_mps, errors.dvl_noise_mps);
  EXPECT_DOUBLE_EQ(p.dvl_scale.sigma, errors.dvl_scale);
  EXPECT_NEAR(Rad2Deg(p.dvl_mounting_rad.sigma), errors.dvl_misalignment_deg, 1e-12);
  EXPECT_DOUBLE_EQ(p.depth_bias_m.sigma, errors.depth_bias_m);
}

TEST(MapperConfig, FilesOfAClassSayWhatTheBenchSimulates) {
  for (const char* name : {"mems", "ins_tactical"})
    ExpectTheFileOfAClassToSayWhatTheBenchSimulates(name);
}

TEST(MapperConfig, NeedsNothingButTheVehicle) {
  EXPECT_EQ(ErrorOf("vehicle: vehicle.yaml\n"), "");
  EXPECT_NE(ErrorOf("nav_rate_hz: 10\n").find("vehicle: missing"), std::string::npos);
  EXPECT_NE(ErrorOf("vehicle: nowhere.yaml\n").find("nowhere.yaml"), std::string::npos);
}

TEST(MapperConfig, ReadsADiveOfBeforeTheNamesWereSettled) {
  EXPECT_EQ(ErrorOf("vehicle: vehicle.yaml\nsonar_mounting_m: 0.1\nnavigation: {gyro_step_radps: "
                    "0.001, window_s: 2000}\nregistration: {ambiguity_floor: 9}\n"),
            "");
}

TEST(MapperConfig, NamesTheKeyThatIsWrong) {
  const auto names = [](const std::string& text, const std::string& key) {
    const std::string error = ErrorOf("vehicle: vehicle.yaml\n" + text);
    return error.find("mapper.yaml: " + key) != std::string::npos ? std::string() : "got: " + error;
  };
  EXPECT_EQ(names("submaps: {}\n", "submaps: unknown key"), "");
  EXPECT_EQ(names("submap: {max_lenght_m: 5}\n", "submap.max_lenght_m: unknown key"), "");
  EXPECT_EQ(names("submap: {max_length_m: wide}\n", "submap.max_length_m: 'wide' is not"), "");
  EXPECT_EQ(
      names("submap: {max_length_m: 5}\n", "submap.max_length_m: '5' is not above min_length_m"),
      "");
  EXPECT_EQ(
      names("filter: {voxel_m: .nan}\n", "filter.voxel_m: '.nan' is not a number from 0.01 to 10"),
      "");
  EXPECT_EQ(names("overlap: {max_pairs: 500}\n", "overlap.max_pairs: '500' is not"), "");
  EXPECT_EQ(
      names("registration: {method: icp}\n", "registration.method: 'icp' is not grid or gicp"), "");
  EXPECT_EQ(names("registration: {gicp_voxel_m: 0}\n", "registration.gicp_voxel_m: '0' is not"),
            "");
  EXPECT_EQ(names("registration: {z_sigma_m: 0}\n", "registration.z_sigma_m: '0' is not"), "");
  EXPECT_EQ(names("nav_rate_hz: 0\n", "nav_rate_hz: '0' is not"), "");
  EXPECT_EQ(names("sonar_mounting_sigma_m: -0.1\n", "sonar_mounting_sigma_m: '-0.1' is not"), "");
  EXPECT_EQ(names("sonar_mounting_sigma_deg: 400\n", "sonar_mounting_sigma_deg: '400' is not"), "");
  EXPECT_EQ(names("dives_dir: ''\n", "dives_dir: '\"\"' is not"), "");
  EXPECT_EQ(names("survey_dir: a\n", "survey_dir: was removed, submaps go into"), "");
  EXPECT_EQ(names("navigation: {history_s: 1000}\n", "navigation.history_s: '1000' is not"), "");
  EXPECT_EQ(names("sound_velocity_profile: {depth_m: [0, 10], speed_mps: [1500]}\n",
                  "sound_velocity_profile.speed_mps: '[1500]' is not"),
            "");
  EXPECT_EQ(names("sound_velocity_profile: {depth_m: [0, 10], speed_mps: [340, 340]}\n",
                  "sound_velocity_profile.speed_mps: '[340, 340]' is not"),
            "");
}

// A dive that was recorded before replays with its own configuration.
TEST(MapperConfig, ReadsOverAKeyThatNothingHasTakenThePlaceOf) {
  EXPECT_EQ(ErrorOf("vehicle: vehicle.yaml\nregistration: {error_correlation_length_m: 10}\n"), "");
}

}  // namespace
}  // namespace seastitch
