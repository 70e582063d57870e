#include "drivers/datagram_driver.hpp"

#include <memory>

#include "drivers/socket/byte_source.hpp"

namespace seastitch {

bool DatagramDriver::Feed(const Datagram& datagram) {
  health().Tick("pieces");
  PutRaw(datagram.bytes, datagram.recv);
  return Decode(datagram);
}

int Run(DatagramDriver* driver, Bus* bus, EventLoop* loop) {
  const DriverParams& params = driver->params();
  const std::unique_ptr<ByteSource> source =
      OpenByteSource(params.source, params.receive_buffer_bytes);
  Datagram datagram;
  const auto feed = [driver, &source, &datagram] {
    // At most 64 at a time: in a flood, signals and health still get their turn.
    for (int i = 0; i < 64 && source->Receive(&datagram); ++i)
      if (driver->Feed(datagram)) source->Understood(datagram);
  };
  const auto update_health = [driver, &source] {
    source->Check();
    driver->UpdateHealth(
        source->counters(), DeviceWatch::Clock::now(), source->trouble(), source->refusal());
  };
  return driver->Run(source->fd(), feed, update_health, bus, loop);
}

}  // namespace seastitch
