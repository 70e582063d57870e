#include "drivers/imu/imu_driver.hpp"

#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "drivers/registry.hpp"

namespace seastitch {
namespace {

void ReadAttitudeSigma(ConfigMap* root, Eigen::Vector3d* sigma_rad) {
  std::vector<double> sigma_deg;
  root->Read("attitude_sigma_deg", &sigma_deg);
  if (sigma_deg.empty()) return;
  if (sigma_deg.size() != 3) root->Check("attitude_sigma_deg: expected roll, pitch and yaw");
  for (std::size_t i = 0; i < 3; ++i)
    (*sigma_rad)[static_cast<Eigen::Index>(i)] = Deg2Rad(sigma_deg[i]);
}

void ReadSignals(ConfigMap* root, ImuDriverConfig* config) {
  config->can.clock = ReadClockParams(root);
  root->Read("max_epoch_s", &config->can.max_epoch_s);
  ReadAttitudeSigma(root, &config->can.attitude_sigma_rad);
  config->can.signals = ReadSignalMap(root, kImuFieldKeys);
  root->Check(config->can.Validate());
}

void ReadNmea2000(ConfigMap* root, ImuDriverConfig* config) {
  config->nmea2000.clock = ReadClockParams(root);
  root->Read("source_address", &config->nmea2000.source);
  root->Read("max_epoch_s", &config->nmea2000.max_epoch_s);
  ReadAttitudeSigma(root, &config->nmea2000.sigma_rpy_rad);
  root->Check(config->nmea2000.Validate());
}

struct Device {
  const char* name;
  void (*read)(ConfigMap* root, ImuDriverConfig* config);
  std::unique_ptr<ImuCodec> (*make)(const ImuDriverConfig& config);
};

constexpr Device kDevices[] = {
    {"signals",
     ReadSignals,
     [](const ImuDriverConfig& c) -> std::unique_ptr<ImuCodec> {
       return std::make_unique<ImuCanDecoder>(c.can);
     }},
    {"nmea2000",
     ReadNmea2000,
     [](const ImuDriverConfig& c) -> std::unique_ptr<ImuCodec> {
       return std::make_unique<ImuN2kDecoder>(c.nmea2000);
     }},
};

}  // namespace

ImuDriverConfig LoadImuDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  ImuDriverConfig config;
  root.Read("device", &config.device);
  if (const std::string problem = ProblemWithName(kDevices, config.device); !problem.empty())
    root.Check("device: " + problem);
  config.driver = ReadDriverParams(&root);
  FindEntry(kDevices, config.device)->read(&root, &config);
  root.Finish();
  return config;
}

ImuDriver::ImuDriver(const ImuDriverConfig& config, Bus* bus)
    : CanDriver("imu-driver", config.driver, bus),
      codec_(FindEntry(kDevices, config.device)->make(config)) {}

void ImuDriver::Decode(const CanFrame& frame, Time recv) {
  if (const std::optional<ImuSample> sample = codec_->Add(frame, recv)) Publish(*sample);
}

void ImuDriver::Finish() {
  if (const std::optional<ImuSample> sample = codec_->Finish()) Publish(*sample);
}

void ImuDriver::Publish(const ImuSample& sample) {
  bus_->Publish("IMU", ToLcm(sample, MessageStamp{codec_->epoch_recv(), seq_++}));
  OnPublished("imu");
}

}  // namespace seastitch
