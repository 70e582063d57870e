#include "drivers/dvl/pd0_driver.hpp"

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
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
  return table;
}

Pd0DriverConfig LoadPd0DriverConfig(const std::string& path) {
  Pd0DriverConfig config;
  TableOf(&config).Load(path);
  CheckSource(path, config.driver, SourceKind::kDatagrams);
  return config;
}

std::string PrintConfig(const Pd0DriverConfig& config) { return PrintWithDefaults(config, {}); }

Pd0Driver::Pd0Driver(const Pd0DriverConfig& config, Bus* bus)
    : DatagramDriver("dvl-driver", channels::kRawDvl, config.driver, bus), decoder_(config.pd0) {}

bool Pd0Driver::Decode(const Datagram& datagram) {
  const std::vector<DvlSample> samples = decoder_.Add(datagram.bytes, datagram.recv);
  for (const DvlSample& sample : samples) {
    bus_->Publish(channels::kDvl, ToLcm(sample, MessageStamp{datagram.recv, seq_++}));
    OnPublished("dvl");
  }
  return !samples.empty();
}

}  // namespace seastitch
