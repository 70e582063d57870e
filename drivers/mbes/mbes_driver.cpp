#include "drivers/mbes/mbes_driver.hpp"

#include "common/convert/convert.hpp"
#include "common/runtime/config.hpp"
#include "drivers/can/can_driver.hpp"

namespace seastitch {

std::string MbesDriverConfig::Validate() const {
  if (receive_buffer_bytes < 65'536 || receive_buffer_bytes > 256 * 1024 * 1024)
    return "receive_buffer_bytes must be 65536 to 268435456";
  if (!(timeout_s > 0.0 && timeout_s <= 3600.0)) return "timeout_s must be above 0, at most 3600";
  return decoder.Validate();
}

MbesDriverConfig LoadMbesDriverConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  MbesDriverConfig config;
  root.Read("source", &config.source);
  root.Read("receive_buffer_bytes", &config.receive_buffer_bytes);
  root.Read("timeout_s", &config.timeout_s);
  config.decoder.clock = ReadClockParams(&root);
  ConfigMap parts = root.Child("parts");
  parts.Read("max_parts", &config.decoder.parts.max_parts);
  parts.Read("max_open", &config.decoder.parts.max_open);
  parts.Read("max_age_s", &config.decoder.parts.max_age_s);
  parts.Finish();
  root.Finish();
  root.Check(config.Validate());
  return config;
}

MbesDriver::MbesDriver(const MbesDriverConfig& config, Bus* bus)
    : bus_(bus),
      source_(config.source),
      decoder_(config.decoder),
      health_("mbes-driver"),
      watch_(config.source, config.timeout_s, &health_) {}

void MbesDriver::Feed(const Datagram& datagram) {
  health_.Tick("mbes_datagrams");
  PublishRaw(datagram);
  const std::optional<MbesOutput> output =
      decoder_.Add(datagram.bytes, datagram.recv, datagram.sender);
  if (!output) return;
  if (const auto* ping = std::get_if<MbesPing>(&*output)) {
    bus_->Publish("MBES_PING", ToLcm(*ping, MessageStamp{datagram.recv, ping_seq_++}));
    health_.Tick("mbes_pings");
    watch_.OnData();
  } else {
    bus_->Publish("SVP",
                  ToLcm(std::get<SoundVelocityProfile>(*output),
                        MessageStamp{datagram.recv, profile_seq_++}));
    health_.Tick("sound_velocity_profiles");
  }
}

void MbesDriver::PublishRaw(const Datagram& datagram) {
  for (const raw_bytes_t& part : ToRawParts(datagram.bytes, source_, datagram.recv, raw_seq_)) {
    bus_->Publish("RAW_MBES", part);
    ++raw_seq_;
  }
}

void MbesDriver::UpdateHealth(const Counters& socket,
                              DeviceWatch::Clock::time_point now,
                              const std::string& trouble) {
  SetAll(socket, &health_);
  SetAll(decoder_.counters(), &health_);
  SetAll(decoder_.clock_figures(), &health_);
  health_.Set("lcm_publish_errors", bus_->publish_errors());
  watch_.Check(now, trouble);
}

}  // namespace seastitch
