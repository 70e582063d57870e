#include "tools/vehicle/setup.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <vector>

#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/nav/nav_driver.hpp"
#include "drivers/output/nav_output_node.hpp"
#include "drivers/socket/source_url.hpp"
#include "logger/logger_config.hpp"
#include "mapper/mapper_config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "page/page_node.hpp"
#include "page/process_roll.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kLcmBufferBytes = 8 * 1024 * 1024;

void LoadImu(const std::string& file, Setup* setup) {
  const ImuDriverConfig config = LoadImuDriverConfig(file);
  for (const auto& [name, text] : ConfigFiles(config)) setup->texts["imu-driver"][name] = text;
  setup->drivers.emplace("imu-driver", config.driver);
}

void LoadDvl(const std::string& file, Setup* setup) {
  std::vector<std::string> devices = DvlCanDevices();
  devices.push_back(Pd0DriverConfig{}.device);
  if (DeviceIn(file, devices) == Pd0DriverConfig{}.device) {
    const Pd0DriverConfig config = LoadPd0DriverConfig(file);
    setup->texts["dvl-driver"]["dvl_driver.yaml"] = PrintConfig(config);
    setup->drivers.emplace("dvl-driver", config.driver);
  } else {
    const DvlDriverConfig config = LoadDvlDriverConfig(file);
    for (const auto& [name, text] : ConfigFiles(config)) setup->texts["dvl-driver"][name] = text;
    setup->drivers.emplace("dvl-driver", config.driver);
  }
}

void LoadMbes(const std::string& file, Setup* setup) {
  const MbesDriverConfig config = LoadMbesDriverConfig(file);
  setup->texts["mbes-driver"]["mbes_driver.yaml"] = PrintConfig(config);
  setup->drivers.emplace("mbes-driver", config.driver);
}

void LoadNav(const std::string& file, Setup* setup) {
  const NavDriverConfig config = LoadNavDriverConfig(file);
  setup->nav_channels = config.output_channels();
  if (config.sources().empty()) return;
  for (const auto& [name, text] : ConfigFiles(config)) setup->texts[kNavDriver][name] = text;
  for (const std::string& source : config.sources())
    setup->drivers.emplace(
        kNavDriver,
        DriverParams{.source = source, .receive_buffer_bytes = config.receive_buffer_bytes});
}

void LoadNavOutput(const std::string& file, Setup* setup) {
  const NavOutputConfig config = LoadNavOutputConfig(file);
  if (config.outputs().empty()) return;
  setup->nav_output_udp = config.udp;
  setup->nav_output_serial = config.serial;
  for (const auto& [name, text] : ConfigFiles(config)) setup->texts[kNavOutput][name] = text;
}

void LoadMapper(const std::string& file, Setup* setup) {
  const MapperConfig config = LoadMapperConfig(file);
  for (const auto& [name, text] : ConfigFiles(config)) setup->texts["mapper"][name] = text;
  setup->dives["mapper"] = config.dive;
  setup->given_navigation = config.navigation_source == NavigationSource::kGiven;
}

void LoadOptimizer(const std::string& file, Setup* setup) {
  setup->texts["optimizer"]["optimizer.yaml"] = PrintConfig(LoadOptimizerConfig(file));
}

void LoadLogger(const std::string& file, Setup* setup) {
  const LoggerConfig config = LoadLoggerConfig(file);
  setup->texts["logger"]["logger.yaml"] = PrintConfig(config);
  setup->dives["logger"] = config.dive;
}

void LoadPage(const std::string& file, Setup* setup) {
  const PageConfig config = LoadPageConfig(file);
  setup->page_listen = config.listen;
  if (!config.dives_dir.empty()) setup->dives[kPage].dives_dir = config.dives_dir;
}

// The port of which only one process gets the bytes; empty for a source of another kind.
std::string PortOf(const std::string& source) {
  if (source.starts_with("udp:"))
    return "UDP port " +
           std::to_string(HostPortOf(ParseSourceUrl(source, {"interface", "from"})).port);
  if (!source.starts_with("serial:")) return "";
  // A device has several names, such as those of /dev/serial/by-id.
  std::error_code missing;
  const std::filesystem::path device =
      std::filesystem::weakly_canonical(ParseSourceUrl(source, {"baud"}).address, missing);
  return "serial port " + device.string();
}

}  // namespace

bool Setup::Needs(const std::string& process) const {
  if (process == kNavDriver) return !nav_channels.empty();
  if (process == kNavOutput) return texts.contains(kNavOutput);
  if (process == kPage) return false;
  return !given_navigation || (process != "imu-driver" && process != "dvl-driver");
}

std::set<std::string> Setup::can_interfaces() const {
  std::set<std::string> interfaces;
  for (const auto& [process, driver] : drivers)
    if (driver.source.starts_with("can:"))
      interfaces.insert(ParseSourceUrl(driver.source, {}).address);
  return interfaces;
}

std::int64_t Setup::largest_buffer_bytes() const {
  std::int64_t bytes = kLcmBufferBytes;
  for (const auto& [process, driver] : drivers)
    bytes = std::max<std::int64_t>(bytes, driver.receive_buffer_bytes);
  return bytes;
}

Setup LoadSetup(const std::filesystem::path& config_dir, Findings* findings) {
  Setup setup;
  const std::vector<std::pair<std::string, std::function<void(const std::string&, Setup*)>>> files{
      {"imu_driver.yaml", LoadImu},
      {"dvl_driver.yaml", LoadDvl},
      {"mbes_driver.yaml", LoadMbes},
      {"nav_driver.yaml", LoadNav},
      {"nav_output.yaml", LoadNavOutput},
      {"mapper.yaml", LoadMapper},
      {"optimizer.yaml", LoadOptimizer},
      {"logger.yaml", LoadLogger},
      {"page.yaml", LoadPage}};
  const std::set<std::string> optional{"nav_driver.yaml", "nav_output.yaml", "page.yaml"};
  for (const auto& [name, load] : files) {
    const std::string file = (config_dir / name).string();
    if (optional.contains(name) && !std::filesystem::exists(file)) continue;
    try {
      load(file, &setup);
      findings->push_back(Ok("configuration", file + ": can be used"));
    } catch (const std::exception& e) {
      findings->push_back(
          Error("configuration", e.what(), "Mend the key; docs/configuration.md has all of them."));
    }
  }
  std::erase_if(setup.texts, [&](const auto& entry) { return !setup.Needs(entry.first); });
  std::erase_if(setup.drivers, [&](const auto& entry) { return !setup.Needs(entry.first); });
  return setup;
}

Findings CheckTogether(const Setup& setup) {
  Findings findings;
  std::map<std::string, std::string> taken;  // port and its user
  for (const auto& [process, driver] : setup.drivers) {
    const std::string port = PortOf(driver.source);
    if (port.empty()) continue;
    const auto [other, is_free] = taken.try_emplace(port, process);
    if (!is_free)
      findings.push_back(Error("sources",
                               other->second + " and " + process + " both use " + port,
                               "Give each its own port in source."));
  }
  const std::string output = PortOf(setup.nav_output_serial);
  if (taken.contains(output))
    findings.push_back(Error("sources",
                             taken.at(output) + " and " + kNavOutput + " both use " + output,
                             "Give each its own port: source, and serial of nav_output.yaml."));
  const auto logger = setup.dives.find("logger");
  const auto mapper = setup.dives.find("mapper");
  if (logger == setup.dives.end() || mapper == setup.dives.end()) return findings;
  if (logger->second.dives_dir != mapper->second.dives_dir)
    findings.push_back(Error("dives_folder",
                             "dives_dir: " + logger->second.dives_dir.string() +
                                 " in logger.yaml, " + mapper->second.dives_dir.string() +
                                 " in mapper.yaml: one dive becomes two folders",
                             "Name the same folder in both."));
  else if (logger->second.resume_within_s != mapper->second.resume_within_s)
    findings.push_back(
        Error("dives_folder",
              "dive_resume_within_s differs in logger.yaml and mapper.yaml: one dive "
              "may become two folders",
              "Give both the same value."));
  else
    findings.push_back(
        Ok("dives_folder", "dives go to " + logger->second.dives_dir.string() + ", of both"));
  return findings;
}

}  // namespace seastitch
