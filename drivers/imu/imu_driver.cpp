#include "drivers/imu/imu_driver.hpp"

#include "common/core/pose.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {
namespace {

void DeclareAttitudeSigma(Eigen::Vector3d* sigma_rad, Range range, ParameterTable* table) {
  table
      ->Add("attitude_sigma_deg",
            sigma_rad,
            Unit::kDegreeFromRadian,
            range,
            "Error of roll, pitch and yaw, 1 sigma each, for a unit that sends no sigmas.")
      .DataSheet();
}

void DeclareEpoch(double* max_epoch_s, ParameterTable* table) {
  table->Add(
      "max_epoch_s",
      max_epoch_s,
      Unit::kSecond,
      Range::Above(0.0).AtMost(1.0),
      "Longest time between the first and the last frame of one measurement, about 1 ms at 1 "
      "Mbit/s. Increase it for a gateway that buffers, up to half the measurement period.");
}

void DeclareSignalDevice(ImuDriverConfig* config, ParameterTable* table) {
  DeclareClock(&config->can.clock, true, table);
  DeclareEpoch(&config->can.max_epoch_s, table);
  DeclareAttitudeSigma(&config->can.attitude_sigma_rad, Range::Within(0.0, 180.0), table);
  DeclareSignals(kImuFieldKeys, &config->signals, table);
}

void DeclareNmea2000(ImuDriverConfig* config, ParameterTable* table) {
  DeclareClock(&config->nmea2000.clock, false, table);
  DeclareSourceAddress(&config->nmea2000.source, table);
  DeclareEpoch(&config->nmea2000.max_epoch_s, table);
  DeclareAttitudeSigma(&config->nmea2000.sigma_rpy_rad, Range::Above(0.0).AtMost(180.0), table);
}

struct Device {
  const char* name;
  void (*declare)(ImuDriverConfig* config, ParameterTable* table);
  std::unique_ptr<ImuCodec> (*make)(const ImuDriverConfig& config);
};

constexpr Device kDevices[] = {
    {kSignalDevice,
     DeclareSignalDevice,
     [](const ImuDriverConfig& c) -> std::unique_ptr<ImuCodec> {
       return std::make_unique<ImuCanDecoder>(c.can);
     }},
    {"nmea2000",
     DeclareNmea2000,
     [](const ImuDriverConfig& c) -> std::unique_ptr<ImuCodec> {
       return std::make_unique<ImuN2kDecoder>(c.nmea2000);
     }},
};

}  // namespace

ParameterTable TableOf(ImuDriverConfig* config) {
  ParameterTable table;
  DeclareDevice(&config->device, NamesOf(kDevices), &table);
  DeclareDriver(&config->driver, &table);
  FindEntry(kDevices, config->device)->declare(config, &table);
  return table;
}

ImuDriverConfig LoadImuDriverConfig(const std::string& path) {
  return LoadCanConfig<ImuDriverConfig>(path, NamesOf(kDevices), kImuFieldKeys);
}

std::string PrintConfig(const ImuDriverConfig& config) { return PrintCanConfig(config); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const ImuDriverConfig& config) {
  return WithDbc("imu_driver.yaml", config, &ImuDriverConfig::signals);
}

ImuDriver::ImuDriver(const ImuDriverConfig& config, DriverOutput* output)
    : CanDriver("imu-driver", config.driver, output),
      codec_(FindEntry(kDevices, config.device)->make(config)) {}

void ImuDriver::Decode(const CanFrame& frame, Time recv) {
  if (const auto sample = codec_->Add(frame, recv)) Put(*sample, codec_->epoch_recv(), "imu");
}

void ImuDriver::Finish() {
  if (const auto sample = codec_->Finish()) Put(*sample, codec_->epoch_recv(), "imu");
}

}  // namespace seastitch
