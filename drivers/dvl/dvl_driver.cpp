#include "drivers/dvl/dvl_driver.hpp"

#include "common/convert/convert.hpp"

namespace seastitch {

DvlDriverConfig LoadDvlDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  DvlDriverConfig config;
  config.driver = ReadCanDriverParams(&root);
  config.can.clock = ReadClockParams(&root);
  root.Read("max_ensemble_s", &config.can.max_ensemble_s);
  config.can.signals = ReadSignalMap(&root, kDvlFieldKeys);
  root.Finish();
  root.Check(config.can.Validate());
  return config;
}

DvlDriver::DvlDriver(const DvlDriverConfig& config, Bus* bus)
    : CanDriver("dvl-driver", config.driver, bus), decoder_(config.can) {}

void DvlDriver::Decode(const CanFrame& frame, Time recv) {
  const DvlOutput output = decoder_.Add(frame, recv);
  if (output.dvl) {
    bus_->Publish("DVL", ToLcm(*output.dvl, MessageStamp{recv, dvl_seq_++}));
    OnPublished("dvl");
  }
  if (output.depth) {
    bus_->Publish("DEPTH", ToLcm(*output.depth, MessageStamp{recv, depth_seq_++}));
    OnPublished("depth");
  }
}

}  // namespace seastitch
