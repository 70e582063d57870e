#include "drivers/dvl/dvl_driver.hpp"

#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {
namespace {

void DeclareSignalDevice(DvlDriverConfig* config, ParameterTable* table) {
  DeclareClock(&config->can.clock, true, table);
  table->Add("max_ensemble_s",
             &config->can.max_ensemble_s,
             Unit::kSecond,
             Range::Above(0.0).AtMost(1.0),
             "Longest time between the first and the last frame of one ensemble. Increase it for a "
             "gateway that buffers, up to half the ping period.");
  DeclareSignals(kDvlFieldKeys, &config->signals, table);
}

void DeclareNmea2000(DvlDriverConfig* config, ParameterTable* table) {
  DvlN2kParams* p = &config->nmea2000;
  DeclareClock(&p->clock, false, table);
  DeclareSourceAddress(&p->source, table);
  DeclareVelocitySigma(&p->sigma_mps, table);
  table->Add(
      "sigma_z_mps",
      &p->sigma_z_mps,
      Unit::kMetrePerSecond,
      Range::Above(0.0).AtMost(100.0),
      "Sigma of the vertical velocity, which the DVL does not send and which is published as 0.");
  table->Add("max_depth_age_s",
             &p->max_depth_age_s,
             Unit::kSecond,
             Range::Within(0.0, 10.0),
             "Greatest age of a depth below the transducer that is published as altitude.");
}

struct Device {
  const char* name;
  void (*declare)(DvlDriverConfig* config, ParameterTable* table);
  std::unique_ptr<DvlCodec> (*make)(const DvlDriverConfig& config);
};

constexpr Device kDevices[] = {
    {kSignalDevice,
     DeclareSignalDevice,
     [](const DvlDriverConfig& c) -> std::unique_ptr<DvlCodec> {
       return std::make_unique<DvlCanDecoder>(c.can);
     }},
    {"nmea2000",
     DeclareNmea2000,
     [](const DvlDriverConfig& c) -> std::unique_ptr<DvlCodec> {
       return std::make_unique<DvlN2kDecoder>(c.nmea2000);
     }},
};

}  // namespace

std::vector<std::string> DvlCanDevices() { return NamesOf(kDevices); }

ParameterTable TableOf(DvlDriverConfig* config) {
  ParameterTable table;
  DeclareDevice(&config->device, NamesOf(kDevices), &table);
  DeclareDriver(&config->driver, &table);
  FindEntry(kDevices, config->device)->declare(config, &table);
  return table;
}

void DeclareVelocitySigma(double* sigma_mps, ParameterTable* table) {
  table
      ->Add("sigma_mps",
            sigma_mps,
            Unit::kMetrePerSecond,
            Range::Above(0.0).AtMost(1.0),
            "Sigma of each horizontal component of the velocity, which the DVL does not send.")
      .DataSheet();
}

DvlDriverConfig LoadDvlDriverConfig(const std::string& path) {
  return LoadCanConfig<DvlDriverConfig>(path, NamesOf(kDevices), kDvlFieldKeys);
}

std::string PrintConfig(const DvlDriverConfig& config) { return PrintCanConfig(config); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const DvlDriverConfig& config) {
  return WithDbc("dvl_driver.yaml", config, &DvlDriverConfig::signals);
}

DvlDriver::DvlDriver(const DvlDriverConfig& config, DriverOutput* output)
    : CanDriver("dvl-driver", config.driver, output),
      codec_(FindEntry(kDevices, config.device)->make(config)) {}

void DvlDriver::Decode(const CanFrame& frame, Time recv) {
  const DvlOutput output = codec_->Add(frame, recv);
  if (output.dvl) Put(*output.dvl, recv, "dvl");
  if (output.depth) Put(*output.depth, recv, "depth");
}

}  // namespace seastitch
