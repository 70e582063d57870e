#pragma once

#include <string>
#include <vector>

#include "drivers/can/can_driver.hpp"
#include "drivers/imu/imu_can.hpp"

namespace seastitch {

struct ImuDriverConfig {
  CanDriverParams driver;
  ImuCanParams can;
};

// Throws ConfigError.
ImuDriverConfig LoadImuDriverConfig(const std::string& path);

// CAN frames to IMU and RAW_CAN.
class ImuDriver : public CanDriver {
 public:
  ImuDriver(const ImuDriverConfig& config, Bus* bus);

  void Finish() override;
  std::vector<CanFilter> filters() const override { return decoder_.filters(); }

 private:
  void Decode(const CanFrame& frame, Time recv) override;
  const Counters& decoder_counters() const override { return decoder_.counters(); }
  Counters clock_figures() const override { return decoder_.clock_figures(); }
  void Publish(const ImuSample& sample);

  ImuCanDecoder decoder_;
  std::int64_t seq_ = 0;
};

}  // namespace seastitch
