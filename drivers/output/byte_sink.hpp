#pragma once

#include <netinet/in.h>

#include <memory>
#include <string>
#include <string_view>

#include "common/core/health/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {

// A receiver of text: a UDP port or a serial port. It never waits for its receiver: what that does
// not take is dropped and counted. It opens again what was lost, with a try every second.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  // Whole lines. UDP: one datagram.
  virtual void Send(std::string_view lines) = 0;
  // Call it once a second.
  virtual void Check() = 0;
  // Why it cannot send, for people; empty while it can.
  virtual std::string trouble() const = 0;
  // Prefix udp_ or serial_: send_errors, dropped (lines that the receiver did not take in time).
  const Counters& counters() const { return counters_; }

 protected:
  Counters counters_;
};

// "udp:HOST:PORT[?interface=eth1]": to a host, a broadcast address, or a multicast group on an
// interface; or "serial:DEVICE[?baud=9600]". Throws std::runtime_error "URL: reason".
std::unique_ptr<ByteSink> OpenByteSink(const std::string& url);

// Throws std::runtime_error "TEXT: reason" if the URL is not one of a sink. Devices and interfaces
// need not exist.
void ExpectSink(const std::string& url);

}  // namespace seastitch
