#pragma once

#include <string>

#include "drivers/device_driver.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Base class of drivers of a device that sends UDP datagrams, or a byte stream in pieces (TCP).
class DatagramDriver : public DeviceDriver {
 public:
  DatagramDriver(const std::string& name,
                 const std::string& raw_channel,
                 const DriverParams& params,
                 DriverOutput* output)
      : DeviceDriver(name, raw_channel, params.source, params, output) {}

  // Puts out the bytes, then decodes them. Returns whether they could be decoded.
  bool Feed(const Datagram& datagram);

 protected:
  virtual bool Decode(const Datagram& datagram) = 0;
};

// Runs a driver on its source until a signal.
int Run(DatagramDriver* driver, Bus* bus, EventLoop* loop);

}  // namespace seastitch
