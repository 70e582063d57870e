#include "drivers/datagram_driver.hpp"

namespace seastitch {

bool DatagramDriver::Feed(const Datagram& datagram) {
  health().Tick("udp_datagrams");
  PublishRaw(datagram.bytes, datagram.recv);
  return Decode(datagram);
}

int RunDatagramDriver(DatagramDriver* driver, const DriverParams& params, EventLoop* loop) {
  UdpSocket socket(params.source, params.receive_buffer_bytes);
  Datagram datagram;
  const auto feed = [driver, &socket, &datagram] {
    // Not until it is empty: signals and health want their turn in a flood.
    for (int i = 0; i < 64 && socket.Receive(&datagram); ++i)
      if (driver->Feed(datagram)) socket.Understood(datagram);
  };
  const auto update_health = [driver, &socket] {
    socket.CheckInterface();
    driver->UpdateHealth(
        socket.counters(), DeviceWatch::Clock::now(), socket.trouble(), socket.refusal());
  };
  return driver->Run(socket.fd(), feed, update_health, loop);
}

}  // namespace seastitch
