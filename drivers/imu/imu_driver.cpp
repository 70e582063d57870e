#include "drivers/imu/imu_driver.hpp"

#include "common/convert/convert.hpp"

namespace seastitch {

ImuDriverConfig LoadImuDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  ImuDriverConfig config;
  config.driver = ReadCanDriverParams(&root);
  config.can.clock = ReadClockParams(&root);
  root.Read("max_epoch_s", &config.can.max_epoch_s);
  config.can.signals = ReadSignalMap(&root, kImuFieldKeys);
  root.Finish();
  root.Check(config.can.Validate());
  return config;
}

ImuDriver::ImuDriver(const ImuDriverConfig& config, Bus* bus)
    : CanDriver("imu-driver", config.driver, bus), decoder_(config.can) {}

void ImuDriver::Decode(const CanFrame& frame, Time recv) {
  if (const std::optional<ImuSample> sample = decoder_.Add(frame, recv)) Publish(*sample);
}

void ImuDriver::Finish() {
  if (const std::optional<ImuSample> sample = decoder_.Finish()) Publish(*sample);
}

void ImuDriver::Publish(const ImuSample& sample) {
  bus_->Publish("IMU", ToLcm(sample, MessageStamp{decoder_.epoch_recv(), seq_++}));
  OnPublished("imu");
}

}  // namespace seastitch
