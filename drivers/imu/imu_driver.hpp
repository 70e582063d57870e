#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/can/can_driver.hpp"
#include "drivers/imu/imu_can.hpp"
#include "drivers/imu/imu_nmea2000.hpp"

namespace seastitch {

using ImuDriverConfig = CanDeviceConfig<ImuCanParams, ImuN2kParams>;

// Throws ConfigError.
ImuDriverConfig LoadImuDriverConfig(const std::string& path);
std::string PrintConfig(const ImuDriverConfig& config);
// As it is published on CONFIG: the file and the DBC file that it names.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const ImuDriverConfig& config);
// Parameters of the device that config.device names.
ParameterTable TableOf(ImuDriverConfig* config);

// Driver of an inertial unit on CAN: puts out IMU and RAW_CAN.
class ImuDriver : public CanDriver {
 public:
  ImuDriver(const ImuDriverConfig& config, DriverOutput* output);

  void Finish() override;
  std::vector<CanFilter> filters() const override { return codec_->filters(); }
  Counters decoder_counters() const override { return codec_->counters(); }
  Counters clock_figures() const override { return codec_->clock_figures(); }

 private:
  void Decode(const CanFrame& frame, Time recv) override;

  std::unique_ptr<ImuCodec> codec_;
};

}  // namespace seastitch
