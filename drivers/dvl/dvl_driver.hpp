#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/can/can_driver.hpp"
#include "drivers/dvl/dvl_can.hpp"
#include "drivers/dvl/dvl_nmea2000.hpp"

namespace seastitch {

using DvlDriverConfig = CanDeviceConfig<DvlCanParams, DvlN2kParams>;

// Throws ConfigError.
DvlDriverConfig LoadDvlDriverConfig(const std::string& path);
std::string PrintConfig(const DvlDriverConfig& config);
// As it is published on CONFIG: the file and the DBC file that it names.
std::vector<std::pair<std::string, std::string>> ConfigFiles(const DvlDriverConfig& config);
// Parameters of the device that config.device names.
ParameterTable TableOf(DvlDriverConfig* config);
// The names of the devices on a CAN bus.
std::vector<std::string> DvlCanDevices();
// Declares `sigma_mps`, for a DVL that does not send the sigma of its horizontal velocity.
void DeclareVelocitySigma(double* sigma_mps, ParameterTable* table);

// Driver of a DVL on CAN: puts out DVL, DEPTH and RAW_CAN.
class DvlDriver : public CanDriver {
 public:
  DvlDriver(const DvlDriverConfig& config, DriverOutput* output);

  void Finish() override { codec_->Finish(); }
  std::vector<CanFilter> filters() const override { return codec_->filters(); }
  Counters decoder_counters() const override { return codec_->counters(); }
  Counters clock_figures() const override { return codec_->clock_figures(); }

 private:
  void Decode(const CanFrame& frame, Time recv) override;

  std::unique_ptr<DvlCodec> codec_;
};

}  // namespace seastitch
