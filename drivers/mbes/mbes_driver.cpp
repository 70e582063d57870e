#include "drivers/mbes/mbes_driver.hpp"

#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"

namespace seastitch {

MbesDriverConfig LoadMbesDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  MbesDriverConfig config;
  config.driver = ReadDriverParams(&root);
  root.Read("format", &config.decoder.format);
  config.decoder.clock = ReadClockParams(&root);
  std::vector<double> head_roll_deg;
  root.Read("head_roll_deg", &head_roll_deg);
  for (const double roll : head_roll_deg)
    config.decoder.codec.head_roll_rad.push_back(Deg2Rad(roll));
  ConfigMap parts = root.Child("parts");
  parts.Read("max_parts", &config.decoder.codec.parts.max_parts);
  parts.Read("max_open", &config.decoder.codec.parts.max_open);
  parts.Read("max_age_s", &config.decoder.codec.parts.max_age_s);
  parts.Finish();
  root.Finish();
  root.Check(config.decoder.Validate());
  return config;
}

MbesDriver::MbesDriver(const MbesDriverConfig& config, Bus* bus)
    : DatagramDriver("mbes-driver", "RAW_MBES", config.driver, bus), decoder_(config.decoder) {}

void MbesDriver::Decode(const Datagram& datagram) {
  for (const MbesOutput& output : decoder_.Add(datagram.bytes, datagram.recv, datagram.sender)) {
    if (const auto* ping = std::get_if<MbesPing>(&output)) {
      bus_->Publish("MBES_PING", ToLcm(*ping, MessageStamp{datagram.recv, ping_seq_++}));
      OnPublished("mbes_pings");
    } else {
      bus_->Publish("SVP",
                    ToLcm(std::get<SoundVelocityProfile>(output),
                          MessageStamp{datagram.recv, profile_seq_++}));
      OnSidePublished("sound_velocity_profiles");
    }
  }
}

}  // namespace seastitch
