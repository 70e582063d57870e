#include "drivers/dvl/pd0_driver.hpp"

#include "common/core/channel_names.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "drivers/dvl/dvl_driver.hpp"

namespace seastitch {

ParameterTable TableOf(Pd0DriverConfig* config) {
  ParameterTable table;
  DeclareDevice(&config->device, {config->device}, &table);
  DeclareDriver(&config->driver, &table);
  DeclareClock(&config->pd0.clock, true, &table);
  table
      .Add("beam_angle_deg",
           &config->pd0.beam_angle_rad,
           Unit::kDegreeFromRadian,
           Range::Within(5.0, 60.0),
           "Angle of the beams from the DVL's z axis.")
      .DataSheet();
  DeclareVelocitySigma(&config->pd0.sigma_mps, &table);
  table
      .Add("depth_sigma_m",
           &config->pd0.depth_sigma_m,
           Unit::kMetre,
           Range::Within(0.0, 10.0),
           "Sigma of the depth of the transducer, which is published as DEPTH; its resolution is "
           "0.1 "
           "m. 0: not published. Only for a DVL with a pressure sensor: others send a constant.")
      .DataSheet();
  return table;
}

Pd0DriverConfig LoadPd0DriverConfig(const std::string& path) {
  Pd0DriverConfig config;
  LoadParameters(path, TableOf(&config));
  CheckSource(path, config.driver, SourceKind::kDatagrams);
  return config;
}

std::set<std::string> Pd0DriverConfig::output_channels() const {
  std::set<std::string> channels{channels::kDvl};
  if (pd0.depth_sigma_m > 0.0) channels.insert(channels::kDepth);
  return channels;
}

std::string PrintConfig(const Pd0DriverConfig& config) { return PrintWithDefaults(config, {}); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const Pd0DriverConfig& config) {
  return {{"dvl_driver.yaml", PrintConfig(config)}};
}

Pd0Driver::Pd0Driver(const Pd0DriverConfig& config, DriverOutput* output)
    : DatagramDriver("dvl-driver", channels::kRawDvl, config.driver, output),
      decoder_(config.pd0) {}

bool Pd0Driver::Decode(const Datagram& datagram) {
  const std::vector<Pd0Output> outputs = decoder_.Add(datagram.bytes, datagram.recv);
  for (const Pd0Output& output : outputs) {
    Put(output.dvl, datagram.recv, "dvl");
    if (output.depth) Put(*output.depth, datagram.recv, "depth");
  }
  return !outputs.empty();
}

}  // namespace seastitch
