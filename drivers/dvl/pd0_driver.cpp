#include "drivers/dvl/pd0_driver.hpp"

#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"

namespace seastitch {

Pd0DriverConfig LoadPd0DriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  Pd0DriverConfig config;
  std::string device;
  root.Read("device", &device);
  config.driver = ReadDriverParams(&root);
  config.pd0.clock = ReadClockParams(&root);
  double beam_angle_deg = Rad2Deg(config.pd0.beam_angle_rad);
  root.Read("beam_angle_deg", &beam_angle_deg);
  config.pd0.beam_angle_rad = Deg2Rad(beam_angle_deg);
  root.Read("sigma_mps", &config.pd0.sigma_mps);
  root.Finish();
  root.Check(config.pd0.Validate());
  return config;
}

Pd0Driver::Pd0Driver(const Pd0DriverConfig& config, Bus* bus)
    : DatagramDriver("dvl-driver", "RAW_DVL", config.driver, bus), decoder_(config.pd0) {}

void Pd0Driver::Decode(const Datagram& datagram) {
  for (const DvlSample& sample : decoder_.Add(datagram.bytes, datagram.recv)) {
    bus_->Publish("DVL", ToLcm(sample, MessageStamp{datagram.recv, seq_++}));
    OnPublished("dvl");
  }
}

}  // namespace seastitch
