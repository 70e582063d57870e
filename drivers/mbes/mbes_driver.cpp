#include "drivers/mbes/mbes_driver.hpp"

#include <utility>

#include "common/core/channel_names.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {

ParameterTable TableOf(MbesDriverConfig* config) {
  ParameterTable table;
  table
      .AddChoice("format",
                 &config->decoder.format,
                 MbesFormats(),
                 "Data format: Kongsberg EM, R2Sonic, Teledyne Reson SeaBat or Norbit WBMS.")
      .DataSheet();
  DeclareDriver(&config->driver, &table);
  DeclareClock(&config->decoder.clock, true, &table);
  table
      .Add("head_roll_deg",
           &config->decoder.codec.head_roll_rad,
           Unit::kDegreeFromRadian,
           Range::Within(-90.0, 90.0),
           "Mounting roll of each receiver in the sonar's frame, one value per head, positive when "
           "the receiver looks to port. For a sonar with two heads. It is subtracted from the "
           "receive angles, before the mounting of the sonar in vehicle.yaml. A head without a "
           "value has 0.")
      .DataSheet();
  PartCollectorParams* parts = &config->decoder.codec.parts;
  ParameterTable& section =
      table.AddSection("parts", "Reassembly of large datagrams, which the sonar sends in parts.");
  section.Add("max_parts",
              &parts->max_parts,
              Unit::kNone,
              Range::Within(1, 64),
              "Maximum number of parts of one datagram.");
  section.Add("max_open",
              &parts->max_open,
              Unit::kNone,
              Range::Within(1, 16),
              "Maximum number of datagrams that are incomplete at the same time.");
  section.Add("max_age_s",
              &parts->max_age_s,
              Unit::kSecond,
              Range::Above(0.0).AtMost(60.0),
              "Age at which an incomplete datagram is dropped, by the times in its parts (s7k: by "
              "receive stamps).");
  return table;
}

MbesDriverConfig LoadMbesDriverConfig(const std::string& path) {
  MbesDriverConfig config;
  LoadParameters(path, TableOf(&config));
  CheckSource(path,
              config.driver,
              IsStream(config.decoder.format) ? SourceKind::kStream : SourceKind::kDatagrams);
  return config;
}

std::string PrintConfig(const MbesDriverConfig& config) { return PrintWithDefaults(config, {}); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const MbesDriverConfig& config) {
  return {{"mbes_driver.yaml", PrintConfig(config)}};
}

MbesDriver::MbesDriver(const MbesDriverConfig& config, DriverOutput* output)
    : DatagramDriver("mbes-driver", channels::kRawMbes, config.driver, output),
      decoder_(config.decoder) {}

bool MbesDriver::Decode(const Datagram& datagram) {
  std::vector<MbesOutput> outputs = decoder_.Add(datagram.bytes, datagram.recv, datagram.sender);
  for (MbesOutput& output : outputs) {
    if (auto* ping = std::get_if<MbesPing>(&output))
      Put(std::move(*ping), datagram.recv, "mbes_pings");
    else
      PutAside(std::get<SoundVelocityProfile>(std::move(output)),
               datagram.recv,
               "sound_velocity_profiles");
  }
  return !outputs.empty();
}

}  // namespace seastitch
