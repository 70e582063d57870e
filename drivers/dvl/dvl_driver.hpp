#pragma once

#include <string>
#include <vector>

#include "drivers/can/can_driver.hpp"
#include "drivers/dvl/dvl_can.hpp"

namespace seastitch {

struct DvlDriverConfig {
  CanDriverParams driver;
  DvlCanParams can;
};

// Throws ConfigError.
DvlDriverConfig LoadDvlDriverConfig(const std::string& path);

// CAN frames to DVL, DEPTH and RAW_CAN.
class DvlDriver : public CanDriver {
 public:
  DvlDriver(const DvlDriverConfig& config, Bus* bus);

  void Finish() override { decoder_.Finish(); }
  std::vector<CanFilter> filters() const override { return decoder_.filters(); }

 private:
  void Decode(const CanFrame& frame, Time recv) override;
  const Counters& decoder_counters() const override { return decoder_.counters(); }
  Counters clock_figures() const override { return decoder_.clock_figures(); }

  DvlCanDecoder decoder_;
  std::int64_t dvl_seq_ = 0;
  std::int64_t depth_seq_ = 0;
};

}  // namespace seastitch
