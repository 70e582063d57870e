#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/socket/sender_gate.hpp"

namespace seastitch {

// Where CAN frames come from. A driver does not know which kind it has.
class CanSource {
 public:
  virtual ~CanSource() = default;

  // Readable when Receive() has something to do. The same for the life of the source, also while
  // the device behind it is gone.
  virtual int fd() const = 0;
  // Returns the queued frames (at most some hundred per call), in order; never blocks.
  virtual std::vector<ReceivedFrame> Receive() = 0;
  // True at the end of a log: no more frames will come.
  virtual bool finished() const { return false; }

  // Why no frames can be received, for people: "no such interface". Empty if they can.
  virtual std::string trouble() const { return ""; }

  // Times that the interface was down or gone: its controller then begins anew.
  virtual std::int64_t outages() const { return 0; }

  // Datagrams of other senders: see SenderGate.
  virtual SenderRefusal refusal() const { return {}; }

  // Such as can_frames_dropped, can_interface_down, cannelloni_malformed.
  virtual Counters counters() const = 0;
};

// Opens the source that the URL names; only frames that pass the filters will come out of it.
//   can:can0                  SocketCAN; retries while the interface is missing or down
//   candump:FILE[?speed=X]    can-utils log at X times its recorded pace (1 where not given),
//                             0: as fast as it can be read; finished() at its end
//   udp:HOST:PORT[?from=IP,IP]  cannelloni packets
// Throws std::runtime_error of one line, "URL: reason", where the URL or the file cannot be used,
// or the kernel has no CAN. It retries while another process holds the port.
std::unique_ptr<CanSource> OpenCanSource(const std::string& url,
                                         const std::vector<CanFilter>& filters,
                                         int receive_buffer_bytes);

}  // namespace seastitch
