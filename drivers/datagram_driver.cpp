#include "drivers/datagram_driver.hpp"

#include <chrono>

#include "common/convert/convert.hpp"

namespace seastitch {

std::string DatagramDriverParams::Validate() const {
  if (source.empty()) return "source: missing";
  if (receive_buffer_bytes < 65'536 || receive_buffer_bytes > 256 * 1024 * 1024)
    return "receive_buffer_bytes must be 65536 to 268435456";
  if (!(timeout_s > 0.0 && timeout_s <= 3600.0)) return "timeout_s must be above 0, at most 3600";
  return "";
}

DatagramDriverParams ReadDatagramDriverParams(ConfigMap* root) {
  DatagramDriverParams params;
  root->Require("source", &params.source);
  root->Read("receive_buffer_bytes", &params.receive_buffer_bytes);
  root->Read("timeout_s", &params.timeout_s);
  root->Check(params.Validate());
  return params;
}

DatagramDriver::DatagramDriver(const std::string& name,
                               const std::string& raw_channel,
                               const DatagramDriverParams& params,
                               Bus* bus)
    : bus_(bus),
      source_(params.source),
      raw_channel_(raw_channel),
      health_(name),
      watch_(params.source, params.timeout_s, &health_) {}

void DatagramDriver::Feed(const Datagram& datagram) {
  health_.Tick("udp_datagrams");
  for (const raw_bytes_t& part : ToRawParts(datagram.bytes, source_, datagram.recv, raw_seq_)) {
    bus_->Publish(raw_channel_, part);
    ++raw_seq_;
  }
  Decode(datagram);
}

void DatagramDriver::OnPublished(const std::string& stream) {
  health_.Tick(stream);
  watch_.OnData();
}

void DatagramDriver::UpdateHealth(const Counters& socket,
                                  DeviceWatch::Clock::time_point now,
                                  const std::string& trouble) {
  SetAll(socket, &health_);
  SetAll(decoder_counters(), &health_);
  SetAll(clock_figures(), &health_);
  health_.Set("lcm_publish_errors", bus_->publish_errors());
  watch_.Check(now, trouble);
}

int RunDatagramDriver(DatagramDriver* driver,
                      const DatagramDriverParams& params,
                      Bus* bus,
                      EventLoop* loop) {
  UdpSocket socket(params.source, params.receive_buffer_bytes);
  const auto update_health = [driver, &socket] {
    socket.CheckInterface();
    driver->UpdateHealth(socket.counters(), DeviceWatch::Clock::now(), socket.trouble());
  };
  Datagram datagram;
  loop->Add(socket.fd(), [driver, &socket, &datagram] {
    // Not until it is empty: signals and health want their turn in a flood.
    for (int i = 0; i < 64 && socket.Receive(&datagram); ++i) driver->Feed(datagram);
  });
  update_health();
  loop->Every(std::chrono::seconds(1), update_health);
  driver->health().PublishEverySecond(bus, loop);
  return loop->Run();
}

}  // namespace seastitch
