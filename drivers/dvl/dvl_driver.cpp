#include "drivers/dvl/dvl_driver.hpp"

#include "common/convert/convert.hpp"
#include "drivers/registry.hpp"

namespace seastitch {
namespace {

void ReadSignals(ConfigMap* root, DvlDriverConfig* config) {
  config->can.clock = ReadClockParams(root);
  root->Read("max_ensemble_s", &config->can.max_ensemble_s);
  config->can.signals = ReadSignalMap(root, kDvlFieldKeys);
  root->Check(config->can.Validate());
}

void ReadNmea2000(ConfigMap* root, DvlDriverConfig* config) {
  config->nmea2000.clock = ReadClockParams(root);
  root->Read("source_address", &config->nmea2000.source);
  root->Read("sigma_mps", &config->nmea2000.sigma_mps);
  root->Read("sigma_z_mps", &config->nmea2000.sigma_z_mps);
  root->Read("max_depth_age_s", &config->nmea2000.max_depth_age_s);
  root->Check(config->nmea2000.Validate());
}

struct Device {
  const char* name;
  void (*read)(ConfigMap* root, DvlDriverConfig* config);
  std::unique_ptr<DvlCodec> (*make)(const DvlDriverConfig& config);
};

constexpr Device kDevices[] = {
    {"signals",
     ReadSignals,
     [](const DvlDriverConfig& c) -> std::unique_ptr<DvlCodec> {
       return std::make_unique<DvlCanDecoder>(c.can);
     }},
    {"nmea2000",
     ReadNmea2000,
     [](const DvlDriverConfig& c) -> std::unique_ptr<DvlCodec> {
       return std::make_unique<DvlN2kDecoder>(c.nmea2000);
     }},
};

}  // namespace

DvlDriverConfig LoadDvlDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  DvlDriverConfig config;
  root.Read("device", &config.device);
  if (const std::string problem = ProblemWithName(kDevices, config.device); !problem.empty())
    root.Check("device: " + problem + ", pd0");
  config.driver = ReadDriverParams(&root);
  FindEntry(kDevices, config.device)->read(&root, &config);
  root.Finish();
  return config;
}

DvlDriver::DvlDriver(const DvlDriverConfig& config, Bus* bus)
    : CanDriver("dvl-driver", config.driver, bus),
      codec_(FindEntry(kDevices, config.device)->make(config)) {}

void DvlDriver::Decode(const CanFrame& frame, Time recv) {
  const DvlOutput output = codec_->Add(frame, recv);
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
