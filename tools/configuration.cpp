#include "tools/configuration.hpp"

#include "bench/survey_config.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/nav/nav_driver.hpp"
#include "drivers/output/nav_output_node.hpp"
#include "logger/logger_config.hpp"
#include "mapper/mapper_config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "page/page_node.hpp"

namespace seastitch {
namespace {

constexpr char kHead[] =
    "# Configuration\n\n"
    "Every key of every configuration file. `seastitch reference` writes this page, and a test "
    "compares "
    "it\nwith the programs. `--print-config` of a process, and of `seastitch replay`, writes the "
    "effective\nconfiguration with the same sentences; without `--config`, the defaults.\n\n"
    "A key that is unknown, occurs twice or has a value out of range ends the program at its "
    "start, "
    "with\none line: file, key, value, what was expected. A key under an earlier name is accepted "
    "with one\nwarning. Start with the values from the data sheets; the others are for experts.\n\n"
    "## Ten keys that people change\n\n"
    "| file | key | when |\n|---|---|---|\n"
    "| `vehicle.yaml` | `position_m`, `roll_pitch_yaw_deg` of each sensor | always: "
    "lever arms and mounting angles |\n"
    "| `vehicle.yaml` | `datum` | always: origin of the map, within 200 km of the survey |\n"
    "| `*_driver.yaml` | `source` | always: the interface, port or address of the device |\n"
    "| `*_driver.yaml` | `clock` | where the device's clock is not disciplined |\n"
    "| `mapper.yaml` | `navigation.*` | always: accuracies from the data sheets of compass, "
    "inertial "
    "unit and Doppler log; begin with `mapper_mems.yaml` or `mapper_ins_tactical.yaml` |\n"
    "| `mapper.yaml` | `navigation_source` | where an INS navigates |\n"
    "| `mapper.yaml` | `given_navigation.uses_position_fixes` | for an INS with GPS or USBL all "
    "the "
    "time |\n"
    "| `mapper.yaml` | `sonar_mounting_sigma_m`, `sonar_mounting_sigma_deg` | after a patch test "
    "|\n"
    "| `mapper.yaml` | `water_level`, `vertical_datum` | with a tide gauge |\n"
    "| `logger.yaml` | `dives_dir` | where the data disk is mounted |\n";

template <class Config>
ConfigurationFile FileOf(std::string name, std::string title, Config defaults = {}) {
  auto config = std::make_shared<Config>(std::move(defaults));
  ParameterTable table = TableOf(config.get());
  return {std::move(name), std::move(title), config, std::move(table)};
}

template <class Config>
ConfigurationFile FileOfDevice(std::string name, std::string title, std::string device) {
  Config config;
  config.device = std::move(device);
  return FileOf(std::move(name), std::move(title), std::move(config));
}

}  // namespace

std::vector<ConfigurationFile> ConfigurationFiles() {
  std::vector<ConfigurationFile> files;
  files.push_back(FileOf<MapperConfig>("mapper.yaml", "Mapper and `seastitch replay`"));
  files.push_back(FileOf<VehicleFile>("vehicle.yaml", "Vehicle"));
  files.push_back(FileOf<OptimizerParams>("optimizer.yaml", "Optimizer"));
  files.push_back(FileOf<LoggerConfig>("logger.yaml", "Logger"));
  files.push_back(FileOfDevice<ImuDriverConfig>(
      "imu_driver.yaml", "Inertial unit that a DBC file describes", kSignalDevice));
  files.push_back(FileOfDevice<ImuDriverConfig>(
      "imu_nmea2000.yaml", "Attitude sensor on NMEA 2000", "nmea2000"));
  files.push_back(FileOfDevice<DvlDriverConfig>(
      "dvl_driver.yaml", "Doppler log that a DBC file describes", kSignalDevice));
  files.push_back(
      FileOfDevice<DvlDriverConfig>("dvl_nmea2000.yaml", "Doppler log on NMEA 2000", "nmea2000"));
  files.push_back(FileOf<Pd0DriverConfig>("dvl_pd0.yaml", "Doppler log with PD0 over UDP"));
  files.push_back(FileOf<MbesDriverConfig>("mbes_driver.yaml", "Sonar"));
  files.push_back(FileOf<NavDriverConfig>("nav_driver.yaml", "INS, GPS, USBL and pressure sensor"));
  files.push_back(FileOf<NavOutputConfig>("nav_output.yaml", "NAV as NMEA 0183 for others"));
  files.push_back(FileOf<PageConfig>("page.yaml", "Page of the vehicle for browsers"));
  files.push_back(FileOf<bench::SurveyConfig>("config/bench/demo.yaml",
                                              "Simulated survey of `seastitch bench`"));
  return files;
}

std::string ConfigurationPage() {
  std::string page = kHead;
  for (const ConfigurationFile& file : ConfigurationFiles())
    page += "\n## " + file.title + ": `" + file.name + "`\n\n" + ReferenceOf(file.table);
  while (page.ends_with("\n\n")) page.pop_back();
  return page;
}

}  // namespace seastitch
