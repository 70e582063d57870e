#include "drivers/device_driver.hpp"

#include <chrono>

#include "common/convert/convert.hpp"

namespace seastitch {

std::string DriverParams::Validate() const {
  if (source.empty()) return "source: missing";
  if (receive_buffer_bytes < 65'536 || receive_buffer_bytes > 256 * 1024 * 1024)
    return "receive_buffer_bytes must be 65536 to 268435456";
  if (!(timeout_s > 0.0 && timeout_s <= 3600.0)) return "timeout_s must be above 0, at most 3600";
  return "";
}

DriverParams ReadDriverParams(ConfigMap* root) {
  DriverParams params;
  root->Require("source", &params.source);
  root->Read("receive_buffer_bytes", &params.receive_buffer_bytes);
  root->Read("timeout_s", &params.timeout_s);
  root->Check(params.Validate());
  return params;
}

ClockParams ReadClockParams(ConfigMap* root) {
  ClockParams params;
  std::string clock = "device";
  root->Read("clock", &clock);
  if (clock == "device")
    params.clock = DeviceClock::kDevice;
  else if (clock == "model")
    params.clock = DeviceClock::kModel;
  else if (clock == "receive")
    params.clock = DeviceClock::kReceive;
  else
    root->Check("clock: '" + clock + "' is not device, model or receive");
  root->Read("latency_s", &params.latency_s);
  root->Check(params.Validate());
  return params;
}

DeviceDriver::DeviceDriver(const std::string& name,
                           const std::string& raw_channel,
                           const std::string& raw_source,
                           const DriverParams& params,
                           Bus* bus)
    : bus_(bus),
      raw_channel_(raw_channel),
      raw_source_(raw_source),
      health_(name),
      watch_(params.source, params.timeout_s, &health_) {}

void DeviceDriver::PublishRaw(const std::vector<std::uint8_t>& bytes, Time recv) {
  for (const raw_bytes_t& part : ToRawParts(bytes, raw_source_, recv, raw_seq_)) {
    bus_->Publish(raw_channel_, part);
    ++raw_seq_;
  }
}

void DeviceDriver::OnPublished(const std::string& stream) {
  health_.Tick(stream);
  watch_.OnData();
}

void DeviceDriver::UpdateHealth(const Counters& source,
                                DeviceWatch::Clock::time_point now,
                                const std::string& trouble) {
  SetAll(source, &health_);
  SetAll(decoder_counters(), &health_);
  SetAll(clock_figures(), &health_);
  health_.Set("lcm_publish_errors", bus_->publish_errors());
  watch_.Check(now, trouble);
}

int DeviceDriver::Run(int fd,
                      const std::function<void()>& feed,
                      const std::function<void()>& update_health,
                      EventLoop* loop) {
  loop->Add(fd, feed);
  update_health();
  loop->Every(std::chrono::seconds(1), update_health);
  health_.PublishEverySecond(bus_, loop);
  return loop->Run();
}

}  // namespace seastitch
